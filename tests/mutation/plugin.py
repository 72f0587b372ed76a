"""Pytest plugin for tests of a mutant: their order, a time limit for each, and C compiled once."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import signal
import subprocess
from pathlib import Path
from typing import Any

import pytest

OBJECTS = "MUTATION_OBJECTS"  # environment: the folder in which compiled C is kept
_PLAIN_RUN = subprocess.run


class Plugin:
    """Receive pytest's events."""

    def __init__(self, note: Path, words: tuple[str, ...], without: tuple[str, ...], seconds: float):
        self.note = note
        self.words = words
        self.without = without
        self.seconds = seconds

    def pytest_configure(self, config: pytest.Config) -> None:
        subprocess.run = compile_once  # type: ignore[assignment]

    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        def order(item: pytest.Item) -> int:
            name = re.sub("[^a-z]", "", item.nodeid.lower())
            return -sum(word in name for word in self.words)

        items[:] = [item for item in items if not any(part in item.nodeid for part in self.without)]
        if self.words:
            items.sort(key=order)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.write("begun", nodeid)
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, self.seconds)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self.write("failed", report.nodeid)

    def write(self, what: str, nodeid: str) -> None:
        with self.note.open("a") as file:
            file.write(f"{what} {nodeid}\n")


def compile_once(command: Any, *arguments: Any, **options: Any) -> Any:
    """Run a command as `subprocess.run` does, but one that compiles a C file into an object only if none has before."""
    kept = os.environ.get(OBJECTS)
    if not kept or not isinstance(command, list) or "-c" not in command or not str(command[0]).endswith("cc"):
        return _PLAIN_RUN(command, *arguments, **options)
    source, out = Path(command[command.index("-c") + 1]), Path(command[command.index("-o") + 1])
    mark = hashlib.sha256("\n".join(word for word in command if word.startswith(("-D", "-f", "-s"))).encode())
    for file in [source, *sorted(source.parent.glob("*.h"))]:
        mark.update(file.name.encode() + file.read_bytes())
    stored = Path(kept) / mark.hexdigest()
    if not stored.is_file():
        done = _PLAIN_RUN(command, *arguments, **options)
        if done.returncode == 0:
            mine = stored.with_suffix(f".{os.getpid()}-{out.stem}")
            shutil.copyfile(out, mine)
            mine.replace(stored)
        return done
    shutil.copyfile(stored, out)
    return subprocess.CompletedProcess(command, 0, "", "")
