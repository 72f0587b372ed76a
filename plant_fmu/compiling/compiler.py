"""Find a C compiler on this machine, and make a shared library with it."""

from __future__ import annotations

import importlib.util
import logging
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from plant_fmu.archive import temporary_folder
from plant_fmu.compiling.platforms import Platform, native_platform
from plant_fmu.errors import BuildError
from plant_fmu.installing import install_hint

log = logging.getLogger(__name__)

# no contraction of a*b+c, so that compilers differ in no bit beyond what their C libraries do;
# and no debug information, which would name the folder of the build
FLAGS = (
    "-std=c99", "-O3", "-fno-math-errno", "-g0", "-ffp-contract=off", "-fPIC", "-fvisibility=hidden", "-shared",
    "-DFMI2_OVERRIDE_FUNCTION_PREFIX", "-DFMI3_OVERRIDE_FUNCTION_PREFIX",
)  # fmt: skip
_NOT_UNROLLED = ("constants.c", "forces_tangent.c", "tangent.c")  # not in a step: unrolling only makes them larger
_WARNINGS = ("-Wall", "-Wextra", "-Wpedantic")
_ZIGLANG = "ziglang>=0.13"  # the package holds a C compiler


def find_compiler() -> list[str]:
    """Return the command of a C compiler for this machine: ``CC``, else ``cc``, else that of the ziglang package."""
    cc = os.environ.get("CC")
    if cc:
        try:
            words = shlex.split(cc)
        except ValueError as error:
            raise BuildError(f"no C compiler: CC is {cc!r}: {error}") from error
        if not words or shutil.which(words[0]) is None:
            raise BuildError(f"no C compiler: CC is {cc!r}, which is not on the PATH")
        return words
    if path := shutil.which("cc"):
        return [path]
    if importlib.util.find_spec("ziglang"):
        return cross_compiler(native_platform())
    raise BuildError(f"no C compiler: neither cc nor the ziglang package was found; {install_hint(_ZIGLANG)}")


def cross_compiler(platform: Platform) -> list[str]:
    """Return the command of the ziglang package's C compiler for a platform."""
    if importlib.util.find_spec("ziglang") is None:
        hint = install_hint(_ZIGLANG)
        raise BuildError(f"no compiler for other platforms: the ziglang package was not found; {hint}")
    return [sys.executable, "-m", "ziglang", "cc", "-target", platform.target]


def compile_library(
    compiler: Sequence[str],
    platform: Platform,
    sources: Sequence[Path],
    includes: Sequence[Path],
    library: Path,
    flags: Sequence[str] = (),
) -> None:
    """Compile C files into one shared library without any dependency but the C library."""
    link = ["-s"]
    if platform.system == "darwin":
        # Named, for the linker else writes the build folder into the library. Names of functions stay: Apple's
        # linker has no -s, and ziglang's, with that flag, makes some numbers of a table vary between builds.
        link = [f"-Wl,-install_name,@rpath/{library.name}"]
    options = [*FLAGS, *_WARNINGS, *flags, *(f"-I{folder}" for folder in includes)]
    with temporary_folder("plant_fmu-") as scratch:
        objects = [scratch / f"{source.stem}.o" for source in sources]
        with ThreadPoolExecutor(os.cpu_count()) as pool:  # a process each: they take turns if there is but one core
            commands = [
                [*compiler, *options, *_extra_flags(source), "-c", str(source), "-o", str(output)]
                for source, output in zip(sources, objects, strict=True)
            ]
            list(pool.map(run_compiler, commands))
        run_compiler([*compiler, *FLAGS, *link, *map(str, objects), "-o", str(library), "-lm"])
    if not library.is_file():
        raise BuildError(f"C compiler {shlex.join(compiler)} failed: it wrote neither a library nor a message")


def _extra_flags(source: Path) -> tuple[str, ...]:
    return ("-fno-unroll-loops",) if source.name in _NOT_UNROLLED else ()


def run_compiler(command: Sequence[str]) -> None:
    """Run a compiler, or another tool of a build."""
    log.debug("%s", shlex.join(command))
    try:
        process = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    except OSError as error:
        raise BuildError(f"C compiler {command[0]}: {error.strerror or error}") from error
    if process.returncode != 0:
        lines = process.stderr.splitlines()
        errors = [line for line in lines if "error" in line] or lines or ["it wrote no message"]
        raise BuildError(f"C compiler {command[0]} failed: {errors[0].strip()}")
    for line in process.stderr.splitlines():
        log.debug("%s", line)
