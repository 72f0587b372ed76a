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
_TAIL = 300  # characters of what it said last


class PeerProcess:
    """A contestant: a function in a file of `benchmarks.peers`.

    Parameters
    ----------
    process : Popen
        That runs ``serve.py``.
    said : Path
        Where its error output goes.
    """

    def __init__(self, process: subprocess.Popen[str], said: Path) -> None:
        self._process, self._said = process, said

    def seconds(self, count: int) -> float:
        """Do `count` items, and return what they took [s]."""
        return self.ask(str(count))

    def ask(self, line: str) -> float:
        """Send a line, and return the seconds of the answer; NotMeasuredError has what the peer says else."""
        return float(self.exchange(line)["seconds"])

    def exchange(self, line: str) -> dict[str, Any]:
        """Send a line, and return the answer; NotMeasuredError has what the peer says else."""
        process = self._process
        assert process.stdin is not None and process.stdout is not None
        with contextlib.suppress(BrokenPipeError):
            process.stdin.write(line + "\n")
            process.stdin.flush()
        told = process.stdout.readline()
        if not told:
            raise NotMeasuredError(f"ended with code {process.wait()}: {self._said.read_text()[-_TAIL:].strip()}")
        answer: dict[str, Any] = json.loads(told)
        if "error" in answer:
            raise NotMeasuredError(" ".join(answer["error"].split())[:_TAIL])
        return answer


@contextlib.contextmanager
def peer(
    environment: Environment, package: str, module: str, function: str, setup: dict[str, Any]
) -> Iterator[PeerProcess]:
    """Start a peer, and end it afterwards.

    Parameters
    ----------
    environment : Environment
        Where it is installed.
    package : str
        The distribution that it needs.
    module, function : str
        In `benchmarks.peers`.
    setup : dict
        Plain values for the function.

    Raises
    ------
    NotMeasuredError
        If it is not installed, or cannot begin.
    """
    python = environment.python(package)
    with tempfile.TemporaryDirectory(prefix="peer-", ignore_cleanup_errors=True) as scratch:
        said = Path(scratch) / "said"
        # nothing of ours is on its path, and nothing of the user's
        apart = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
        apart |= dict.fromkeys(("TMPDIR", "TEMP", "TMP"), scratch)  # what it leaves behind goes too
        with said.open("w") as errors:
            process = subprocess.Popen(
                [python, str(_SERVE), module, function],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True, env=apart, cwd=scratch,
            )  # fmt: skip
        with process:
            try:
                contestant = PeerProcess(process, said)
                contestant.ask(json.dumps(setup))
                yield contestant
            finally:
                process.kill()
