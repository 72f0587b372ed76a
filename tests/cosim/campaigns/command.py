"""Campaign commands in sessions of their own, which tests can kill."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyarrow as pa
import pytest

from cosim.campaigns.store.folder import PARTS

ROOT = Path(__file__).parents[3]
needs_posix = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")

_MAIN = """
import sys
from cosim.run import progress
from cosim.campaigns.sweeps import sweep_rows
from cosim.command_line.cli import main
from tests.cosim.campaigns.fake import Slow
sweep_rows.FusedFlyer = Slow
progress._Notice.emit = lambda *_: None  # whether anything is compiled depends on what earlier runs kept
sys.exit(main(sys.argv[1:]))
"""


class Command:
    """A ``cosim`` command with ``--out`` in a session of its own; sweeps fly by `fake.Slow`."""

    def __init__(self, folder, cache, *words):
        self.out, self.temporary = folder / "out", folder / "temporary"
        self.temporary.mkdir(exist_ok=True)
        self.process = subprocess.Popen(
            [sys.executable, "-c", _MAIN, *map(str, words), "--replays", "0", "--out", str(self.out)],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": str(ROOT), "TMPDIR": str(self.temporary), "XDG_CACHE_HOME": str(cache)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def end(self):
        """Stop all processes."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.communicate()

    def wait_for_rows(self, n):
        """Wait until so many rows are stored."""
        deadline = time.monotonic() + 240.0
        while len(self.keys()) < n:
            assert self.process.poll() is None, self.process.communicate()[1]
            assert time.monotonic() < deadline
            time.sleep(0.01)

    def keys(self):
        """Return the keys of the rows that are stored."""
        keys = []
        for file in (self.out / PARTS).glob("*.arrows"):
            with contextlib.suppress(pa.ArrowException, OSError), pa.OSFile(str(file)) as content:
                for batch in pa.ipc.open_stream(content):
                    keys += batch[0].to_pylist()
        return keys

    def workers(self):
        """Return the processes that fly."""
        return [p for p in self.members() if b"spawn_main" in Path(f"/proc/{p}/cmdline").read_bytes()]

    def gone(self):
        """Return whether all processes of the session end by themselves, soon."""
        deadline = time.monotonic() + 120.0
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


@pytest.fixture(scope="module")
def command_cache(tmp_path_factory):
    """Return where the commands of a module keep the FMU that the first of them builds."""
    return tmp_path_factory.mktemp("command-cache")


@pytest.fixture
def command(tmp_path, command_cache):
    """Return a function that starts a command."""
    with contextlib.ExitStack() as stack:

        def start(*words):
            started = Command(tmp_path, command_cache, *words)
            stack.callback(started.end)
            return started

        yield start
