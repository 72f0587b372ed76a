"""A table of a report: texts in rows."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """Texts in rows."""

    title: str
    head: tuple[str, ...]  # empty for a table of names and values
    rows: tuple[tuple[str, ...], ...]
    widths: tuple[float, ...]  # of the columns, relative
