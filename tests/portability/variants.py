"""Variants of the test environment: OpenBLAS kernels, the processor that NumPy sees, Pythons; how each is run."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "build" / "portability"
CHOICES = ("OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES")  # they choose a variant; none is taken over from outside
NUMPY = "numpy-baseline"

# what a process computes with: it asks the libraries, and does not believe what the environment was to make of them
PROBE = """
import json, pathlib, re, numpy as np, scipy.linalg, threadpoolctl
np.linalg.inv(np.eye(3)), scipy.linalg.cholesky(np.eye(3))
kernels = {}
for library in threadpoolctl.threadpool_info():
    if library["internal_api"] == "openblas":
        parts = pathlib.Path(library["filepath"]).parts
        package = next((name for name in ("numpy", "scipy") if any(p.startswith(name) for p in parts)), parts[-1])
        kernels[package] = library["architecture"]
from numpy._core import _multiarray_umath
features = {name.lower() for name, there in _multiarray_umath.__cpu_features__.items() if there}
cpuinfo = pathlib.Path("/proc/cpuinfo")
line = re.search(r"^(?:flags|Features)\\s*:(.*)$", cpuinfo.read_text() if cpuinfo.exists() else "", re.MULTILINE)
features |= {{"fma": "fma3", "pni": "sse3"}.get(name, name) for name in line[1].split()} if line else set()
dispatched = np.show_config(mode="dicts").get("SIMD Extensions", {}).get("found", [])
print(json.dumps([kernels, sorted(features), sorted(dispatched)]))
"""


class NotToBeHadError(Exception):
    """A variant cannot be run here, which is no failure."""


class BrokenError(Exception):
    """A variant that should run here does not start or finish its tests."""


@dataclass(frozen=True)
class Machine:
    """What a Python on this machine computes with."""

    kernels: dict[str, str]  # of the OpenBLAS that each package brings along, by package; none where it brings none
    features: frozenset[str]  # of the processor, as NumPy and Linux name them, in lower case
    dispatched: tuple[str, ...]  # those for which NumPy has code of its own, that it takes


@dataclass(frozen=True)
class Variant:
    """One way to run the tests."""

    name: str
    core: str = ""  # for OpenBLAS
    needs: tuple[str, ...] = ()  # features of the processor
    kernel: tuple[str, ...] = ()  # names by which OpenBLAS may call the kernel
    python: str = ""  # the version, of an environment of its own

    def reason_to_skip(self, machine: Machine) -> str:
        """Return the reason why this machine cannot run it, or ""."""
        if self.kernel and not machine.kernels:
            return "neither NumPy nor SciPy brings an OpenBLAS along"
        if lacking := [name for name in self.needs if name not in machine.features]:
            return f"the processor lacks {', '.join(lacking)}"
        if self.name == NUMPY and not machine.dispatched:
            return "NumPy has no code for what this processor has beyond the least"
        return ""

    def environment(self, machine: Machine) -> dict[str, str]:
        """Return the variables of its processes; of NumPy's names only those that it knows, for it warns of others."""
        disabled = ",".join(machine.dispatched) if self.name == NUMPY else ""
        own = dict(zip(CHOICES, (self.core, disabled), strict=True))
        outside = {name: value for name, value in os.environ.items() if name not in CHOICES}
        return outside | {name: value for name, value in own.items() if value}

    def not_taken(self, seen: Machine) -> str:
        """Return the setting of the variant that a process lacks, or ""."""
        for package, kernel in seen.kernels.items():
            if self.kernel and kernel not in self.kernel:
                return f"OpenBLAS of {package} runs its kernels for {kernel}"
        if self.name == NUMPY and seen.dispatched:
            return f"NumPy still takes its code for {', '.join(seen.dispatched)}"
        return ""


_AVX2 = ("avx2", "fma3")
_AVX512 = ("avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl")
VARIANTS = (
    Variant("haswell", "Haswell", _AVX2, ("Haswell",)),
    Variant("skylakex", "SkylakeX", _AVX512, ("SkylakeX",)),
    # kernels that an OpenBLAS is built without are others by another name, and it tells the first name that they have
    Variant("zen", "Zen", _AVX2, ("Zen", "Haswell")),
    Variant("prescott", "Prescott", ("sse3",), ("Prescott", "Katmai")),
    Variant(NUMPY),
    *(Variant(f"py{version.replace('.', '')}", python=version) for version in ("3.11", "3.12", "3.13", "3.14")),
)


def chosen(names: str, commit: str = "") -> list[Variant]:
    """Return the variants of a list such as ``haswell,py313``, or all, from the one that a commit tries first."""
    known = {variant.name: variant for variant in VARIANTS}
    wanted = list(dict.fromkeys(name.strip() for name in names.split(",") if name.strip())) or list(known)
    if unknown := [name for name in wanted if name not in known]:
        raise ValueError(f"--only {unknown[0]}: expected one of {', '.join(known)}")
    first = int(commit or "0", 16) % len(wanted)  # hashes of commits are spread evenly
    return [known[name] for name in [*wanted[first:], *wanted[:first]]]


@dataclass(frozen=True)
class Result:
    """The result of a variant."""

    name: str
    passed: int = 0
    failed: int = 0
    skipped: int = 0
    seconds: float = 0.0
    remark: str = ""  # why it was not run, or what is not good
    run: bool = True
    kernels: tuple[str, ...] = ()  # that OpenBLAS was seen to take

    @property
    def good(self) -> bool:
        """Whether it has passed, or could not be asked."""
        return not self.run or (not self.failed and not self.remark and self.passed > 0)


def table(results: Iterable[Result]) -> str:
    """Return a line for each variant."""
    lines = [f"{'variant':<15} {'passed':>7} {'failed':>7} {'skipped':>7} {'seconds':>8}  kernels"]
    for r in results:
        counts = f"{r.passed:>7} {r.failed:>7} {r.skipped:>7} {r.seconds:>8.0f}  {'/'.join(r.kernels)}"
        lines.append(f"{r.name:<15} {counts if r.run else 'not run:'}  {r.remark}".rstrip())
    return "\n".join(lines)


# ---- running -------------------------------------------------------------------------------------------------------


def look(python: Path, environment: dict[str, str]) -> Machine:
    """Return what a Python computes with in such an environment."""
    done = subprocess.run([python, "-c", PROBE], env=environment, capture_output=True, text=True, timeout=300)
    if done.returncode:
        raise BrokenError(f"what it computes with cannot be determined: {last_line(done.stderr)}")
    kernels, features, dispatched = json.loads(done.stdout)
    return Machine(kernels, frozenset(features), tuple(dispatched))


def run(variant: Variant, machine: Machine, tests: Sequence[str], limit: float, extras: str = "") -> Result:
    """Run tests, all fast ones where pytest gets no arguments, for at most some seconds in a variant."""
    begin = time.monotonic()
    try:
        if reason := variant.reason_to_skip(machine):
            raise NotToBeHadError(reason)
        python = _python_of(variant.python, extras.split(",")) if variant.python else Path(sys.executable)
        environment = variant.environment(machine)
        seen = look(python, environment)
        if reason := variant.not_taken(seen):
            raise BrokenError(reason)
        result = _tested(variant.name, [str(python), "-m", "pytest", *tests], environment, limit)
        return replace(result, kernels=tuple(sorted(set(seen.kernels.values()))))
    except NotToBeHadError as why:
        return Result(variant.name, remark=str(why), run=False)
    except (BrokenError, subprocess.TimeoutExpired) as why:
        return Result(variant.name, seconds=time.monotonic() - begin, remark=str(why))


def _tested(name: str, command: list[str], environment: dict[str, str], limit: float) -> Result:
    begin, folder = time.monotonic(), FOLDER / name
    folder.mkdir(parents=True, exist_ok=True)
    report, output = folder / "results.xml", folder / "output.txt"
    report.unlink(missing_ok=True)
    command += ["--numprocesses", "auto", "--dist", "worksteal", f"--junitxml={report}", "--verbose"]
    with output.open("w") as file:
        process = subprocess.Popen(
            command, cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT,
            start_new_session=True,
        )  # fmt: skip
        try:
            process.wait(limit)
            ended = ""
        except subprocess.TimeoutExpired:
            ended = f"ended after {limit:.0f} s"
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    if ended or not report.exists():
        where = f"last in {output.relative_to(ROOT)}"
        raise BrokenError(f"{ended or 'no results'}; {where}: {last_line(output.read_text(errors='replace'))}")
    return counted(name, report.read_text(), time.monotonic() - begin)


def counted(name: str, report: str, seconds: float) -> Result:
    """Return the numbers of a report in JUnit's format, with the names of what failed."""
    cases = list(ET.fromstring(report).iter("testcase"))
    failed = [c for c in cases if c.find("failure") is not None or c.find("error") is not None]
    skipped = sum(case.find("skipped") is not None for case in cases)
    names = ", ".join(f"{case.get('classname')}.{case.get('name')}" for case in failed)
    remark = f"failed: {names}" if failed else "" if cases else "no test was run"
    return Result(name, len(cases) - len(failed) - skipped, len(failed), skipped, seconds, remark)


def _python_of(version: str, extras: Sequence[str]) -> Path:
    """Return a Python of a version with all that the tests need, by uv, installed as `make lowest` does."""
    folder, uv = FOLDER / f"py{version.replace('.', '')}", FOLDER / "uv" / "bin" / "uv"
    requirements, python, arbiter = folder / "requirements.txt", folder / "env/bin/python", folder / "arbiter.in"
    folder.mkdir(parents=True, exist_ok=True)
    arbiter.write_text("./fuzzy_arbiter\n", encoding="utf-8")  # which is in no index
    if not uv.exists():
        _call(BrokenError, "an environment for uv", sys.executable, "-m", "venv", uv.parents[1])
        _call(BrokenError, "uv", uv.parent / "python", "-m", "pip", "install", "--quiet", "uv")
    wanted = [word for extra in extras for word in ("--extra", extra)]
    _call(
        NotToBeHadError, f"wheels of all that is needed on Python {version}", uv, "pip", "compile", "--quiet",
        "--only-binary", ":all:", "--python-version", version, *wanted, "--no-emit-package", "fuzzy-arbiter",
        "--output-file", requirements, "pyproject.toml", arbiter,
    )  # fmt: skip
    environment = ("venv", "--quiet", "--clear", "--seed", "--python", version, python.parents[1])
    _call(NotToBeHadError, f"Python {version}", uv, *environment)
    install = (uv, "pip", "install", "--quiet", "--python", python)
    _call(BrokenError, "the dependencies", *install, "--only-binary", ":all:", "--requirement", requirements)
    own = ("--editable", ROOT / "fuzzy_arbiter", "--editable", ROOT)
    _call(BrokenError, "the project", *install, "--no-deps", *own)
    return python


def _call(error: type[Exception], what: str, *command: object) -> None:
    """Run a command; raise an error that names what is missing if it fails."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))  # uv finds its Pythons on the path alone
    path = os.pathsep.join([os.environ.get("PATH", ""), *map(str, sorted(pyenv.glob("versions/*/bin")))])
    environment = {**os.environ, "PATH": path}
    done = subprocess.run([*map(str, command)], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=1800)
    if done.returncode:
        raise error(f"no {what}: {reason_of(done.stderr)}")


def reason_of(said: str) -> str:
    """Return why uv gave up: its error, and the first cause that it names; else the last line."""
    reasons = [line.strip() for line in said.splitlines() if line.lstrip().startswith(("error: ", "cause: "))]
    return "; ".join(line.partition(": ")[2] for line in reasons[:2]) or last_line(said)


def last_line(text: str) -> str:
    """Return the last nonempty line."""
    return next((line.strip() for line in reversed(text.splitlines()) if line.strip()), "nothing")
