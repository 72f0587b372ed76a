"""Description of an export format."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cosim.export.excerpt import Excerpt


@dataclass(frozen=True)
class Format:
    """Description of a format, which each module of `cosim.export.formats` has as ``FORMAT``.

    Parameters
    ----------
    write : callable
        Writes an excerpt of a run into a file, and returns the paths of the written files, that file first. It imports
        packages that are not in the base installation.
    needs : tuple of str
        These packages, as pip requirements.
    beside : str
        Suffix of a second file; empty for none.
    whole : bool
        True if the format defines its own signals and rates, which cannot be selected.
    """

    write: Callable[[Excerpt, Path], list[Path]]
    needs: tuple[str, ...] = ()
    beside: str = ""
    whole: bool = False
