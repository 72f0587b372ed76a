"""Run mutants in processes with copies of the project, and save each result at once."""

from __future__ import annotations

import hashlib
import json
import os
import py_compile
import queue
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Self

from tests.mutation.mutants import Mutant
from tests.mutation.plan import ROOT, part_of, parts
from tests.mutation.plugin import OBJECTS
from tests.mutation.server import Job, Outcome

COPIED = ("controller", "plant_fmu", "fuzzy_arbiter", "cosim", "tests", "examples", "docs", "benchmarks")


@dataclass(frozen=True)
class Result:
    """The test result of a mutant."""

    key: str
    source: str  # mark of the unchanged source, so that results of an older one are not taken for this one's
    survived: bool
    by: str
    how: str
    seconds: float
    doubtful: bool = False  # the test fails without the mutant, too


def sample(mutants: Sequence[Mutant], n: int, seed: int) -> list[Mutant]:
    """Return so many mutants, in their order: half of them in Python and half in C, drawn by their names."""
    drawn: list[Mutant] = []
    languages = [[m for m in mutants if m.path.endswith(".py")], [m for m in mutants if not m.path.endswith(".py")]]
    for i, group in enumerate(languages):
        share = (n + i) // 2
        drawn += random.Random(f"{seed} {i}").sample(group, min(share, len(group)))
    return [mutant for mutant in mutants if mutant in drawn]


def results_of(mutants: Sequence[Mutant], jobs: int, kept: Path | None, *, again: bool = False) -> dict[str, Result]:
    """Ask the tests about mutants.

    Parameters
    ----------
    mutants : sequence of Mutant
        In any order.
    jobs : int
        Processes at a time.
    kept : Path, optional
        File of results, one a line: those of unchanged sources are taken from it, and new ones written behind.
    again : bool
        Whether survivors in the file are asked about anew.

    Returns
    -------
    dict of str to Result
        By the keys of the mutants.
    """
    marks = {path: _mark(path) for path in {mutant.path for mutant in mutants}}
    results: dict[str, Result] = {}
    current = {mutant.key: marks[mutant.path] for mutant in mutants}
    if kept and kept.is_file():
        for line in kept.read_text(encoding="utf-8").splitlines():
            result = Result(**json.loads(line))
            if current.get(result.key) == result.source:
                results[result.key] = result
        if again:
            results = {key: result for key, result in results.items() if not (result.survived or result.doubtful)}
    # in an order that has nothing to do with where they stand, so that what is done when it is stopped is a fair sample
    left = sorted((m for m in mutants if m.key not in results), key=lambda m: hashlib.sha256(m.key.encode()).digest())
    if not left:
        return results
    todo: queue.SimpleQueue[Mutant] = queue.SimpleQueue()
    for mutant in left:
        todo.put(mutant)
    with tempfile.TemporaryDirectory(prefix="mutation-") as scratch, ThreadPoolExecutor(jobs) as pool:
        copies = [Path(scratch) / f"copy{i}" for i in range(min(jobs, len(left)))]
        _copy(ROOT, copies[0])
        _compile(copies[0])
        for copy in copies[1:]:
            _copy(copies[0], copy)
        for done in [pool.submit(_work, copy, todo, marks, results, kept) for copy in copies]:
            done.result()
        _doubt(results, copies[0])
    return results


class Server:
    """A process of `server.py` in a copy of the project."""

    def __init__(self, copy: Path):
        self.copy = copy
        objects = copy.parent / "objects"
        objects.mkdir(exist_ok=True)
        environment = {
            **os.environ, "SUBREACH_INTERPRETED": "1", "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(copy),
            OBJECTS: str(objects), "PATH": f"{_compiler(copy.parent)}{os.pathsep}{os.environ['PATH']}",
            "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1",
        }  # fmt: skip
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.mutation.server"],
            cwd=copy, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip

    def run(self, job: Job) -> Outcome:
        """Return how a run of tests went."""
        assert self.process.stdin and self.process.stdout
        self.process.stdin.write(json.dumps(asdict(job)) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            raise RuntimeError(f"the process in {self.copy} has ended")
        return Outcome(**json.loads(answer))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        assert self.process.stdin and self.process.stdout
        self.process.stdin.close()  # which ends it
        self.process.wait()
        self.process.stdout.close()


def _work(
    copy: Path, todo: queue.SimpleQueue[Mutant], marks: dict[str, str], results: dict[str, Result], kept: Path | None
) -> None:
    with Server(copy) as server:
        while True:
            try:
                mutant = todo.get_nowait()
            except queue.Empty:
                break
            text = mutant.applied((ROOT / mutant.path).read_text(encoding="utf-8"))
            part = part_of(mutant.path)
            outcome = server.run(Job(part.tests, _words(mutant), part.without, part.slow, mutant.path, text))
            if not outcome.passed and not outcome.by and not server.run(Job(part.tests, collect_only=True)).passed:
                raise RuntimeError(f"{mutant.path}: its tests cannot be collected without any mutant either")
            result = Result(
                mutant.key, marks[mutant.path], outcome.passed, outcome.by, outcome.how, round(outcome.seconds, 2)
            )
            results[mutant.key] = result
            if kept:
                kept.parent.mkdir(parents=True, exist_ok=True)
                with kept.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(result), ensure_ascii=False) + "\n")


def _doubt(results: dict[str, Result], copy: Path) -> None:
    """Run every failing test without any mutant, and mark those that fail all the same."""
    with Server(copy) as server:
        for slow in (False, True):
            given = [r for r in results.values() if r.by and part_of(r.key.partition(" | ")[0]).slow == slow]
            tests = tuple(sorted({result.by for result in given}))
            if tests and not server.run(Job(tests, slow=slow)).passed:
                failing = {test for test in tests if not server.run(Job((test,), slow=slow)).passed}
                results.update((r.key, replace(r, doubtful=True)) for r in given if r.by in failing)


def _words(mutant: Mutant) -> tuple[str, ...]:
    """Return words of the names of function and file, for tests that bear them to come first."""
    words = re.findall("[a-z]{4,}", f"{Path(mutant.path).stem} {mutant.function}".lower())
    joined = Path(mutant.path).stem.replace("_", "")
    return tuple({*words, joined, *(word.rstrip("s") for word in words)} - {"model", "packed", "region", "test"})


def _mark(path: str) -> str:
    return hashlib.sha256((ROOT / path).read_bytes()).hexdigest()[:16]


def _compiler(folder: Path) -> Path:
    """Return a folder with a ``cc`` that does not take the time to optimize."""
    place = folder / "bin"
    real = shutil.which("cc")
    if real and not place.exists():
        place.mkdir()
        (place / "cc").write_text(f'#!/bin/sh\nexec {real} "$@" -O0\n', encoding="utf-8")
        (place / "cc").chmod(0o755)
    return place


def _copy(project: Path, copy: Path) -> None:
    """Copy what the tests need of the project."""
    copy.mkdir()
    left_out = ("__pycache__", "node_modules") if project == ROOT else ()
    for name in COPIED:
        shutil.copytree(project / name, copy / name, ignore=shutil.ignore_patterns(*left_out))
    for file in project.iterdir():
        if file.is_file():
            shutil.copy2(file, copy)


def _compile(copy: Path) -> None:
    """Compile the Python in a copy ahead.

    The packages go by contents: a mutant is as long as its source, and may be as old. The tests stay as they are.
    """
    for name in COPIED[:4]:
        for source in (copy / name).rglob("*.py"):
            py_compile.compile(str(source), invalidation_mode=py_compile.PycInvalidationMode.CHECKED_HASH)
    with Server(copy) as server:
        for part in parts():
            if not server.run(Job(part.tests, collect_only=True)).passed:
                raise RuntimeError(f"tests cannot be collected: {', '.join(part.tests)}")
