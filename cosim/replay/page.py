"""The page of one or several runs: one self-contained HTML file."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

from cosim.io.atomic_file import write_atomic

SCENE_SCRIPTS = (
    "palette.js", "vectors.js", "camera.js", "solids.js", "planes.js", "painter.js", "sights.js",
    "hull.js", "vehicle.js", "forces.js", "trail.js", "shadows.js", "bounds.js", "order.js",
    "regions.js", "labels.js", "floor.js", "controls.js", "scene.js",
)  # fmt: skip
_PLAYER = (
    "player.js", "words.js", "curves.js", "axes.js", "plot.js", "charts.js", "board.js", "timeline.js", "panel.js",
    "stage.js", "head.js", "keys.js", "page.js",
)  # fmt: skip
_LIVE = ("things.js", "ghost.js", "dragging.js", "command_panel.js", "live.js")
_SCRIPTS = ("data.js", *SCENE_SCRIPTS, *_PLAYER, *_LIVE, "main.js")
_STYLES = ("style.css", "stage.css", "charts.css", "panel.css", "transport.css", "layout.css", "live.css")

_COMMENT = re.compile(
    r"^[ ]*(?:/\*.*?\*/|//[^\n]*)?\n", re.DOTALL | re.MULTILINE
)  # on its own lines; and empty lines, which are removed as well

_MARK = '<script type="application/json" id="runs">'  # start of the data in a page


def replay_page(runs: Sequence[dict[str, Any]], title: str) -> str:
    """Return the page of some runs.

    Parameters
    ----------
    runs : sequence of dict
        Traces as plain values; none for a live page, which receives its run over its connection.
    title : str
        Title of the page.

    Returns
    -------
    str
        The page as HTML.
    """
    assets = resources.files("cosim.replay") / "assets"
    style, script = (
        "".join(_COMMENT.sub("", (assets / name).read_text(encoding="utf-8")) for name in names)
        for names in (_STYLES, _SCRIPTS)
    )
    # "</script" would end its element, and "<!--" with "<script" would keep it open
    data = json.dumps(list(runs), separators=(",", ":"), allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")
    return Template((assets / "page.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title),
        style=style,
        runs=data,
        script=script,
    )


def write_page(path: Path, runs: Sequence[dict[str, Any]], title: str) -> Path:
    """Write the page of some runs.

    Parameters
    ----------
    path : Path
        The file, which is written atomically.
    runs : sequence of dict
        As for `replay_page`.
    title : str
        Title of the page.

    Returns
    -------
    Path
        The file.
    """
    return write_atomic(path, replay_page(runs, title))


def is_page(path: Path) -> bool:
    """Return True if a path is a regular file with a page of this kind; a pipe, which would block, is not read."""
    return path.is_file() and _MARK in path.read_text(encoding="utf-8", errors="replace")
