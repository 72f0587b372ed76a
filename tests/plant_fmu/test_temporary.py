"""Temporary files and folders of killed processes are removed by later ones, and no others."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from plant_fmu.archive import _MIN_AGE, atomic_file, is_temporary, temporary_folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs locks of folders")

_HOLD = """
import sys, time
from pathlib import Path
from plant_fmu.archive import atomic_file, temporary_folder
place = Path(sys.argv[1])
with temporary_folder("work-", place) as folder, atomic_file(place / "it.csv") as file:
    (folder / "some.bin").write_bytes(b"x")
    file.write(b"x")
    file.flush()
    print("ready", flush=True)
    time.sleep(600)
"""


@contextlib.contextmanager
def holder(place):
    """Start a process that holds a temporary file and a folder, and kill it at the end."""
    process = subprocess.Popen([sys.executable, "-c", _HOLD, place], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "ready\n"
        yield process
    finally:
        process.kill()
        process.communicate()


def write(place):
    """Use both kinds in a folder, at which moment abandoned ones are removed."""
    with temporary_folder("work-", place), atomic_file(place / "it.csv") as file:
        file.write(b"new")


def age(place, seconds=_MIN_AGE + 60.0):
    for path in place.iterdir():
        then = time.time() - seconds
        os.utime(path, (then, then))


def test_those_of_a_killed_process_are_removed_and_those_of_a_live_one_are_kept(tmp_path):
    with holder(tmp_path) as process:
        held = set(tmp_path.iterdir())
        assert len(held) == 2
        age(tmp_path)
        write(tmp_path)
        assert held <= set(tmp_path.iterdir())
        process.send_signal(signal.SIGKILL)
        process.wait()
        age(tmp_path, 1.0)
        write(tmp_path)
        assert held <= set(tmp_path.iterdir())  # too young
        age(tmp_path)
        write(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["it.csv"]


@pytest.mark.parametrize(
    "name", ["work-notes", ".it.csv-backup0", ".it.csv-0123456789ABCDEF", ".other.csv-0123456789abcdef", "it.csv~"]
)
def test_files_that_have_no_temporary_name_are_kept(tmp_path, name):
    (tmp_path / name).write_text("mine")
    age(tmp_path)
    write(tmp_path)
    assert (tmp_path / name).read_text() == "mine"


def test_links_and_files_of_other_users_are_kept(tmp_path, monkeypatch):
    outside = tmp_path / "outside"
    outside.mkdir()
    place = tmp_path / "place"
    place.mkdir()
    (place / "work-0123456789abcdef").symlink_to(outside)
    write(place)
    assert outside.exists() and (place / "work-0123456789abcdef").is_symlink()
    (place / ".it.csv-0123456789abcdef").write_text("theirs")
    age(place)
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    write(place)
    assert (place / ".it.csv-0123456789abcdef").exists()
    monkeypatch.undo()
    write(place)
    assert not (place / ".it.csv-0123456789abcdef").exists()


def test_names_of_temporaries_are_recognized():
    with contextlib.suppress(ValueError), temporary_folder(".report-") as folder:
        assert is_temporary(folder.name) and not is_temporary(Path("report.html").name)
