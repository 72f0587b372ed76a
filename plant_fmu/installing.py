"""Format the command that installs an optional dependency."""

from __future__ import annotations

import os
import re
import shutil
import sys

_PLAIN = re.compile(r"[\w./\\:+-]+")  # needs no quotes in any shell


def install_hint(*requirements: str) -> str:
    """Return the command that installs packages for the Python that runs."""
    # It names the packages and not an extra of this distribution: so it works for a checkout, a wheel and an index, and
    # does not change an editable installation.
    python = "python" if _is_running_python(shutil.which("python")) else sys.executable
    return " ".join(map(_quoted, (python, "-m", "pip", "install", *requirements)))


def _is_running_python(program: str | None) -> bool:
    """Return True if a program is the running Python, under any of the names that an environment has for it."""
    return (
        program is not None
        and os.path.dirname(program) == os.path.dirname(sys.executable)
        and os.path.samefile(program, sys.executable)
    )


def _quoted(word: str) -> str:
    """Quote a word, where it needs quotes, in marks that POSIX shells and those of Windows share."""
    return word if _PLAIN.fullmatch(word) else f'"{word}"'
