"""The page of one or several runs: one HTML file that needs nothing else."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

REPLAY = "replay.html"

_SCRIPTS = ("data.js", "camera.js", "solids.js", "scene.js", "charts.js", "words.js", "player.js", "live.js", "main.js")


_MARK = '<script type="application/json" id="runs">'  # where the data of a page begins


def replay_page(runs: Sequence[dict[str, Any]], title: str) -> str:
    """Return the page of some runs.

    Parameters
    ----------
    runs : sequence of dict
        Traces as JSON knows them; none for a live page, which is told of its run over its connection.
    title : str
        Of the page.

    Returns
    -------
    str
        HTML.
    """
    assets = resources.files("cosim.replay") / "assets"
    script = "\n".join((assets / name).read_text(encoding="utf-8") for name in _SCRIPTS)
    # "</" would end the element it stands in
    data = json.dumps(list(runs), separators=(",", ":"), allow_nan=False, ensure_ascii=False).replace("</", "<\\/")
    return Template((assets / "page.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title),
        style=(assets / "style.css").read_text(encoding="utf-8"),
        runs=data,
        script=script,
    )


def write_page(path: Path, runs: Sequence[dict[str, Any]], title: str) -> Path:
    """Write the page of some runs.

    Parameters
    ----------
    path : Path
        The file; it appears only when it is whole.
    runs : sequence of dict
        As for `replay_page`.
    title : str
        Of the page.

    Returns
    -------
    Path
        The file.
    """
    scratch = path.with_name(f".{path.name}")
    try:
        scratch.write_text(replay_page(runs, title), encoding="utf-8")
        return scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)


def is_page(path: Path) -> bool:
    """Return whether a file is a page of this kind."""
    return _MARK in path.read_text(encoding="utf-8", errors="replace")
