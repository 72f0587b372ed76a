"""Tables in plain text."""

from __future__ import annotations

from collections.abc import Sequence


def aligned(table: Sequence[tuple[str, ...]]) -> list[str]:
    """Format a table with indented columns of equal width."""
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return ["  " + "  ".join(map(str.ljust, row, widths)).rstrip() for row in table]
