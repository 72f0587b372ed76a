"""Finding a C compiler on this machine, and making a shared library with it."""

from __future__ import annotations

import importlib.util
import logging
import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from plant_fmu.errors import BuildError

log = logging.getLogger(__name__)

# no contraction of a*b+c, so that compilers differ in no bit beyond what their C libraries do;
# and no debug information, which would name the folder of the build
FLAGS = ("-std=c99", "-O3", "-fno-math-errno", "-g0", "-ffp-contract=off", "-fPIC", "-fvisibility=hidden", "-shared")
_WARNINGS = ("-Wall", "-Wextra", "-Wpedantic")

_OLD_GLIBC = "gnu.2.17"  # so that a library built here also loads on older systems


def native_platform() -> str:
    """Return this machine's platform in FMI 3.0's words, such as ``x86_64-linux``."""
    machine = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}.get(
        platform.machine().lower()
    )
    system = {"Linux": "linux", "Windows": "windows", "Darwin": "darwin"}.get(platform.system())
    if system is None or machine is None:
        here = f"{platform.system()} on {platform.machine()}"
        raise BuildError(f"no FMU can be built here, {here}: expected Linux, Windows or macOS on x86_64 or aarch64")
    return f"{machine}-{system}"


def library_suffix() -> str:
    """Return the ending of shared libraries on this machine."""
    return {"Windows": ".dll", "Darwin": ".dylib"}.get(platform.system(), ".so")


def find_compiler() -> list[str]:
    """Return the command of a C compiler: ``CC``, else ``cc``, else that of the ziglang package.

    Returns
    -------
    list of str
        The command and its first arguments.

    Raises
    ------
    BuildError
        If there is none.
    """
    named = os.environ.get("CC")
    if named:
        try:
            words = shlex.split(named)
        except ValueError as error:
            raise BuildError(f"no C compiler: CC is {named!r}: {error}") from error
        if not words or shutil.which(words[0]) is None:
            raise BuildError(f"no C compiler: CC is {named!r}, which is not on the PATH")
        return words
    if path := shutil.which("cc"):
        return [path]
    if importlib.util.find_spec("ziglang"):
        words = [sys.executable, "-m", "ziglang", "cc"]
        machine, system = native_platform().split("-")
        if system == "linux":
            return [*words, "-target", f"{machine}-linux-{_OLD_GLIBC}"]
        return [*words, "-mcpu=baseline"]
    raise BuildError("no C compiler: neither cc nor the ziglang package was found; pip install 'subreach[build]'")


def compile_library(sources: Sequence[Path], includes: Sequence[Path], library: Path) -> None:
    """Compile C files into one shared library without any dependency but the C library.

    Parameters
    ----------
    sources : sequence of Path
        The C files.
    includes : sequence of Path
        Folders of headers.
    library : Path
        What to write.

    Raises
    ------
    BuildError
        If there is no compiler, or it fails; its first complaint is in the message.
    """
    compiler = find_compiler()
    command = [
        *compiler, *FLAGS, *_WARNINGS,
        *(f"-I{folder}" for folder in includes),
        *map(str, sources), "-o", str(library), "-lm",
    ]  # fmt: skip
    log.debug("%s", shlex.join(command))
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as error:
        raise BuildError(f"C compiler {compiler[0]}: {error.strerror or error}") from error
    if done.returncode != 0 or not library.is_file():
        said = (
            [line for line in done.stderr.splitlines() if "error" in line]
            or done.stderr.splitlines()
            or ["it wrote no library, and no word"]
        )
        raise BuildError(f"C compiler {shlex.join(compiler)} failed: {said[0].strip()}")
    for line in done.stderr.splitlines():
        log.debug("%s", line)
