"""Add an interactive replay to the site if its WebAssembly can be built, and show it on the front page.

A hook of MkDocs (`hooks` in mkdocs.yml).
"""

from __future__ import annotations

import importlib.util
import tempfile
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import Files
from mkdocs.structure.pages import Page

FRONT, NAME = "index.md", "fly.html"
_WORDS = "drag its goal and walls, change the current, fail a thruster"
# opened by the reader, as its scene takes the wheel
_PAGE = f"""

<details class="fly"><summary><b>Fly this docking run here</b>: {_WORDS}</summary>
<iframe src="{NAME}" title="Docking, flown in this page" loading="lazy"></iframe>
<a href="{NAME}">Open it as a page of its own</a></details>
"""


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Add the page below the first picture."""
    del config, files
    if page.file.src_uri != FRONT or not _can_build():
        return markdown
    above, picture, below = markdown.partition("](images/replay-docking.png)")
    return above + picture + _PAGE + below


def on_post_build(config: MkDocsConfig) -> None:
    """Simulate the run, and write its page."""
    if not _can_build():
        return
    from cosim.replay.pages import replay
    from cosim.run.run_scenario import run_scenario
    from cosim.scenario.scenario import load_scenario

    with tempfile.TemporaryDirectory() as scratch:
        run = run_scenario(load_scenario("docking"), Path(scratch, "docking"), report=False)
        replay([run.folder], Path(config.site_dir, NAME), interactive=True)


def _can_build() -> bool:
    return importlib.util.find_spec("ziglang") is not None
