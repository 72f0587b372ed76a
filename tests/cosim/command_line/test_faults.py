"""Verbs that write: on a full disk one line names the place, and after an interruption the same command goes on."""

import contextlib
import io
import shlex
import shutil
from pathlib import Path

import pytest

from cosim.campaigns.scenes.generator import generate_scenes
from cosim.command_line.cli import _parser, all_verbs, main
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from tests.faults import FAIL_ON, INTERRUPT, arm, call_with_faults, count, needs_faults

LOG = "t,depth,yaw,pitch,roll\n" + "".join(f"{0.1 * k},{0.02 * k},0,0,0\n" for k in range(30))
MAP = """
time = { column = "t" }
depth = { columns = ["depth"] }
attitude = { columns = ["yaw", "pitch", "roll"], euler = "ZYX" }
"""
BRIEF = "--set time.duration=0.1 --set arbiter.engine=closed"
IMPORT = "import dive.csv --vehicle bluerov2_heavy --map dive.toml"
WRITING = {  # smallest commands; {out} is what they write
    "run": f"run paper {BRIEF} --no-report --out {{out}}",
    "report": "report --replay run --out {out}.html",
    "import": f"{IMPORT} --no-report --out {{out}}",
    "export": "export run --to csv --out {out}.csv",
    "export to ssp": "export paper --to ssp --set arbiter.engine=closed --out {out}.ssp",
    "scenes": "scenes --count 3 --seed 0 --out {out}.jsonl",
    "campaign": "campaign s.jsonl --law pd --replays 0 --out {out}",
    "compare": "compare s.jsonl --laws pd,ismail_dunnigan --replays 0 --out {out}",
    "compare variants": "compare s.jsonl --ablate --variants net-weight --replays 0 --out {out}",
    "sweep": f"sweep paper --vary initial.position.1=-2:2 --samples 2 {BRIEF} --replays 1 --out {{out}}",
    "rerun": "rerun sweep 0 --out {out}",
    "falsify": f"falsify paper --vary initial.position.1=-2:2 --budget 2 {BRIEF} --replays 1 --out {{out}}",
}
ELSEWHERE = {"identify", "sitl", "companion"}  # one takes minutes, two need a vehicle on a link
REPEATED = {
    "import": f"{IMPORT} --no-report --out {{out}}",
    "import with report": f"{IMPORT} --out {{out}}",
    "csv": "export run --to csv --out {out}.csv",
    "mcap": "export run --to mcap --out {out}",
}
LINE = "cosim: interrupted; nothing is written, and the same command begins again\n"


def call(words):
    with contextlib.redirect_stderr(io.StringIO()) as said, contextlib.redirect_stdout(io.StringIO()):
        status = main(words)
    return status, said.getvalue()


def attempts(folder, command):
    """Count the file operations of a command; return their number, its folder, and a function that calls it."""
    Path("dive.csv").write_text(LOG)
    Path("dive.toml").write_text(MAP)
    Path("s.jsonl").write_text("\n".join(generate_scenes(2)))
    run_scenario(load_scenario("paper", ["time.duration=0.1"]), "run", report=False)
    if command.startswith("rerun"):
        assert call(shlex.split(WRITING["sweep"].format(out="sweep")))[0] == 0
    out = Path(folder, "out").resolve()
    words = [*shlex.split(command.format(out=out / "made")), "-q"]

    def attempt(n=0, fault=None):
        """Call the command in an empty folder; its `n`-th operation fails."""
        arm("", 0)
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir()
        arm(out, n, *([fault] if fault else []))
        came = call(words)
        total = count()
        arm("", 0)
        return *came, total

    status, said, total = attempt()
    assert (status, said) == (0, ""), said
    return total, out, attempt, lambda: call(words)


def fill_disk_at_each_call(folder, command):
    total, out, attempt, again = attempts(folder, command)
    for n in sorted({1, 2, 3, *range(4, total, max(1, total // 3))}):
        status, said, _ = attempt(n, FAIL_ON)
        if n == total and status == 0:  # a rename, for which the disk has room
            continue
        assert status == 2, (n, said)
        (line,) = said.splitlines()
        assert line.startswith("cosim: ") and str(out / "made") in line and "No space left" in line, (n, line)
        assert not [file for file in out.rglob(".*") if file.name != ".lock"], n
        if "kept, and `cosim report" not in line:
            assert again() == (0, ""), n


def interrupt_each_call(folder, command):
    total, out, attempt, again = attempts(folder, command)
    interrupted = 0
    for n in sorted({*range(1, 5), *range(5, total, max(1, total // 4)), *range(total - 3, total + 1)} - {0, -1}):
        status, said, _ = attempt(n, INTERRUPT)
        if status == 0:  # after the last call
            continue
        interrupted += 1
        assert (status, said) == (130, LINE), (n, said)
        assert not list(out.iterdir()), n
        assert again() == (0, ""), n
    assert interrupted > 4


@needs_faults
@pytest.mark.timeout(1200)
@pytest.mark.slow
@pytest.mark.parametrize("command", WRITING.values(), ids=WRITING)
def test_full_disk_is_one_line_that_names_the_place(tmp_path, command):
    call_with_faults(fill_disk_at_each_call, tmp_path, command)


@needs_faults
@pytest.mark.timeout(1200)
@pytest.mark.slow
@pytest.mark.parametrize("command", REPEATED.values(), ids=REPEATED)
def test_interrupted_verb_is_repeated_by_the_same_command(tmp_path, command):
    call_with_faults(interrupt_each_call, tmp_path, command)


def test_every_verb_that_writes_is_covered():
    writing = {name for name, verb in all_verbs(_parser()) if "--out" in verb._option_string_actions}
    assert writing == {command.split()[0] for command in WRITING.values()} | ELSEWHERE
