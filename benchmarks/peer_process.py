"""A peer that runs in a process of its own, in the peers' environment."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.peer_environment import Environment
from benchmarks.timing import NotMeasuredError

_SERVE = Path(__file__).parent / "peers" / "serve.py"
_TAIL = 300  # number of the last characters of a peer's error output that a reason contains


class PeerProcess:
    """A contestant: a function in a file of `benchmarks.peers`."""

    def __init__(self, process: subprocess.Popen[str], stderr: Path) -> None:
        self._process, self._stderr = process, stderr

    def seconds(self, count: int) -> float:
        """Run `count` items, and return their time [s]."""
        return self.ask(str(count))

    def ask(self, line: str) -> float:
        """Send a line, and return the seconds of the answer; raise NotMeasuredError with the peer's error."""
        return float(self.exchange(line)["seconds"])

    def exchange(self, line: str) -> dict[str, Any]:
        """Send a line, and return the answer; raise NotMeasuredError with the peer's error."""
        process = self._process
        assert process.stdin is not None and process.stdout is not None
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(line + "\n")
            process.stdin.flush()
        line_received = process.stdout.readline()
        if not line_received:
            raise NotMeasuredError(f"ended with code {process.wait()}: {self._stderr.read_text()[-_TAIL:].strip()}")
        answer: dict[str, Any] = json.loads(line_received)
        if "error" in answer:
            raise NotMeasuredError(" ".join(answer["error"].split())[:_TAIL])
        return answer


@contextlib.contextmanager
def peer(
    environment: Environment, package: str, module: str, function: str, setup: dict[str, Any]
) -> Iterator[PeerProcess]:
    """Start a peer, and end it afterwards."""
    python = environment.python(package)
    with tempfile.TemporaryDirectory(prefix="peer-", ignore_cleanup_errors=True) as scratch:
        stderr = Path(scratch) / "stderr"
        # keep folders of this project and of the user off the peer's path
        apart = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
        apart |= dict.fromkeys(("TMPDIR", "TEMP", "TMP"), scratch)  # its temporary files are removed too
        with stderr.open("w") as errors:
            process = subprocess.Popen(
                [python, str(_SERVE), module, function],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True, env=apart, cwd=scratch,
            )  # fmt: skip
        with process:
            try:
                contestant = PeerProcess(process, stderr)
                contestant.ask(json.dumps(setup))
                yield contestant
            finally:
                process.kill()
