"""Cold start of the command: with empty caches, and with the caches of an earlier run."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from benchmarks.contest import Contest
from benchmarks.peer_environment import Environment
from benchmarks.timing import Contestant, InProcess, NotMeasuredError, repeat_call

RUN = ("run", "paper", "--set", "arbiter.engine=closed")
_ROOT = Path(__file__).parents[2]


def contests(environment: Environment) -> Iterator[Contest]:
    """Yield the contests of the start."""
    yield Contest(
        "A start of the command",
        {"cosim --help": lambda stack: InProcess(repeat_call(_Command(stack, ["-m", "cosim", "--help"])))},
        {"fmpy --help": lambda _: InProcess(repeat_call(_plain([environment.python("fmpy"), "-m", "fmpy", "--help"])))},
        count=1,
        pinned=False,
    )
    yield Contest(
        "cosim run paper --set arbiter.engine=closed: FMU, compilation, 60 000 steps, record, report",
        {"the first time, caches empty": _first, "the second time": _second},
        count=1,
        repeats=3,
        pinned=False,
    )


def _first(stack: ExitStack) -> Contestant:
    command = _Command(stack, ["-m", "cosim", *RUN])

    def work() -> None:
        command.empty()
        command()

    command.empty()
    return InProcess(repeat_call(work))


def _second(stack: ExitStack) -> Contestant:
    command = _Command(stack, ["-m", "cosim", *RUN])
    command()
    return InProcess(repeat_call(command))


class _Command:
    """Process of the project's command, with caches of its own."""

    def __init__(self, stack: ExitStack, arguments: Sequence[str]) -> None:
        self._folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="start-")))
        self._arguments = arguments

    def empty(self) -> None:
        """Clear the caches of earlier processes."""
        shutil.rmtree(self._folder)
        self._folder.mkdir()

    def __call__(self) -> None:
        caches = {"XDG_CACHE_HOME": self._folder, "NUMBA_CACHE_DIR": self._folder / "numba", "PYTHONPATH": _ROOT}
        out = self._folder / "run"
        shutil.rmtree(out, ignore_errors=True)
        more = ["--out", str(out)] if "run" in self._arguments else []
        _plain([sys.executable, *self._arguments, *more], {key: str(path) for key, path in caches.items()})()


def _plain(command: Sequence[str], more: dict[str, str] | None = None) -> Callable[[], None]:
    def work() -> None:
        done = subprocess.run(command, env=os.environ | (more or {}), capture_output=True, text=True, check=False)
        if done.returncode:
            raise NotMeasuredError(f"{' '.join(command[1:4])}: code {done.returncode}: {done.stderr.strip()[-300:]}")

    return work
