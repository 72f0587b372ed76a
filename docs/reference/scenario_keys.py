"""Writes the table of a scenario's keys into its page: ``python docs/reference/scenario_keys.py``."""

from __future__ import annotations

from pathlib import Path

from cosim.scenario.keys import KEYS

PAGE = Path(__file__).parents[1] / "scenarios.md"

_HEAD = "| key | unit | default | meaning |\n|---|---|---|---|\n"


def page() -> str:
    """Return the page with the table that the code has."""
    before, _, after = PAGE.read_text(encoding="utf-8").partition(_HEAD)
    rest = after.partition("\n\n")[2]
    return f"{before}{_HEAD}{table()}\n{rest}"


def table() -> str:
    """Return the rows, in Markdown."""
    rows = (f"| `{path}` | {key.unit} | {key.default} | {key.meaning}{key.more} |\n" for path, key in KEYS.items())
    return "".join(rows).replace("|  |", "| |")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
