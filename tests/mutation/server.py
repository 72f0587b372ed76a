"""A process that has imported all that is not the project's, and forks for each run of tests in a copy of the project.

It is started in the root of the copy. Each line that it reads asks for a run, each that it writes says how one went.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import signal
import sys
import time
import traceback
from dataclasses import asdict, dataclass
from pathlib import Path

THIRD_PARTIES = (
    "pytest", "hypothesis.strategies", "hypothesis.extra.numpy", "numpy", "scipy.linalg",
    "scipy.optimize", "scipy.spatial.transform", "scipy.integrate", "fmpy.fmi2", "fmpy.fmi3", "platformdirs",
)  # fmt: skip
TEST_SECONDS = 30  # of processor time, which no test that ends takes
RUN_SECONDS = 900.0  # by the clock, for all tests of a run


@dataclass(frozen=True)
class Job:
    """A run of tests, of which the first failure ends it."""

    tests: tuple[str, ...]
    words: tuple[str, ...] = ()  # tests in whose names they stand come first
    without: tuple[str, ...] = ()  # tests in whose names they stand are left out
    slow: bool = False  # whether those marked slow are run
    path: str = ""  # what is written before and put back afterwards, with `text` in it
    text: str = ""
    collect_only: bool = False  # and keep the tests as compiled, which no mutant changes


@dataclass(frozen=True)
class Outcome:
    """How a run went."""

    passed: bool
    by: str  # the test that failed, or in which the process ended
    how: str  # "failed", "crashed", "endless", "not imported"
    seconds: float  # of processor time, with that of compilers


def main() -> None:
    for name in THIRD_PARTIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        job = Job(**json.loads(line))
        target = Path(job.path)
        original = target.read_bytes() if job.path else b""
        try:
            if job.path:
                target.write_bytes(job.text.encode())
            outcome = _run(job)
        finally:
            if job.path:
                target.write_bytes(original)
        answers.write(json.dumps(asdict(outcome)) + "\n")
        answers.flush()


def _run(job: Job) -> Outcome:
    note = Path("mutation-note").absolute()
    note.write_text("")
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        _test(job, note)
    while True:
        ended, status, used = os.wait4(child, os.WNOHANG)
        if ended:
            break
        if time.monotonic() - began > RUN_SECONDS:
            os.killpg(child, signal.SIGKILL)
            _, status, used = os.wait4(child, 0)
            break
        time.sleep(0.02)
    with contextlib.suppress(ProcessLookupError, PermissionError):  # what the tests left behind
        os.killpg(child, signal.SIGKILL)
    seconds = used.ru_utime + used.ru_stime
    said = note.read_text().splitlines()
    by = said[-1].partition(" ")[2] if said else ""
    if os.WIFSIGNALED(status):
        endless = os.WTERMSIG(status) in (signal.SIGPROF, signal.SIGKILL)
        return Outcome(False, by, "endless" if endless else "crashed", seconds)
    if os.WEXITSTATUS(status) == 0:
        return Outcome(True, "", "", seconds)
    if said and said[-1].startswith("failed"):
        return Outcome(False, by, "failed", seconds)
    return Outcome(False, by, "not imported", seconds)


def _test(job: Job, note: Path) -> None:
    """Run the tests, in the forked process, which ends here."""
    status = 3
    try:
        os.setsid()
        out = os.open("mutation-output", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        nothing = os.open(os.devnull, os.O_RDONLY)
        os.dup2(nothing, 0)
        os.dup2(out, 1)
        os.dup2(out, 2)
        import pytest

        from tests.mutation.plugin import Plugin

        options = ["-q", "-x", "--tb=short", "-p", "no:cacheprovider", "-p", "no:xdist"]
        options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of what is imported before
        options += ["-W", "ignore::RuntimeWarning"]  # of overflow and the like, of which compiled code says nothing
        options += ["--basetemp", str(Path("mutation-scratch").absolute())]
        options.append("--slow" if job.slow else "--medium")
        if job.collect_only:
            options.append("--collect-only")
            sys.dont_write_bytecode = False
        plugin = Plugin(note, tuple(job.words), tuple(job.without), TEST_SECONDS)
        status = int(pytest.main([*options, *job.tests], plugins=[plugin]))
    except BaseException:  # noqa: BLE001 - nothing may go on behind the fork
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


if __name__ == "__main__":
    main()
