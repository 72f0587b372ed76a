"""Description of an export format."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cosim.export.excerpt import Excerpt


@dataclass(frozen=True)
class Format:
    """An export format; each module of `cosim.export.formats` defines one as ``FORMAT``."""

    # function that writes an excerpt of a run into a file, and returns the paths of the written files, that file
    # first. It may import the packages of `needs`
    write: Callable[[Excerpt, Path], list[Path]]
    needs: tuple[str, ...] = ()  # packages beyond the base installation, as pip requirements
    beside: str = ""  # suffix of a second file; empty for none
    whole: bool = False  # true if the format defines its own signals and rates, which cannot be selected
