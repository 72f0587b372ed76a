"""Draws the rooms of cosim above the three packages that they import, as the `__init__.py` of each room says it."""

from __future__ import annotations

import re
from pathlib import Path
from xml.sax.saxutils import escape

PICTURE = "architecture.svg"
ROOT = Path(__file__).parents[2]
_BELOW = ("fuzzy_arbiter", "plant_fmu", "controller")
_WIDTH, _ROW, _BOX, _GAP, _LEFT = 960, 74, 48, 14, 20  # px
_DOCSTRING = re.compile(r'^"""(.*?)"""', re.S)
_IMPORTS = re.compile(r"^Imports: (.*?)\.$", re.M | re.S)


def main() -> None:
    """Draw it."""
    Path(PICTURE).write_text(picture(), encoding="utf-8")


def rooms() -> dict[str, tuple[str, set[str]]]:
    """Return the outermost rooms of cosim: what the docstring of each begins with, and the rooms that it imports."""
    found = {folder.name: folder for folder in sorted((ROOT / "cosim").iterdir()) if (folder / "__init__.py").is_file()}
    result = {}
    for name, folder in found.items():
        imported = set()
        for file in folder.rglob("__init__.py"):
            imports = _IMPORTS.search(_docstring(file))
            imported |= {room.split(".")[0] for room in re.split(r",\s+", imports[1])} if imports else set()
        result[name] = (_first_line(folder), imported & found.keys() - {name})
    return result


def floors(imports: dict[str, set[str]]) -> list[list[str]]:
    """Return the rooms row by row from the ground up: each imports rooms of rows below its own alone."""
    rows: list[list[str]] = []
    left = set(imports)
    while left:
        row = sorted(room for room in left if not imports[room] & left)
        rows.append(row)
        left -= set(row)
    return rows


def picture() -> str:
    """Return the picture as SVG."""
    known = rooms()
    imports = {room: others for room, (_, others) in known.items()}
    rows = floors(imports)
    texts = {room: text for room, (text, _) in known.items()} | {name: _first_line(ROOT / name) for name in _BELOW}
    height = (len(rows) + 1) * _ROW + 3 * _LEFT
    places = {room: place for i, row in enumerate(rows) for room, place in _row(row, height, i + 1, 0.0).items()}
    below = _row(list(_BELOW), height, 0, _LEFT)
    lines = [
        f'<line x1="{x:g}" y1="{y + _BOX:g}" x2="{places[other][0] + places[other][2] / 2:g}" '
        f'y2="{places[other][1]:g}" stroke="#90a4ae"/>'
        for room, (left, y, width) in places.items()
        for x in [left + width / 2]
        for other in sorted(_nearest(room, imports))
    ]
    boxes = [_box(room, texts[room], *place, "#e0f2f1") for room, place in places.items()]
    boxes += [_box(name, texts[name], *place, "#ffe0b2") for name, place in below.items()]
    ground = height - _ROW - 1.5 * _LEFT
    rule = f'<line x1="0" y1="{ground:g}" x2="{_WIDTH}" y2="{ground:g}" stroke="#546e7a" stroke-dasharray="6 4"/>'
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" font-family="sans-serif">',
            f'<rect width="{_WIDTH}" height="{height}" fill="#ffffff"/>',
            *lines,
            rule,
            f'<text x="{_LEFT}" y="{ground - 6:g}" font-size="11" fill="#546e7a">cosim, above three packages that '
            "do not know each other</text>",
            *boxes,
            "</svg>\n",
        ]
    )


def _nearest(room: str, imports: dict[str, set[str]]) -> set[str]:
    """Return the imported rooms that no other imported room imports in turn."""

    def all_of(start: str) -> set[str]:
        return imports[start].union(*(all_of(other) for other in imports[start]))

    return {other for other in imports[room] if not any(other in all_of(one) for one in imports[room])}


def _row(names: list[str], height: float, level: int, down: float) -> dict[str, tuple[float, float, float]]:
    """Return left edge, upper edge and width of the boxes of a row, 0 at the bottom [px]."""
    width = (_WIDTH - 2 * _LEFT - (len(names) - 1) * _GAP) / len(names)
    width = min(width, 300.0)
    left = (_WIDTH - len(names) * width - (len(names) - 1) * _GAP) / 2
    top = height - (level + 1) * _ROW - _LEFT + down
    return {
        name: (left + i * (width + _GAP), top - (0.0 if not level else _LEFT), width) for i, name in enumerate(names)
    }


def _box(name: str, text: str, x: float, y: float, width: float, color: str) -> str:
    middle = x + width / 2
    return (
        f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{_BOX}" rx="5" fill="{color}" stroke="#37474f"/>'
        f'<text x="{middle:g}" y="{y + 20:g}" font-size="14" font-weight="bold" text-anchor="middle">{name}</text>'
        f'<text x="{middle:g}" y="{y + 38:g}" font-size="10" text-anchor="middle">{escape(text)}</text>'
    )


def _docstring(file: Path) -> str:
    found = _DOCSTRING.match(file.read_text(encoding="utf-8"))
    return found[1] if found else ""


def _first_line(folder: Path) -> str:
    """Return the first line of a package's docstring, as far as a box is wide."""
    line = _docstring(folder / "__init__.py").splitlines()[0].replace("`", "")
    return re.split(r"[:;.]|, which", line)[0]
