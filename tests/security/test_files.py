"""Invalid records, malicious folders, and atomic writes."""

import json
import math
import os
import shutil
import stat

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from controller.compiling import library
from cosim.errors import RunError
from cosim.io.atomic_file import atomic_file, write_atomic
from cosim.live.watching import snapshots
from cosim.replay.page import write_page
from cosim.replay.pages import replay
from cosim.results.record import RECORD, Record, load_record
from cosim.results.run_result import SUMMARY, load_run
from cosim.run.run_folder import claim, report_again
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

ROWS = {"time": [0.0, 1.0], "position.x": [1.0, 2.0]}


def written(folder, table):
    pq.write_table(table, folder / RECORD)
    return folder


def test_excessive_declared_row_count_is_rejected(tmp_path, monkeypatch):
    monkeypatch.setattr("cosim.results.record.MAX_ROWS", 1)
    with pytest.raises(RunError, match="has 2 rows"):
        load_record(written(tmp_path, pa.table(ROWS)))


@pytest.mark.skipif(os.name != "posix", reason="names of files are no bytes here")
def test_folder_with_a_non_utf8_name_is_rejected(tmp_path):
    folder = tmp_path / os.fsdecode(b"run\xff")
    try:
        folder.mkdir()
    except OSError:
        pytest.skip("such names cannot be here")
    shutil.copy(written(tmp_path, pa.table(ROWS)) / RECORD, folder / RECORD)
    for act in (lambda: load_record(folder), lambda: claim(folder / "new", load_scenario("paper"))):
        with pytest.raises(RunError, match="not UTF-8") as caught:
            act()
        str(caught.value).encode()
    with pytest.raises(RunError, match="not UTF-8"):
        Record(folder / RECORD)


SUMMARIES = {
    "law": ["mine", "pd", "", 7, None, [], "ismail_dunnigan" * 900, "printed\x1b[31m"],
    "status": [7, None, ["completed"], {"a": {}}],
    "scenario": [7, None, [1], True],
    "wall_time": ["x", [], {}, -1, True, 1e300, math.nan, math.inf, 10**400],
}


def summarized(tmp_path, run):
    """Return a copy of a run, and its summary."""
    folder = shutil.copytree(run, tmp_path / "run")
    return folder, json.loads((folder / SUMMARY).read_text())


@pytest.mark.parametrize(("key", "values"), SUMMARIES.items(), ids=SUMMARIES)
def test_d5_invalid_summary_value_is_rejected_by_key(tmp_path, ordered_run, key, values):
    folder, sound = summarized(tmp_path, ordered_run)
    for value in values:
        (folder / SUMMARY).write_text(json.dumps(sound | {key: value}))
        for read in (load_run, report_again, lambda of: replay([of]), lambda of: list(snapshots(str(of), None))):
            with pytest.raises(RunError, match=f"{key} is ") as caught:
                read(folder)
            assert str(caught.value).startswith(f"{folder / SUMMARY}: {key} is ") and str(caught.value).isprintable()
    if key != "wall_time":
        (folder / SUMMARY).write_text(json.dumps({name: x for name, x in sound.items() if name != key}))
        with pytest.raises(RunError, match=f"{SUMMARY}: {key} is missing"):
            load_run(folder)


@pytest.mark.medium
def test_d5_summary_texts_are_escaped(tmp_path, shipped_run):
    folder, sound = summarized(tmp_path, shipped_run("paper", "time.duration=0.1").folder)
    texts = {"status": "done\n\x1b[31m", "scenario": "a\udc80\x07", "law": "an autopilot\x9b"}
    (folder / SUMMARY).write_text(json.dumps(sound | texts))
    summary, _ = report_again(folder)
    assert {key: summary[key] for key in texts} == {
        "status": r"done \x1b[31m", "scenario": r"a\udc80\x07", "law": r"an autopilot\x9b"
    }  # fmt: skip


@pytest.mark.medium
@pytest.mark.skipif(os.name != "posix", reason="names of files are no bytes here")
def test_d5_scenario_name_with_terminal_codes_is_escaped(tmp_path):
    file = tmp_path / os.fsdecode(b"a\x1b[31m\xff.toml")
    file.write_text('base = "paper"\ntime.duration = 0.01')
    scenario = load_scenario(file)
    assert scenario.name == r"a\x1b[31m\udcff"
    run = run_scenario(scenario, tmp_path / "run")
    assert load_run(run.folder).scenario.name == scenario.name


# ---- what is written ----


@pytest.mark.skipif(os.name != "posix", reason="links need rights here")
def test_existing_symbolic_links_are_not_followed(tmp_path):
    mine, folder = tmp_path / "mine.txt", tmp_path / "run"
    mine.write_text("precious")
    folder.mkdir()
    for name in ("replay.html", ".replay.html", f".summary.json-{os.getpid()}"):
        (folder / name).symlink_to(mine)
    write_page(folder / "replay.html", [], "live")
    assert mine.read_text() == "precious"
    assert not (folder / "replay.html").is_symlink() and (folder / "replay.html").stat().st_size > 1000


def test_concurrent_writers_do_not_interfere(tmp_path):
    place = tmp_path / "it"
    with atomic_file(place) as one:
        with atomic_file(place) as other:
            other.write(b"other")
        assert place.read_bytes() == b"other"
        one.write(b"one")
    assert place.read_bytes() == b"one" and list(tmp_path.iterdir()) == [place]


@pytest.mark.skipif(os.name != "posix", reason="pipes have names on POSIX alone")
def test_non_regular_file_is_not_replaced(tmp_path):
    """Else a page written to /dev/null by root would be all that is left of it."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("pipe")
    (tmp_path / "folder").mkdir()
    for name in ("pipe", "link", "folder"):
        with pytest.raises(FileExistsError, match="is no file"):
            write_atomic(tmp_path / name, "text")
    assert (tmp_path / "pipe").is_fifo() and (tmp_path / "link").is_symlink()
    assert len(list(tmp_path.iterdir())) == 3


def test_failed_write_keeps_the_old_file(tmp_path):
    write_atomic(tmp_path / "it", "before")
    with pytest.raises(TypeError), atomic_file(tmp_path / "it") as file:
        file.write("text where bytes are expected")
    assert (tmp_path / "it").read_text() == "before" and len(list(tmp_path.iterdir())) == 1


# ---- what is loaded ----


@pytest.mark.skipif(os.name != "posix", reason="of POSIX")
def test_code_cached_in_a_writable_folder_is_not_loaded(tmp_path, monkeypatch):
    folder = tmp_path / "kept"
    folder.mkdir(mode=0o755)
    assert library.is_trusted(folder)
    folder.chmod(0o777)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o777
    assert not library.is_trusted(folder)
    folder.chmod(0o755)
    monkeypatch.setattr(os, "geteuid", lambda: folder.stat().st_uid + 1)
    assert library.is_trusted(folder) == (os.stat(library.__file__).st_uid == folder.stat().st_uid)
    assert not library.is_trusted(tmp_path / "none yet")
