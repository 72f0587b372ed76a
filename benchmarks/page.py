"""The tables of docs/performance.md, from figures of `all` and `scaling`: each between two marks in the page."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.table import format_3_digits, format_time
from benchmarks.timing import Timing

PAGE = Path(__file__).parents[1] / "docs" / "performance.md"
PARTS = ("all", "scaling")
_WIDTH = 120  # maximum number of characters in a line
_PART = "<!-- figures: {} -->\n{}<!-- end of figures -->"


class PageError(Exception):
    """Raised if the page cannot be written."""


def rewrite(text: str, figures: list[dict[str, Any]]) -> str:
    """Return a page with tables of new figures."""
    for one in figures:
        mark = re.compile(_PART.format(re.escape(one["verb"]), ".*?"), re.DOTALL)
        if len(mark.findall(text)) != 1:
            raise PageError(f"expected the marks of the part {one['verb']!r} once")
        part = _PART.format(one["verb"], "\n" + "\n".join(_lines(one)) + "\n\n")
        text = mark.sub(lambda _, part=part: part, text)
    return text


def read_figures(path: Path) -> dict[str, Any]:
    """Read a file that ``--json`` wrote; raise PageError for another file."""
    try:
        figures: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        for row in (row for table in figures["tables"] for row in table["rows"]):
            row["paired"] = row["duel"] if "duel" in row else row["paired"]  # duel: the former name
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise PageError(f"{path}: no figures: {type(error).__name__}: {error}") from error
    if figures.get("verb") not in PARTS:
        raise PageError(f"{path}: figures of {figures.get('verb')!r}, expected of {' or '.join(PARTS)}")
    return figures


def _lines(figures: dict[str, Any]) -> Iterator[str]:
    yield from textwrap.wrap(f"{'; '.join(figures['machine'])}. The ratio says {figures['ratio']}.", _WIDTH)
    for table in figures["tables"]:
        yield ""
        yield f"**{table['title']}**"
        yield ""
        yield from _paired_rows(table["rows"]) if any(row["paired"] for row in table["rows"]) else _plain(table["rows"])
        if table["notes"]:
            yield ""
            yield f"Growth: {'; '.join(table['notes'])}."


def _paired_rows(rows: list[dict[str, Any]]) -> Iterator[str]:
    yield "| ratio | range | ours | median | peer | its median |"
    yield "|--:|--:|---|--:|---|--:|"
    for row in rows:
        between = "–".join(map(format_3_digits, row["range"])) if row["range"] else ""
        theirs = _median(row["seconds_against"]) if row["against"] else ""
        yield _row(_ratio(row), between, row["name"], _median(row["seconds"]), _with_note(row, row["against"]), theirs)


def _plain(rows: list[dict[str, Any]]) -> Iterator[str]:
    yield "| ratio | median | least–most | |"
    yield "|--:|--:|--:|---|"
    for row in rows:
        spread = "–".join(map(format_time, (min(row["seconds"]), max(row["seconds"])))) if row["seconds"] else ""
        yield _row(_ratio(row), _median(row["seconds"]), spread, _with_note(row, row["name"]))


def _row(*cells: str) -> str:
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"


def _ratio(row: dict[str, Any]) -> str:
    return f"{format_3_digits(row['ratio'])}" if row["ratio"] else ""


def _median(seconds: list[float]) -> str:
    return format_time(Timing(tuple(seconds)).median) if seconds else "–"


def _with_note(row: dict[str, Any], name: str) -> str:
    return f"{name} ({row['note']})" if row["note"] else name
