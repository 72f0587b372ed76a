"""The files of an identification are of one identification, whenever a disk is full or the process is killed."""

import os
from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import pytest

from cosim.errors import IdentificationError
from cosim.identification import identification
from tests.faults import FAIL_ON, FAIL_ONCE, INTERRUPT, KILL, arm, call_with_faults, count, needs_faults

NAMES = ("mine.toml", "mine.posterior.jsonl", "mine.html")


def write(out, generation):
    """Write the results of an identification whose files say which it was."""
    vehicle = (resources.files("plant_fmu") / "vehicles" / "odin.toml").read_text()
    done = SimpleNamespace(fit=None, vehicle=None)
    with (
        mock.patch.object(identification, "vehicle_contents", return_value=f"# {generation}\n{vehicle}"),
        mock.patch.object(identification, "posterior_lines", return_value=[f"# {generation}"] * 9000),
        mock.patch.object(identification, "page_contents", return_value=f"# {generation}\n" * 9000),
    ):
        identification.write_results(done, out)


def generations(folder):
    return {name: (folder / name).read_text().split("\n")[0] for name in NAMES if (folder / name).exists()}


def in_child(function):
    """Call a function in a fork of this process, and return the signal that ended it."""
    child = os.fork()
    if not child:
        function()
        os._exit(0)
    return os.waitpid(child, 0)[1]


def disturb_each_call(folder):
    folder = Path(folder)
    arm(folder, 0)
    write(folder / "mine.toml", "first")
    total, left = count(), set()
    assert total >= 9  # of each file: open, write, rename
    for kind in (KILL, FAIL_ONCE, FAIL_ON, INTERRUPT):
        for n in range(1, total + 1):
            arm("", 0)
            write(folder / "mine.toml", "old")
            arm(folder, n, kind)
            if kind == KILL:
                assert in_child(lambda: write(folder / "mine.toml", "new"))
                for hidden in folder.glob(".mine*"):
                    hidden.unlink()
            else:
                errors = KeyboardInterrupt if kind == INTERRUPT else IdentificationError
                try:
                    with pytest.raises(
                        errors, match=r"" if kind == INTERRUPT else r"mine\..*: No space left on device"
                    ):
                        write(folder / "mine.toml", "new")
                except pytest.fail.Exception:
                    # a rename succeeds on a full disk, and the folder that cannot be made is there
                    assert kind in (FAIL_ON, FAIL_ONCE) and generations(folder) == dict.fromkeys(NAMES, "# new")
            arm("", 0)
            found = generations(folder)
            assert "mine.toml" in found and len(set(found.values())) == 1, (kind, n, found)
            assert {file.name for file in folder.glob("*mine*")} == found.keys(), (kind, n)
            left.add((kind, found["mine.toml"], len(found)))
    assert {(KILL, "# old", 3), (KILL, "# old", 1), (KILL, "# new", 1), (KILL, "# new", 2)} <= left


@needs_faults
@pytest.mark.medium
def test_files_that_exist_are_of_one_identification(tmp_path):
    call_with_faults(disturb_each_call, tmp_path)
