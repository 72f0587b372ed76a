"""The one line that says how to get what an optional part needs."""

from __future__ import annotations

import os
import re
import shutil
import sys

_PLAIN = re.compile(r"[\w./\\:+-]+")  # what no shell takes for anything else


def install_hint(*requirements: str) -> str:
    """Return the command that installs packages for the Python that runs.

    It names the packages themselves and not an extra of this distribution: so it works wherever that came from, a
    checkout, a wheel or an index, and leaves an editable installation as it is.

    Parameters
    ----------
    *requirements : str
        As pip takes them, with their bounds, such as ``"ziglang>=0.13"``: the same as in ``pyproject.toml``.

    Returns
    -------
    str
        A command for any shell. ``python`` is written out where the shell would find another one, or none.
    """
    python = "python" if _is_this(shutil.which("python")) else sys.executable
    return " ".join(map(_quoted, (python, "-m", "pip", "install", *requirements)))


def _is_this(found: str | None) -> bool:
    """Return whether a program is the Python that runs, under any of the names that an environment has for it."""
    return (
        found is not None
        and os.path.dirname(found) == os.path.dirname(sys.executable)
        and os.path.samefile(found, sys.executable)
    )


def _quoted(word: str) -> str:
    """Return a word in the quotation marks that both POSIX shells and those of Windows know, where it needs them."""
    return word if _PLAIN.fullmatch(word) else f'"{word}"'
