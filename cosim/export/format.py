"""The entry of a format of other tools: all that the software knows of it, in one place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cosim.export.excerpt import Excerpt


@dataclass(frozen=True)
class Format:
    """What a module of `cosim.export.formats` says of its format, as ``FORMAT``.

    Parameters
    ----------
    write : callable
        Writes an excerpt of a run into a file, and returns the paths of what it wrote, that file first. It imports
        what the base installation does not bring.
    needs : tuple of str
        What that is, as requirements of pip.
    beside : str
        Ending of a second file, in the place of the suffix.
    whole : bool
        Whether it has signals and rates of its own, and takes no choice of them.
    """

    write: Callable[[Excerpt, Path], list[Path]]
    needs: tuple[str, ...] = ()
    beside: str = ""
    whole: bool = False
