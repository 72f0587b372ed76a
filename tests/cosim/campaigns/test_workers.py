"""Campaigns in worker processes: equal rows, and completed rows survive any termination."""

import os
import signal

import pytest

from cosim.campaigns.campaign import run_campaign
from cosim.campaigns.store.folder import RESULTS
from cosim.campaigns.store.results import Results
from cosim.command_line.cli import main
from tests.cosim.campaigns.command import command, command_cache, needs_posix
from tests.cosim.campaigns.scene_data import HARD, many, rows, write

__all__ = ["command", "command_cache"]

N = 60


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the rows of scenes that were flown in one go, by one process."""
    folder = tmp_path_factory.mktemp("whole")
    return rows(run_campaign(write(folder / "s.jsonl", many(N)), "ismail_dunnigan", folder / "out").results)


@needs_posix
@pytest.mark.slow
def test_killed_campaign_resumes_with_the_same_command(tmp_path, command, whole):
    scenes = write(tmp_path / "s.jsonl", many(N))
    killed = command("campaign", scenes, "--law", "ismail_dunnigan", "--workers", 2)
    killed.wait_for_rows(3)
    os.kill(killed.process.pid, signal.SIGKILL)
    killed.process.communicate(timeout=240)  # which its workers, who follow, hold open
    assert killed.gone()
    before = killed.keys()
    assert len(before) >= 3 and len(set(before)) == len(before)

    again = command("campaign", scenes, "--law", "ismail_dunnigan", "--workers", 2)
    said, complaints = again.process.communicate(timeout=240)
    assert (again.process.returncode, complaints) == (0, "")
    assert f"of {N} scenes reached" in said and (again.out / "campaign.html").exists()
    results = Results(again.out / RESULTS)
    assert results["seed"].tolist() == list(range(1000, 1000 + N))
    assert rows(results) == whole
    left = [p.name for p in killed.temporary.iterdir() if p.name.startswith("plant_fmu-")]
    assert len(left) <= 1  # that of the killed process itself


@needs_posix
@pytest.mark.slow
@pytest.mark.parametrize(("workers", "sent"), [(1, signal.SIGINT), (2, signal.SIGHUP)])
def test_ctrl_c_or_closed_terminal_keeps_completed_rows(tmp_path, command, workers, sent):
    scenes = write(tmp_path / "s.jsonl", many(20 * N))  # more than are flown before the signal comes
    interrupted = command("campaign", scenes, "--law", "ismail_dunnigan", "--workers", workers)
    interrupted.wait_for_rows(2)
    os.killpg(interrupted.process.pid, sent)  # as a terminal does
    said, complaints = interrupted.process.communicate(timeout=240)
    assert interrupted.process.returncode == 130
    assert (
        complaints == f"cosim: interrupted; what is flown is kept in {interrupted.out}, and the same command goes on\n"
    )
    assert said == "" and interrupted.gone()
    assert len(interrupted.keys()) >= 2
    assert not list(interrupted.temporary.iterdir())


def test_folder_that_cannot_be_made_is_one_line(tmp_path, capsys):
    scenes = write(tmp_path / "s.jsonl", HARD)
    (tmp_path / "file").write_text("")
    words = ["campaign", str(scenes), "--law", "ismail_dunnigan", "--out", str(tmp_path / "file" / "out")]
    assert main(words) == 2 and capsys.readouterr().err.endswith("file/out: Not a directory\n")


@pytest.mark.parametrize("workers", ["0", "-1", "two", "1e3", "9999"])
def test_invalid_worker_counts_are_rejected(capsys, workers):
    with pytest.raises(SystemExit) as left:
        main(["campaign", "s.jsonl", "--law", "ismail_dunnigan", "--out", "out", "--workers", workers])
    assert left.value.code == 2 and "from 1 to 1024" in capsys.readouterr().err


@pytest.mark.medium
def test_scenes_are_read_from_standard_input(tmp_path, capsys, monkeypatch):
    scenes = write(tmp_path / "s.jsonl", HARD[:1])
    out = tmp_path / "out"
    words = ["--law", "ismail_dunnigan", "--out", str(out), "--replays", "0"]
    with scenes.open() as stream:
        monkeypatch.setattr("sys.stdin", stream)
        assert main(["campaign", "-", *words, "--report-failures"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(out / "campaign.html")
    assert main(["campaign", str(scenes), *words, "--report-failures"]) == 0
    assert "was complete already" in capsys.readouterr().out
    assert main(["campaign", str(scenes), *words]) == 2
    assert "conditions.report_failures is True, now False" in capsys.readouterr().err
