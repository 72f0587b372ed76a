"""Tables of a report."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """A table of texts."""

    title: str
    head: tuple[str, ...]  # names of the columns; empty for a table of names and values
    rows: tuple[tuple[str, ...], ...]
