"""``cosim watch``: a run displayed in the terminal."""

import contextlib
import dataclasses
import fcntl
import io
import os
import pty
import re
import shutil
import struct
import subprocess
import sys
import termios
import threading
from unittest import mock

import numpy as np
import pytest
from rich.console import Console

from cosim.command_line.cli import main
from cosim.errors import RunError
from cosim.live.watching import Snapshot, snapshot_table, snapshots
from cosim.results.record import RECORD, STREAM, load_record
from cosim.results.recorder import Recorder
from cosim.results.run_result import SCENARIO
from cosim.simulation.signals import Column
from tests.threads import ended

PAPER = "arbiter.engine=closed"


@pytest.fixture(scope="module")
def paper(shipped_run):
    return shipped_run("paper", PAPER, "time.duration=6")


def drawn(look, width=100, **options):
    console = Console(file=io.StringIO(), width=width, **options)
    console.print(snapshot_table(look))
    return console.file.getvalue()


@pytest.fixture(scope="module")
def frames(paper):
    return list(snapshots(str(paper.folder), rate=None))


@pytest.mark.medium
def test_without_a_terminal_one_table_shows_the_result(paper, capsys):
    assert main(["watch", str(paper.folder)]) == 0
    out = capsys.readouterr().out
    assert "\x1b" not in out and out.count("Active region") == 1
    record = load_record(paper.folder)

    def shown(name, pattern):
        return [float(number) for number in re.search(rf"(?m)^{name} +{pattern}", out).groups()]

    def last(*names):
        return pytest.approx([record[name][-1] for name in names], abs=0.006)

    for name in ("goal", "SR1", "SR2", "SR3"):
        assert shown(name, r"([+-]\d+\.\d\d) m") == last(f"{name}.clearance")
    for name in ("obstacle", "shape", "depth"):
        assert shown(name, r"weight ([\d.]+), membership ([\d.]+)") == last(f"weight.{name}", f"membership.{name}")
    axes = [f"position.{axis}" for axis in "xyz"]
    assert shown("North east depth", r"(\S+) +(\S+) +(\S+) m") == last(*axes)
    for group, i in (("command", 0), ("actuation", 1)):
        force = np.linalg.norm([record[f"{group}.{axis}"][-1] for axis in "XYZ"])
        assert shown("Force", r"([\d.]+) N commanded, ([\d.]+) N actual")[i] == pytest.approx(force, abs=0.06)
    assert "completed: The vehicle entered the goal region" in out


@pytest.mark.parametrize("width", [40, 80, 200])
def test_table_fits_the_width_of_the_terminal(frames, width):
    assert 150 < len(frames) <= 250
    for frame in (*frames[::20], frames[-1]):
        lines = drawn(frame, width).rstrip("\n").split("\n")
        assert max(map(len, lines)) <= width and (width == 40 or len(lines) <= 30)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_picture_of_a_row_without_numbers_says_so(value, frames):
    names = [signal["name"] for signal in frames[-1].header["signals"]]
    row = np.where([name == "time" for name in names], frames[-1].row, value)
    text = drawn(dataclasses.replace(frames[-1], row=row, ended=None))
    assert "no number" in text and not re.search(r"\b(nan|inf)", text)


def test_violations_are_readable_without_color(paper, frames):
    record = load_record(paper.folder)
    time = record["time"][int(np.argmin(record["SR1.clearance"]))]
    text = drawn(min(frames, key=lambda look: abs(look["time"] - time)), 80)
    assert re.search(r"SR1 +-\d\.\d\d m VIOLATED", text) and re.search(r"Active region +SR\d \(", text)
    assert "obstacle exist → α1 high" in text


def test_colors_are_omitted_if_unwanted(frames, monkeypatch):
    assert "\x1b[3" in drawn(frames[-1], force_terminal=True, color_system="standard")
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b[3" not in drawn(frames[-1], force_terminal=True)


def test_names_cannot_inject_terminal_codes(frames):
    header = frames[-1].header | {"title": "a\x1b[2Jb\x07"}
    assert "\x1b" not in drawn(Snapshot(header, frames[-1].row, "\x1b]0;x\x07"))


@pytest.mark.medium
def test_table_in_a_terminal_is_redrawn_and_cut_to_its_height(paper):
    terminal, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 12, 60, 0, 0))
    command = [sys.executable, "-m", "cosim", "watch", str(paper.folder), "--rate", "max"]
    variables = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
    variables |= {"TERM": "xterm", "NO_COLOR": "1"}
    process = subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave, env=variables)
    os.close(slave)
    text = b""
    with contextlib.suppress(OSError):  # the other end is closed
        while chunk := os.read(terminal, 65536):
            text += chunk
    assert process.wait(timeout=60) == 0
    pictures = text.decode().split("\x1b[H")
    assert len(pictures) > 150 and all(len(one.splitlines()) <= 12 for one in pictures[1:-1])
    assert "Outcome" in pictures[-1] and "\x1b[3" not in text.decode()


def test_a_run_that_is_being_written_is_followed_to_its_end(paper, tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    shutil.copy(paper.folder / SCENARIO, folder)
    record = load_record(paper.folder)
    rows = record.to_array()
    recorder = Recorder(folder, record.columns, batch_rows=1000)
    frames = snapshots(str(folder))
    assert next(frames).row is None
    for k in range(2001):
        recorder.observe(k, rows[k])
    frame = next(frames)
    assert (frame["time"], frame.note) == (1.999, "being recorded")
    with mock.patch("cosim.live.watching.run_views.load_record") as read:
        assert [next(frames)["time"] for _ in range(3)] == [1.999] * 3 and not read.called
    assert [look["time"] for look in snapshots(str(folder), once=True)] == [1.999]
    for k in range(2001, len(rows)):
        recorder.observe(k, rows[k])
    recorder.close()
    assert (folder / RECORD).exists() and not (folder / STREAM).exists()
    shutil.copy(paper.folder / "summary.json", folder)
    *_, last = frames
    assert last["time"] == 6.0 and last.ended[0] == "completed"


@pytest.mark.slow
def test_a_live_run_is_watched_to_its_end(live):
    running = live(commands=True, rate=4.0)
    with running.viewer() as viewer:
        viewer.until("header")
        seen = []
        source = running.url.replace("http", "ws")
        watching = threading.Thread(target=lambda: seen.extend(snapshots(source)), daemon=True)
        watching.start()
        viewer.fly()
        assert ended(watching)
    assert seen[-1].ended == ("completed", viewer.messages_of("end")[0]["verdict"])
    assert seen[-1]["time"] == 2.0 and len(seen) > 2


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("ws://127.0.0.1:1", "cannot be watched"), ("1", "cannot be watched"), ("no/such/folder", "holds no run"),
        *((text, "expected a run folder") for text in ("ftp://127.0.0.1:21", "ws://[", "ws://127.0.0.1")),
    ],
)  # fmt: skip
def test_missing_run_or_server_gives_one_line_error(what, words, capsys):
    assert main(["watch", what]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "cosim: " in error and words in error


def test_run_killed_before_its_first_rows_does_not_block_watch(paper, tmp_path, monkeypatch):
    monkeypatch.setattr("cosim.live.watching.run_views._FRESH", 0.0)
    (tmp_path / STREAM).touch()
    shutil.copy(paper.folder / SCENARIO, tmp_path)
    (look,) = snapshots(str(tmp_path), once=True)
    assert look.row is None
    assert "no new rows" in look.note


def test_rows_of_another_run_give_one_line_error(paper, tmp_path):
    shutil.copy(paper.folder / SCENARIO, tmp_path)
    recorder = Recorder(tmp_path, [Column("a", "", "")], batch_rows=1)
    for k in range(2):
        recorder.observe(k, np.zeros(1))
    with pytest.raises(RunError, match="which its scenario calls for"):
        next(iter(snapshots(str(tmp_path))))
