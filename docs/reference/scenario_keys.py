"""Writes the table of a scenario's keys into its page: ``python docs/reference/scenario_keys.py``."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cosim.scenario.keys import KEYS
from cosim.scenario.tables import CriterionEntry, File, RegionEntry
from plant_fmu.toml_tables import find_dataclass

PAGE = Path(__file__).parents[1] / "scenarios.md"

_HEAD = "| key | unit | default | meaning |\n|---|---|---|---|\n"


def page() -> str:
    """Return the page with the table that the code has."""
    before, _, after = PAGE.read_text(encoding="utf-8").partition(_HEAD)
    rest = after.partition("\n\n")[2]
    return f"{before}{_HEAD}{table()}\n{rest}"


def table() -> str:
    """Return the rows, in Markdown."""
    values = dict(defaults(File))
    rows = []
    for path, key in KEYS.items():
        default = key.default or _default(values.get(path, dataclasses.MISSING))
        rows.append(f"| `{path}` | {key.unit} | {default} | {key.meaning}{key.more} |\n")
    return "".join(rows).replace("|  |", "| |")


def defaults(kind: type, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the path to each key of a table, and its default."""
    hints = typing.get_type_hints(kind)
    for field in dataclasses.fields(kind):
        listed = [kind for kind in (CriterionEntry, RegionEntry) if hints[field.name] == tuple[kind, ...]]
        inner = listed[0] if listed else find_dataclass(hints[field.name])
        if inner is None or hints[field.name] is not inner:
            factory = field.default_factory
            yield f"{path}{field.name}", field.default if factory is dataclasses.MISSING else factory()
        if inner is not None:
            yield from defaults(inner, f"{path}{field.name}{'' if hints[field.name] is inner else '[]'}.")


def _default(value: Any) -> str:
    if value is dataclasses.MISSING:
        return "required"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f"`{value}`" if value else '`""`'
    if isinstance(value, tuple):
        return " ".join(f"{x:g}" for x in value)
    if isinstance(value, dict):
        return "none"
    return "`inf`" if value == float("inf") else f"{value:g}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
