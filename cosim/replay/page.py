"""The page of one or several runs: one self-contained HTML file."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from cosim.io.atomic_file import write_atomic
from plant_fmu.contents.html_templates import make_environment

SCENE_SCRIPTS = (
    "vectors.js", "palette.js", "elements.js", "camera.js", "solids.js", "planes.js", "painter.js", "sights.js",
    "hull.js", "vehicle.js", "forces.js", "trail.js", "shadows.js", "bounds.js", "order.js",
    "regions.js", "labels.js", "water.js", "floor.js", "controls.js", "scene.js",
)  # fmt: skip
_PLAYER = (
    "player.js", "words.js", "curves.js", "axes.js", "plot.js", "charts.js", "board.js", "timeline.js", "panel.js",
    "stage.js", "head.js", "keys.js", "page.js",
)  # fmt: skip
_LIVE = ("things.js", "ghost.js", "dragging.js", "fields.js", "command_panel.js", "live.js")
_FLYING = ("flight.js", "outcome.js", "saving.js", "what_if_panel.js", "what_if.js")
_SCRIPTS = ("data.js", *SCENE_SCRIPTS, *_PLAYER, *_LIVE, *_FLYING, "main.js")
_WORKER = "flight_worker.js"
_STYLES = ("style.css", "stage.css", "charts.css", "panel.css", "transport.css", "layout.css", "live.css")

_COMMENT = re.compile(
    r"^[ ]*(?:/\*.*?\*/|//[^\n]*)?\n", re.DOTALL | re.MULTILINE
)  # on its own lines; and empty lines, which are removed as well

_MARK = '<script type="application/json" id="runs">'  # start of the data in a page


def replay_page(runs: Sequence[dict[str, Any]], title: str, flight: dict[str, Any] | None = None) -> str:
    """Return the page of some runs."""
    assets = resources.files("cosim.replay") / "assets"
    style, script = (
        "".join(_COMMENT.sub("", (assets / name).read_text(encoding="utf-8")) for name in names)
        for names in (_STYLES, _SCRIPTS)
    )
    worker = _COMMENT.sub("", (assets / _WORKER).read_text(encoding="utf-8")) if flight else ""
    template = make_environment().get_template("cosim.replay/assets/page.html.j2")
    data = {"runs": _embed_json(list(runs)), "flight": _embed_json(flight)}
    return template.render(title=title, style=style, worker=worker, script=script, **data)


def _embed_json(data: Any) -> str:
    """Format data as JSON for a script element, with every "<" escaped: "</script" or "<!--" would change its end."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
    return text.replace("<", "\\u003c")


def write_page(path: Path, runs: Sequence[dict[str, Any]], title: str, flight: dict[str, Any] | None = None) -> Path:
    """Write the page of some runs."""
    return write_atomic(path, replay_page(runs, title, flight))


def is_page(path: Path) -> bool:
    """Return True if a path is a regular file with a page of this kind; a pipe, which would block, is not read."""
    return path.is_file() and _MARK in path.read_text(encoding="utf-8", errors="replace")
