"""Run variants: install a Python if needed, verify the active kernels, then run the tests."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tests.portability.variants import CHOICES, Machine, Result, Variant

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "build" / "portability"


class NotToBeHadError(Exception):
    """A variant cannot be run here, which is no failure."""


class BrokenError(Exception):
    """A variant that should run here does not start or finish its tests."""


def environment_of(variant: Variant, machine: Machine) -> dict[str, str]:
    """Return the variables of a variant's processes."""
    outside = {name: value for name, value in os.environ.items() if name not in CHOICES}
    return {**outside, **variant.settings(machine)}


def look(python: Path, environment: dict[str, str]) -> Machine:
    """Return what a Python computes with in such an environment."""
    command = [str(python), "-m", "tests.portability.kernels"]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300)
    if done.returncode:
        raise BrokenError(f"what it computes with cannot be determined: {_last(done.stderr)}")
    about = json.loads(done.stdout)
    return Machine(about["kernels"], frozenset(about["features"]), tuple(about["dispatched"]))


def run(variant: Variant, machine: Machine, tests: Sequence[str], limit: float, extras: Sequence[str] = ()) -> Result:
    """Run tests in a variant.

    Parameters
    ----------
    variant : Variant
        Which.
    machine : Machine
        This one, as it is without any of them.
    tests : sequence of str
        Arguments of pytest; all fast tests where there are none.
    limit : float
        Seconds for the tests, after which they are ended.
    extras : sequence of str
        Of this project, installed for a Python of its own.
    """
    begin = time.monotonic()
    try:
        if reason := variant.reason_to_skip(machine):
            raise NotToBeHadError(reason)
        python = _python_of(variant.python, extras) if variant.python else Path(sys.executable)
        environment = environment_of(variant, machine)
        seen = look(python, environment)
        if reason := variant.not_taken(seen):
            raise BrokenError(reason)
        kernels = tuple(sorted(set(seen.kernels.values())))
        return replace(_tested(variant, python, environment, tests, limit), kernels=kernels)
    except NotToBeHadError as why:
        return Result(variant.name, remark=str(why), run=False)
    except (BrokenError, subprocess.TimeoutExpired) as why:
        return Result(variant.name, seconds=time.monotonic() - begin, remark=str(why))


def _tested(variant: Variant, python: Path, environment: dict[str, str], tests: Sequence[str], limit: float) -> Result:
    begin, folder = time.monotonic(), FOLDER / variant.name
    folder.mkdir(parents=True, exist_ok=True)
    report, output = folder / "results.xml", folder / "output.txt"
    report.unlink(missing_ok=True)
    numbers = ["--numprocesses", "auto", "--dist", "worksteal", f"--junitxml={report}", "--verbose"]
    command = [str(python), "-m", "pytest", *numbers, *tests]
    with output.open("w") as file:
        in_time = _ended(command, environment, file, limit - (time.monotonic() - begin))
    if not in_time:
        last = _last(output.read_text(errors="replace"))
        raise BrokenError(f"ended after {limit:.0f} s; last in {output.relative_to(ROOT)}: {last}")
    seconds = time.monotonic() - begin
    if not report.exists():
        raise BrokenError(
            f"no results; last in {output.relative_to(ROOT)}: {_last(output.read_text(errors='replace'))}"
        )
    return counted(variant.name, report.read_text(), seconds)


def _ended(command: list[str], environment: dict[str, str], file: object, limit: float) -> bool:
    """Return whether a command ended in time; otherwise kill it and its children."""
    process = subprocess.Popen(
        command, cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT,
        start_new_session=True,
    )  # fmt: skip
    try:
        process.wait(max(limit, 0.1))
    except subprocess.TimeoutExpired:
        return False
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    return True


def counted(name: str, report: str, seconds: float) -> Result:
    """Return the numbers of a report in JUnit's format, with the names of what failed."""
    suite = ET.fromstring(report).find("testsuite")
    total, failed, skipped = 0, [], 0
    for case in suite.iter("testcase") if suite is not None else ():
        total += 1
        skipped += case.find("skipped") is not None
        if case.find("failure") is not None or case.find("error") is not None:
            failed.append(f"{case.get('classname')}.{case.get('name')}")
    remark = "failed: " + ", ".join(failed) if failed else "" if total else "no test was run"
    return Result(name, total - len(failed) - skipped, len(failed), skipped, seconds, remark)


def _python_of(version: str, extras: Sequence[str]) -> Path:
    """Return a Python of a version with all that the tests need, by uv, installed as `make lowest` does."""
    folder = FOLDER / f"py{version.replace('.', '')}"
    uv, requirements, python = (
        FOLDER / "uv" / "bin" / "uv",
        folder / "requirements.txt",
        folder / "env" / "bin" / "python",
    )
    pip = [str(uv.parent / "python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "uv"]
    folder.mkdir(parents=True, exist_ok=True)
    if not uv.exists():
        _run_checked([sys.executable, "-m", "venv", str(uv.parents[1])], BrokenError, "an environment for uv")
        _run_checked(pip, BrokenError, "uv")
    wanted = [word for extra in extras for word in ("--extra", extra)]
    resolve = ["pip", "compile", "--quiet", "--only-binary", ":all:", "--python-version", version, *wanted]
    arbiter = folder / "arbiter.in"  # which is in no index
    arbiter.write_text("./fuzzy_arbiter\n", encoding="utf-8")
    resolve += ["--no-emit-package", "fuzzy-arbiter", "--output-file", str(requirements)]
    resolve += ["pyproject.toml", str(arbiter)]
    _run_checked([str(uv), *resolve], NotToBeHadError, f"wheels of all that is needed on Python {version}")
    _run_checked(
        [str(uv), "venv", "--quiet", "--clear", "--seed", "--python", version, str(python.parents[1])],
        NotToBeHadError,
        f"Python {version}",
    )
    install = [str(uv), "pip", "install", "--quiet", "--python", str(python)]
    _run_checked(
        [*install, "--only-binary", ":all:", "--requirement", str(requirements)], BrokenError, "the dependencies"
    )
    own = ["--editable", str(ROOT / "fuzzy_arbiter"), "--editable", str(ROOT)]
    _run_checked([*install, "--no-deps", *own], BrokenError, "the project")
    return python


def _run_checked(command: list[str], error: type[Exception], what: str) -> None:
    """Run a command; raise an error that names what is missing if it fails."""
    found = os.pathsep.join(str(folder) for folder in sorted(_pyenv().glob("versions/*/bin")))
    environment = {**os.environ, "PATH": os.pathsep.join(filter(None, [os.environ.get("PATH", ""), found]))}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=1800)
    if done.returncode:
        raise error(f"no {what}: {reason_of(done.stderr)}")


def reason_of(said: str) -> str:
    """Return why uv gave up: its error, and the first cause that it names; else the last line."""
    reasons = [line.strip() for line in said.splitlines() if line.lstrip().startswith(("error: ", "cause: "))]
    return "; ".join(line.partition(": ")[2] for line in reasons[:2]) or _last(said)


def _pyenv() -> Path:
    """Return where pyenv keeps its Pythons: uv finds those on the path alone."""
    return Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))


def _last(text: str) -> str:
    """Return the last nonempty line."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "nothing"
