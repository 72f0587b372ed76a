"""``cosim watch``: a run displayed in the terminal."""

import dataclasses
import io
import re
import shutil
import threading

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rich.console import Console

from cosim.command_line.cli import main
from cosim.errors import RunError, TelemetryError
from cosim.live.watching import Look, looks, picture
from cosim.results.record import PARTS, RECORD, load_record
from cosim.results.recorder import Recorder
from cosim.results.run_result import SCENARIO
from tests.cosim.live.conftest import ARM
from tests.threads import ended

PAPER = "arbiter.engine=closed"


@pytest.fixture(scope="module")
def paper(shipped_run):
    return shipped_run("paper", PAPER, "time.duration=6")


def drawn(look, width, height, **options):
    console = Console(file=io.StringIO(), width=width, height=height, **options)
    console.print(picture(look, width, height, console.options.ascii_only))
    return console.file.getvalue()


@pytest.mark.medium
def test_without_a_terminal_one_frame_shows_the_result(paper, capsys):
    assert main(["watch", str(paper.folder)]) == 0
    out = capsys.readouterr().out
    assert "\x1b" not in out
    assert out.count("Weights of the arbiter") == 1
    record = load_record(paper.folder)
    for name in ("goal", "SR1", "SR2", "SR3"):
        shown = float(re.search(rf"{name} .*?([+-]\d+\.\d\d)m", out).group(1))
        assert shown == pytest.approx(record[f"{name}.clearance"][-1], abs=0.006)
    assert "completed: The vehicle entered the goal region" in out


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("size", [(80, 24), (100, 24), (200, 50)])
def test_every_picture_of_a_run_fits_its_terminal(paper, size):
    frames = list(looks(str(paper.folder), rate=None))
    assert 150 < len(frames) <= 250
    for frame in (*frames[::20], frames[-1]):
        lines = drawn(frame, *size).rstrip("\n").split("\n")
        assert len(lines) <= size[1] and max(map(len, lines)) <= size[0]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_picture_of_a_row_without_numbers_says_so(value, paper):
    *_, frame = looks(str(paper.folder), rate=None)
    names = [signal["name"] for signal in frame.header["signals"]]
    row = np.where([name == "time" for name in names], frame.row, value)
    text = drawn(dataclasses.replace(frame, row=row), 100, 40)
    assert "no number" in text and not re.search(r"\b(nan|inf)", text.partition("completed")[0])


def test_violations_are_readable_without_color(paper):
    record = load_record(paper.folder)
    k = int(np.argmin(record["SR1.clearance"]))
    frames = list(looks(str(paper.folder), rate=None))
    frame = min(frames, key=lambda look: abs(look["time"] - record["time"][k]))
    text = drawn(frame, 80, 24)
    assert re.search(r"SR1 .*-\d\.\d\dm !", text)
    assert re.search(r"VIOLATED: .*SR1", text)
    assert "Rules that fire" in text and "obstacle exist → α1 high" in text
    assert "Gives way to" in text


def test_ascii_terminal_gets_ascii_bars(paper):
    *_, last = looks(str(paper.folder), rate=None)
    file = io.TextIOWrapper(io.BytesIO(), encoding="ascii", errors="replace")
    console = Console(file=file, width=80)
    assert console.options.ascii_only
    console.print(picture(last, 80, 24, console.options.ascii_only))
    file.flush()
    assert "#" in file.buffer.getvalue().decode() and "?????" not in file.buffer.getvalue().decode()


def test_colors_are_omitted_if_unwanted(paper, monkeypatch):
    *_, last = looks(str(paper.folder), rate=None)
    assert "\x1b[3" in drawn(last, 80, 24, force_terminal=True, color_system="standard")
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b[3" not in drawn(last, 80, 24, force_terminal=True)


def test_names_cannot_inject_terminal_codes(paper):
    *_, last = looks(str(paper.folder), rate=None)
    header = last.header | {"title": "a\x1b[2Jb\x07"}
    assert "\x1b" not in drawn(Look(header, last.row, "\x1b]0;x\x07"), 80, 24)


def test_a_run_that_is_being_written_is_followed_to_its_end(paper, tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    shutil.copy(paper.folder / SCENARIO, folder)
    record = load_record(paper.folder)
    rows = record.to_array()
    recorder = Recorder(folder, record.columns, rows_per_part=1000)
    frames = looks(str(folder))
    assert next(frames).row is None
    for k in range(2001):
        recorder.observe(k, rows[k])
    frame = next(frames)
    assert (frame["time"], frame.note) == (1.999, "being recorded")
    assert [look["time"] for look in looks(str(folder), once=True)] == [1.999]
    for k in range(2001, len(rows)):
        recorder.observe(k, rows[k])
    recorder.close()
    assert (folder / RECORD).exists() and not (folder / PARTS).exists()
    shutil.copy(paper.folder / "summary.json", folder)
    *_, last = frames
    assert last["time"] == 6.0 and last.ended[0] == "completed"


@pytest.mark.slow
def test_a_live_run_is_watched_to_its_end(live):
    running = live(commands=True, rate=4.0)
    with running.viewer() as viewer:
        viewer.until("header")
        seen = []
        watching = threading.Thread(target=lambda: seen.extend(looks(running.url.replace("http", "ws"))), daemon=True)
        watching.start()
        viewer.command(**ARM)
        viewer.until("end")
        assert ended(watching)
    assert seen[-1].ended == ("completed", viewer.messages_of("end")[0]["verdict"])
    assert seen[-1]["time"] == 2.0 and len(seen) > 2


@pytest.mark.parametrize("what", ["ws://127.0.0.1:1", "1", "ftp://127.0.0.1:21", "ws://[", "ws://127.0.0.1"])
def test_missing_run_gives_one_line_error(what, capsys):
    assert main(["watch", what]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "cosim: " in error


def test_missing_run_or_server_is_reported():
    with pytest.raises(Exception, match="holds no run"):
        next(looks("no/such/folder"))
    with pytest.raises(TelemetryError, match="cannot be watched"):
        next(looks("1"))


def test_run_killed_before_its_first_rows_does_not_block_watch(paper, tmp_path, monkeypatch):
    monkeypatch.setattr("cosim.live.watching.run_views._FRESH", 0.0)
    (tmp_path / PARTS).mkdir()
    shutil.copy(paper.folder / SCENARIO, tmp_path)
    (look,) = looks(str(tmp_path), once=True)
    assert look.row is None
    assert "no new rows" in look.note


@pytest.mark.parametrize("garbage", ["no parquet", "another table"])
def test_invalid_parts_give_one_line_error(paper, tmp_path, garbage):
    (tmp_path / PARTS).mkdir()
    shutil.copy(paper.folder / SCENARIO, tmp_path)
    part = tmp_path / PARTS / "000000.parquet"
    if garbage == "no parquet":
        part.write_bytes(b"garbage")
    else:
        pq.write_table(pa.table({"a": [1.0]}), part)
    with pytest.raises(RunError, match=r"cannot be read|which its scenario calls for"):
        next(iter(looks(str(tmp_path))))
