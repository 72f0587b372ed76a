"""Campaigns in processes of their own: the same rows, and whatever ends a process leaves what is done."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cosim.campaigns import run_campaign
from cosim.campaigns.folder import PARTS, RESULTS
from cosim.campaigns.results import Results
from cosim.cli import main
from tests.cosim.campaigns.scenes import HARD, many, rows, write

ROOT = Path(__file__).parents[3]


@pytest.mark.slow
def test_two_workers_give_the_same_rows_as_one(tmp_path):
    scenes = write(tmp_path / "s.jsonl", [*many(18), *HARD])
    one = run_campaign(scenes, "printed", tmp_path / "one")
    two = run_campaign(scenes, "printed", tmp_path / "two", workers=2)
    assert rows(one.results) == rows(two.results) and len(rows(one.results)) == 24


class Command:
    """``cosim campaign`` in a session of its own."""

    def __init__(self, folder, scenes, *words, workers=2):
        self.out, self.temporary = folder / "out", folder / "temporary"
        self.temporary.mkdir(exist_ok=True)
        words = ["campaign", str(scenes), "--law", "printed", "--out", str(self.out), "--workers", str(workers), *words]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "cosim", *words],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": str(ROOT), "TMPDIR": str(self.temporary), "XDG_CACHE_HOME": str(folder)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def end(self):
        """Leave nothing running."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.communicate()

    def wait_for_parts(self, n):
        """Wait until so many parts are written."""
        parts = self.out / PARTS
        deadline = time.monotonic() + 120.0
        while not parts.exists() or len(list(parts.glob("*.parquet"))) < n:
            assert self.process.poll() is None, self.process.communicate()[1]
            assert time.monotonic() < deadline
            time.sleep(0.01)

    def seeds(self):
        return [s for part in (self.out / PARTS).glob("*.parquet") for s in Results(part)["seed"].tolist()]

    def gone(self):
        """Return whether all processes of the session end by themselves, soon."""
        deadline = time.monotonic() + 20.0
        while self.members() and time.monotonic() < deadline:
            time.sleep(0.02)
        return not self.members()

    def members(self):
        """Return the processes of the session that still live."""
        found = []
        for entry in Path("/proc").iterdir():
            if entry.name.isdecimal():
                try:
                    fields = (entry / "stat").read_text().rpartition(")")[2].split()
                except OSError:
                    continue
                if int(fields[3]) == self.process.pid and fields[0] != "Z":
                    found.append(int(entry.name))
        return found


@pytest.fixture
def command(tmp_path):
    """Return a function that starts a command."""
    with contextlib.ExitStack() as stack:

        def start(*words, **options):
            started = Command(tmp_path, *words, **options)
            stack.callback(started.end)
            return started

        yield start


needs_posix = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")


@needs_posix
@pytest.mark.slow
def test_a_killed_campaign_goes_on_by_the_same_command(tmp_path, command):
    scenes = write(tmp_path / "s.jsonl", many(120))
    killed = command(scenes)
    killed.wait_for_parts(3)
    os.kill(killed.process.pid, signal.SIGKILL)
    killed.process.communicate(timeout=60)  # which its workers, who follow, hold open
    assert killed.gone()
    before = killed.seeds()
    assert len(before) >= 3 and len(set(before)) == len(before)

    again = command(scenes)
    said, complaints = again.process.communicate(timeout=120)
    assert (again.process.returncode, complaints) == (0, "")
    assert "of 120 scenes reached" in said
    results = Results(again.out / RESULTS)
    assert results["seed"].tolist() == list(range(1000, 1120))
    whole = run_campaign(scenes, "printed", tmp_path / "whole")
    assert rows(results) == rows(whole.results)
    left = [p.name for p in killed.temporary.iterdir() if p.name.startswith("plant_fmu-")]
    assert len(left) <= 1  # that of the killed process itself


@needs_posix
@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_ctrl_c_keeps_what_is_done(tmp_path, command, workers):
    scenes = write(tmp_path / "s.jsonl", many(200))
    interrupted = command(scenes, workers=workers)
    interrupted.wait_for_parts(2)
    os.killpg(interrupted.process.pid, signal.SIGINT)  # as a terminal does
    said, complaints = interrupted.process.communicate(timeout=60)
    assert interrupted.process.returncode == 130
    assert (
        complaints == f"cosim: interrupted; what is flown is kept in {interrupted.out}, and the same command goes on\n"
    )
    assert said == "" and interrupted.gone()
    assert len(interrupted.seeds()) >= 2
    assert not list(interrupted.temporary.iterdir())


@needs_posix
@pytest.mark.slow
def test_a_worker_that_is_killed_is_replaced(tmp_path, command):
    scenes = write(tmp_path / "s.jsonl", many(120))
    bereft = command(scenes)
    bereft.wait_for_parts(3)
    workers = [p for p in bereft.members() if b"spawn_main" in Path(f"/proc/{p}/cmdline").read_bytes()]
    os.kill(workers[0], signal.SIGKILL)
    _, complaints = bereft.process.communicate(timeout=120)
    assert bereft.process.returncode == 0 and bereft.gone()
    assert "rows are flown again" in complaints
    whole = run_campaign(scenes, "printed", tmp_path / "whole")
    assert rows(Results(bereft.out / RESULTS)) == rows(whole.results)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--law", "prinetd"], "law 'prinetd' is unknown; did you mean 'printed'"),
        (["--law", "printed", "--set", "k_p1=big"], "'big' is no number"),
        (["--law", "printed", "--set", "k_p1=-1"], "law.gains.k_p1 is -1.0"),
    ],
)
def test_what_the_user_must_mend_is_one_line(tmp_path, capsys, words, said):
    scenes = write(tmp_path / "s.jsonl", HARD)
    assert main(["campaign", str(scenes), "--out", str(tmp_path / "out"), *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("cosim: ") and said in line


@pytest.mark.parametrize("workers", ["0", "-1", "two", "1e3", "9999"])
def test_a_number_of_workers_that_cannot_be(capsys, workers):
    with pytest.raises(SystemExit) as left:
        main(["campaign", "s.jsonl", "--law", "printed", "--out", "out", "--workers", workers])
    assert left.value.code == 2 and "from 1 to 1024" in capsys.readouterr().err


def test_scenes_come_by_standard_input_too(tmp_path, capsys, monkeypatch):
    scenes = write(tmp_path / "s.jsonl", HARD[:1])
    out = tmp_path / "out"
    with scenes.open() as stream:
        monkeypatch.setattr("sys.stdin", stream)
        assert main(["campaign", "-", "--law", "printed", "--out", str(out), "--tell-failures"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(out / "summary.json")
    assert main(["campaign", str(scenes), "--law", "printed", "--out", str(out), "--tell-failures"]) == 0
    assert "was complete already" in capsys.readouterr().out
    assert main(["campaign", str(scenes), "--law", "printed", "--out", str(out)]) == 2
    assert "conditions.tell_failures is True, now False" in capsys.readouterr().err


def test_compare_from_the_command_line(tmp_path, capsys):
    scenes = write(tmp_path / "s.jsonl", HARD[:1])
    assert main(["compare", str(scenes), "--laws", "printed", "--out", str(tmp_path / "out")]) == 2
    assert "expected two or more" in capsys.readouterr().err
    assert main(["compare", str(scenes), "--laws", "printed,none", "--out", str(tmp_path / "out")]) == 2
    assert "law 'none' is unknown" in capsys.readouterr().err
