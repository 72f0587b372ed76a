"""D9: a disk that is full before anything is recorded leaves no folder that blocks the same command."""

import contextlib
import errno
import shlex
import shutil
from pathlib import Path
from unittest import mock

import pytest

from cosim.errors import RunError
from cosim.results.run_result import COMMANDS_LOG, SCENARIO, load_run
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands.commands import ManualControl, SetTarget
from cosim.simulation.commands.sources import ScheduledCommands, read_log
from cosim.sitl.law import make_pwm_law
from cosim.sitl.sitl_flight import Flight
from cosim.sitl.sitl_session import scenario_to_fly
from tests.faults import FAIL_ON, FAIL_ONCE, arm, call_with_faults, count, needs_faults

ROOM = 4096  # bytes: for the scenario, and no record


def scenario():
    return load_scenario("paper", ["time.duration=0.1"])


@contextlib.contextmanager
def a_full_disk(of, monkeypatch):
    """Make every write of the named functions fail."""

    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        for place in of:
            patch.setattr(place, full)
        yield


PLACES = {
    "the record": ["cosim.results.recorder.Recorder._write"],
    "the vehicle's file": ["cosim.run.run_folder.files_of"],
}


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("of", PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("there", [False, True], ids=["new", "of its user"])
def test_d9_command_succeeds_after_disk_space_is_freed(tmp_path, monkeypatch, of, there):
    out, own = tmp_path / "run", scenario()
    if there:
        out.mkdir()
    if "files_of" in of[0]:
        shutil.copy("plant_fmu/vehicles/odin.toml", tmp_path / "boat.toml")
        (tmp_path / "it.toml").write_text('base = "paper"\nvehicle = "boat.toml"\ntime.duration = 0.1')
        own = load_scenario(tmp_path / "it.toml")
    with a_full_disk(of, monkeypatch), pytest.raises(RunError, match="No space left") as caught:
        run_scenario(own, out, report=False)
    kept = "" if "files_of" in of[0] else "; nothing of the run is kept"
    assert str(caught.value) == f"{out}: No space left on device{kept}"
    assert out.exists() == there and not (there and any(out.iterdir()))
    assert run_scenario(own, out, report=False).summary["status"] == "completed"


@pytest.mark.medium
@pytest.mark.parametrize("steps", [1, 3])
def test_d9_autopilot_run_on_a_full_disk_leaves_no_folder(tmp_path, monkeypatch, steps):
    own = scenario_to_fly("sitl", [], None, 400, "ardupilot")

    def flight():
        return Flight(own, make_pwm_law(own.vehicle), tmp_path / "run", 400.0)

    with a_full_disk(PLACES["the record"], monkeypatch):
        flown = flight()
        for _ in range(steps):
            flown.step()
        with pytest.raises(RunError, match="No space left"):
            flown.end()
    assert not (tmp_path / "run").exists()
    again = flight()
    again.step()
    again.end()
    assert again.conclude("completed", report=False).summary["steps"] == 0


# ---- the n-th system call that changes a file fails, for each n ----

COMMANDS = [(0, SetTarget((1.0, 0.0, 1.0))), (20, ManualControl((0.5, 0.0, 0.0, 0.0, 0.0, 0.0)))]


def fly(out, commands, report):
    own = scenario().replace({"commands.enabled": True}) if commands else scenario()
    with contextlib.ExitStack() as stack:
        if commands:  # as a pilot sends them
            stack.enter_context(mock.patch("cosim.run.run_scenario.CommandQueue", return_value=Pilot(COMMANDS)))
        return run_scenario(own, out, report=report)


class Pilot(ScheduledCommands):
    def end_run(self):
        pass


def check_run(out, line, commands):
    """Require that what a failed run says of its folder is what is there, and that it holds no half file."""
    files = {file.relative_to(out).as_posix() for file in out.rglob("*")} if out.exists() else set()
    assert not [name for name in files if ".tmp" in name or Path(name).name.startswith(".")]
    if "rows that were written are kept" in line:
        assert f"`cosim report {out}`" in line
        assert len(load_run(out).record) > 0
    elif "no row is kept" in line:
        assert commands and read_log(out / COMMANDS_LOG)
        words = shlex.split(line.split("`")[1])
        assert words == ["cd", str(out), "&&", "cosim", "run", SCENARIO, "--replay-commands", COMMANDS_LOG]
        again = run_scenario(
            load_scenario(out / SCENARIO), out / "again", report=False, commands_log=out / COMMANDS_LOG
        )
        assert again.summary["status"] == "completed"
        assert again.summary["commands"] == len(read_log(out / COMMANDS_LOG))
    else:
        assert not files, line


def fly_on_failing_disks(folder, commands, report):
    """Fly the same run with a fault at each call in turn, once and from there on."""
    commands, report = bool(commands), bool(report)
    arm(folder, 0)
    fly(Path(folder, "whole"), commands, report)
    total = count()
    said = set()
    for kind in (FAIL_ONCE, FAIL_ON):
        for n in sorted({*range(1, 9), *range(9, total, max(1, total // 4)), *range(total - 5, total + 1)}):
            out = Path(folder, f"run-{kind}-{n}")
            arm(folder, n, kind)
            line = ""
            try:
                fly(out, commands, report)
            except RunError as error:
                line = str(error)
            arm("", 0)
            if line:
                assert "No space left on device" in line, (n, line)
                check_run(out, line, commands)
                said.add(line.partition(";")[2][:25])
            shutil.rmtree(out, ignore_errors=True)
    assert len(said) >= 2, said


@needs_faults
@pytest.mark.timeout(1200)
@pytest.mark.slow
@pytest.mark.parametrize(("commands", "report"), [("", ""), ("x", ""), ("x", "x")])
def test_each_failing_call_leaves_what_the_line_says(tmp_path, commands, report):
    call_with_faults(fly_on_failing_disks, tmp_path, commands, report)
