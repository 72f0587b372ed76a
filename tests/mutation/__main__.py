"""Mutate signs one at a time, run the tests of the mutated source, and report the mutants that survive."""

from __future__ import annotations

import argparse
import contextlib
import fnmatch
import hashlib
import json
import os
import queue
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.mutation.mutants import ROOT, Mutant, Part, all_mutants, equivalent_mutants, load_plan

COPIED = ("controller", "plant_fmu", "fuzzy_arbiter", "cosim", "tests", "examples", "docs", "benchmarks")
TEST_SECONDS, RUN_SECONDS = 60, 900


def make_copy(folder: Path) -> Path:
    """Copy what the tests need, with a ``cc`` that does not optimize."""
    for name in COPIED:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "node_modules"))
    for file in filter(Path.is_file, ROOT.iterdir()):
        shutil.copy2(file, folder)
    (folder / "bin").mkdir()
    (folder / "bin" / "cc").write_text(f'#!/bin/sh\nexec {shutil.which("cc")} "$@" -O0\n', encoding="utf-8")
    (folder / "bin" / "cc").chmod(0o755)
    return folder


def run_tests(copy: Path, part: Part) -> str:
    """Run the tests of a part in a copy; return which failed first, "" if none did."""
    variables = {
        "SUBREACH_INTERPRETED": "1", "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(copy),
        "PATH": f"{copy / 'bin'}{os.pathsep}{os.environ['PATH']}", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1",
    }  # fmt: skip
    # overflow and the like make NumPy warn, of which compiled code says nothing
    options = ["-qx", "--medium", "--tb=no", "-pno:cacheprovider", "-pno:xdist", "-Wignore::RuntimeWarning"]
    options += [f"--timeout={TEST_SECONDS}", "--timeout-method=thread"]
    if part.without:
        options += ["-k", f"not ({' or '.join(part.without)})"]
    command = [sys.executable, "-m", "pytest", *options, *(f"tests/{file}" for file in part.tests)]
    process = subprocess.Popen(
        command, cwd=copy, env=os.environ | variables, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        output, _ = process.communicate(timeout=RUN_SECONDS)
    except subprocess.TimeoutExpired:
        return f"no end within {RUN_SECONDS} s"
    finally:
        with contextlib.suppress(ProcessLookupError):  # with all that the tests have started
            os.killpg(process.pid, signal.SIGKILL)
    failed = [line.split()[1] for line in output.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return "" if process.returncode == 0 else (failed or [f"status {process.returncode}"])[0]


def run_mutants(mutants: list[Mutant], jobs: int, results: Path | None) -> dict[str, str]:
    """Run the tests of each mutant; return which failed, by key, "" for survivors. `results` is read and continued."""
    sources = {m.path: (ROOT / m.path).read_text(encoding="utf-8") for m in mutants}
    marks = {m.key: hashlib.sha256(sources[m.path].encode()).hexdigest()[:16] for m in mutants}
    failed_tests: dict[str, str] = {}
    if results and results.is_file():
        for line in results.read_text(encoding="utf-8").splitlines():
            entry = json.loads(line)
            if len(entry) == 3 and marks.get(entry[0]) == entry[1]:
                failed_tests[entry[0]] = entry[2]
    left = [m for m in mutants if m.key not in failed_tests]
    random.Random(0).shuffle(left)  # so that what is done when it is stopped is a fair sample
    todo: queue.SimpleQueue[Mutant] = queue.SimpleQueue()
    for mutant in left:
        todo.put(mutant)

    def work(copy: Path) -> None:
        while True:
            try:
                mutant = todo.get_nowait()
            except queue.Empty:
                return
            target = copy / mutant.path
            target.write_text(mutant.apply(sources[mutant.path]), encoding="utf-8")
            failed_tests[mutant.key] = run_tests(copy, load_plan()[mutant.path])
            target.write_text(sources[mutant.path], encoding="utf-8")
            if results:
                results.parent.mkdir(parents=True, exist_ok=True)
                with results.open("a", encoding="utf-8") as file:
                    file.write(json.dumps([mutant.key, marks[mutant.key], failed_tests[mutant.key]]) + "\n")

    with tempfile.TemporaryDirectory(prefix="mutation-") as scratch, ThreadPoolExecutor(jobs) as pool:
        copies = [make_copy(Path(scratch, str(i))) for i in range(min(jobs, len(left)))]
        for part in {id(load_plan()[m.path]): load_plan()[m.path] for m in left}.values():
            if failed := run_tests(copies[0], part):
                raise RuntimeError(f"fails without any mutant: {failed}")
        try:
            list(pool.map(work, copies))
        finally:
            with contextlib.suppress(queue.Empty):  # after Ctrl-C
                while True:
                    todo.get_nowait()
    return failed_tests


def main() -> int:
    """Run the mutants that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    parser.add_argument("--sample", type=int, metavar="N", help="of all mutants only N, drawn at random")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn (1)")
    parser.add_argument("--only", metavar="PATTERN", default="*", help="only of sources like controller/regions/*")
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time (2)")
    parser.add_argument("--results", type=Path, metavar="FILE", help="JSON lines: read if there, and continued")
    arguments = parser.parse_args()
    equivalent = equivalent_mutants()
    mutants = [m for m in all_mutants() if fnmatch.fnmatch(m.path, arguments.only) and m.key not in equivalent]
    if arguments.sample is not None:
        mutants = random.Random(arguments.seed).sample(mutants, min(arguments.sample, len(mutants)))
    failed_tests = run_mutants(mutants, arguments.jobs, arguments.results)
    scores = Counter((m.path.partition("/")[0], bool(failed_tests[m.key])) for m in mutants)
    for m in sorted(mutants, key=lambda m: (m.path, m.line)):
        print(f"{m.path}:{m.line}  {m.before}  {m.text[:70]}\n    {failed_tests[m.key] or 'SURVIVED'}")
    for package in sorted({package for package, _ in scores}):
        print(f"{package}: {scores[package, True]} of {scores[package, True] + scores[package, False]} noticed")
    return int(not all(failed_tests[m.key] for m in mutants))


if __name__ == "__main__":
    sys.exit(main())
