"""CSV: a table of numbers that read back exactly, and a second one of the units."""

from __future__ import annotations

import csv
from pathlib import Path

from cosim.export.excerpt import Excerpt


def write(excerpt: Excerpt, path: Path) -> list[Path]:
    """Write the tables."""
    # The header has the names without units, so that a column is found by its signal's name.
    names = [column.name for column in excerpt.columns]
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerow(names)
        for block in excerpt.blocks(names):
            # repr is the shortest text that reads back to the same bits, and keeps the point of 1.0
            file.writelines(f"{','.join(map(repr, row))}\n" for row in block.to_array().tolist())
    units = path.with_suffix(".units.csv")
    with units.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(("name", "unit", "description"))
        table.writerows((column.name, column.unit, column.description) for column in excerpt.columns)
    return [path, units]
