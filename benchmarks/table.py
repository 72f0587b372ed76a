"""Print times in one table, ratios first, and write them as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.timing import Timing
from cosim.io.atomic_file import write_atomic

_UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


@dataclass(frozen=True)
class Row:
    """A line of a table: a timing, or the reason why there is none, and the base of its ratio."""

    name: str
    timing: Timing | str  # a text where it was not timed
    base: str = ""  # name of the base; without one there is no ratio
    base_timing: Timing | str = ""
    # The base is a peer that took turns with the contestant of the row: the ratio is the peer's time over that of the
    # row, and has a range over the repeats. Else it is the row's time over the base's.
    is_paired: bool = False

    @property
    def ratio(self) -> float | None:
        """Ratio of the medians."""
        if isinstance(self.timing, str) or isinstance(self.base_timing, str):
            return None
        ratio = self.timing.median / self.base_timing.median
        return 1.0 / ratio if self.is_paired else ratio

    @property
    def range(self) -> tuple[float, float] | None:
        """The minimum and the maximum ratio of one repeat."""
        if not self.is_paired or isinstance(self.timing, str) or isinstance(self.base_timing, str):
            return None
        ratios = [b / a for a, b in zip(self.timing.samples, self.base_timing.samples, strict=True)]
        return min(ratios), max(ratios)


@dataclass(frozen=True)
class Table:
    """Rows under a heading."""

    title: str  # description of an item
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()  # lines below the rows


def with_base(timings: dict[str, Timing | str], base: str | None = None) -> list[Row]:
    """Return rows with ratios to the row `base`, by default the first."""
    base = base or next(iter(timings))
    return [Row(name, timing, base, timings[base]) for name, timing in timings.items()]


def format_time(seconds: float) -> str:
    """Return a time with its unit, to three figures."""
    scale, unit = next((u for u in _UNITS if seconds >= 0.9995 * u[0]), _UNITS[-1])
    return f"{format_3_digits(seconds / scale)} {unit}"


def format_3_digits(x: float) -> str:
    """Return a number to about three figures."""
    return f"{x:.0f}" if x >= 99.95 else f"{x:.1f}" if x >= 9.995 else f"{x:.2f}" if x >= 0.0995 else f"{x:.2g}"


_HEADINGS = ("ratio", "range", "median", "least–most", "what", "against", "its median", "its least–most")


def format_cells(row: Row) -> tuple[str, ...]:
    """Format a row, a cell for each of the headings; the times of the base are already in a row of its own."""
    ratio = f"{format_3_digits(row.ratio)}x" if row.ratio is not None else ""
    between = "–".join(map(format_3_digits, row.range)) if row.range is not None else ""
    against = row.base if row.base != row.name else ""
    theirs = _times(row.base_timing) if row.is_paired else ("", "")
    return (ratio, between, *_times(row.timing), row.name, against, *theirs)


def _times(timing: Timing | str) -> tuple[str, str]:
    if isinstance(timing, str):
        return "–", ""
    return format_time(timing.median), f"{format_time(timing.min)}–{format_time(timing.max)}"


def failure_reason(row: Row) -> str:
    """Return the reason why a row has no figures; "" if it has some."""
    timings = (row.timing, row.base_timing) if row.is_paired else (row.timing,)
    return "; ".join(word for word in timings if isinstance(word, str))


def print_tables(tables: Sequence[Table], ratio: str, machine: Sequence[str]) -> None:
    """Print tables in the same columns, below a heading on the machine."""
    for line in machine:
        print(line)
    print(f"ratio: {ratio}")
    formatted = [_format_rows(table) for table in tables]
    columns = list(zip(_HEADINGS, *(row for rows in formatted for row in rows), strict=True))
    widths = [max(map(len, column)) if any(column[1:]) else 0 for column in columns]
    print(_line(_HEADINGS, widths))
    for table, rows in zip(tables, formatted, strict=True):
        if table.title:
            print(f"-- {table.title}")
        for row, cells in zip(table.rows, rows, strict=True):
            print(_line(cells, widths) + (f" {failure_reason(row)}" if failure_reason(row) else ""))
        for note in table.notes:
            print(note)


def _format_rows(table: Table) -> list[tuple[str, ...]]:
    """Return the cells of a table; a base of all rows is not repeated."""
    rows = [format_cells(row) for row in table.rows]
    if len({row.base for row in table.rows if row.base}) > 1 or any(row.is_paired for row in table.rows):
        return rows
    against = _HEADINGS.index("against")
    return [(*row[:against], "", *row[against + 1 :]) for row in rows]


def _line(texts: Sequence[str], widths: Sequence[int]) -> str:
    named = _HEADINGS.index("what"), _HEADINGS.index("against")
    cells = [
        f"{text:{'<' if i in named else '>'}{width}}"
        for i, (text, width) in enumerate(zip(texts, widths, strict=True))
        if width
    ]
    return "  ".join(cells).rstrip()


def as_json(verb: str, tables: Sequence[Table], ratio: str, machine: Sequence[str]) -> dict[str, Any]:
    """Convert the tables of a verb to plain values, with all samples [s]."""
    return {
        "verb": verb,
        "machine": list(machine),
        "ratio": ratio,
        "tables": [
            {
                "title": table.title,
                "notes": list(table.notes),
                "rows": [
                    {
                        "name": row.name,
                        "against": row.base,
                        "paired": row.is_paired,
                        "ratio": row.ratio,
                        "range": row.range,
                        "seconds": _samples(row.timing),
                        "seconds_against": _samples(row.base_timing),
                        "note": failure_reason(row),
                    }
                    for row in table.rows
                ],
            }
            for table in tables
        ],
    }


def _samples(timing: Timing | str) -> list[float]:
    return [] if isinstance(timing, str) else list(timing.samples)


def write_json(path: Path, values: dict[str, Any]) -> None:
    """Write values as JSON."""
    write_atomic(path, json.dumps(values, indent=1, ensure_ascii=False) + "\n")
