"""The C compiler of this machine, and its command line."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from controller.errors import CompilationError

# no contraction of a*b+c, and no debug information, which would name the folder of the build
FLAGS = ("-std=c99", "-O3", "-fno-math-errno", "-g0", "-ffp-contract=off", "-fPIC", "-shared")


def compiler_command() -> list[str]:
    """Return the command of a C compiler: ``CC``, else ``cc``, else that of the ziglang package."""
    named = os.environ.get("CC")
    if named:
        try:
            words = shlex.split(named)
        except ValueError as error:
            raise CompilationError(f"no C compiler: CC is {named!r}: {error}") from error
        if not words or shutil.which(words[0]) is None:
            raise CompilationError(f"no C compiler: CC is {named!r}, which is not on the PATH")
        return words
    if path := shutil.which("cc"):
        return [path]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise CompilationError("no C compiler: neither cc nor the ziglang package was found")


def compile_file(source: Path, library: Path, compiler: Sequence[str] | None = None) -> None:
    """Compile one C file into a shared library."""
    with compiling(source, library, compiler) as finish:
        finish()


@contextlib.contextmanager
def compiling(source: Path, library: Path, compiler: Sequence[str] | None = None) -> Iterator[Callable[[], None]]:
    """Run the compiler beside a block, at whose end it is stopped; the block receives a function that waits for it."""
    # named, for Apple's linker else writes the build folder into the library; for others without a table of names
    link = f"-Wl,-install_name,@rpath/{library.name}" if library.suffix == ".dylib" else "-s"
    command = [*(compiler or compiler_command()), *FLAGS, link, str(source), "-o", str(library), "-lm"]
    try:
        process = subprocess.Popen(  # noqa: S603
            command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, process_group=0
        )
    except OSError as error:
        raise CompilationError(f"C compiler {command[0]}: {error.strerror or error}") from error

    def finish() -> None:
        lines = process.communicate()[1].splitlines()
        if process.returncode != 0 or not library.is_file():
            errors = [line for line in lines if "error" in line] or lines
            message = errors[0].strip() if errors else "it wrote neither a library nor a message"
            raise CompilationError(f"C compiler {command[0]} failed: {message}")

    with process:
        try:
            yield finish
        finally:
            if process.poll() is None:
                _stop(process)


def _stop(process: subprocess.Popen[str]) -> None:
    """Stop a compiler's process group; it runs on if SIGHUP or SIGKILL ends Python at once."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError, PermissionError):  # it has ended meanwhile
            os.killpg(process.pid, signal.SIGTERM)
    else:
        process.terminate()
