"""The pictures of the documents are drawn by scripts that run."""

import re
import sys
from pathlib import Path

import pytest

from tests.cosim.replay.browser import CHROMEDRIVER, CHROMIUM

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.fixture
def draw(tmp_path, monkeypatch):
    """Return a function that runs a maker and returns the pictures that it left."""

    def run(maker):
        monkeypatch.chdir(tmp_path)
        monkeypatch.syspath_prepend(IMAGES)
        for name in ("small", maker):
            monkeypatch.delitem(sys.modules, name, raising=False)
        __import__(maker)
        sys.modules[maker].main()
        return {path.name: path for path in tmp_path.iterdir()}

    return run


def shown():
    """Return the pictures that the pages show."""
    return {name for page in PAGES for name in re.findall(r"\((?:docs/|\.\./)?images/(.*?)\)", page.read_text())}


def test_shown_pictures_and_existing_pictures_coincide():
    assert shown() == {path.name for suffix in ("png", "svg") for path in IMAGES.glob(f"*.{suffix}")}


def test_architecture_diagram_matches_the_code(draw):
    drawn = draw("architecture")["architecture.svg"].read_text()
    assert drawn == (IMAGES / "architecture.svg").read_text(), "python docs/images architecture draws it anew"


@pytest.mark.slow
@pytest.mark.parametrize("maker", ["arbiter", "criteria", "fmu"])
def test_pictures_match_their_script(maker, draw):
    from PIL import Image

    drawn = draw(maker)
    by_examples = {"fmu-reference.png"}
    assert drawn.keys() == {path.name for path in IMAGES.glob(f"{maker}-*.png")} - by_examples
    for name, path in drawn.items():
        assert path.stat().st_size < 120_000
        with Image.open(path) as fresh, Image.open(IMAGES / name) as kept:
            assert fresh.size == kept.size


@pytest.mark.slow
def test_the_paths_of_the_readme_are_figures_of_runs(draw, monkeypatch):
    # short runs stand for them, which take a minute
    from cosim.scenario import scenario

    whole = scenario.load_scenario
    monkeypatch.setattr(scenario, "load_scenario", lambda name, over: whole(name, [*over, "time.duration=0.5"]))
    assert draw("paths").keys() == {"path-plane.png", "path-deployable.png"}


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None or CHROMEDRIVER is None, reason="chromium and chromedriver are not installed")
def test_the_page_of_the_readme_is_that_of_a_run(draw):
    from PIL import Image

    drawn = draw("pages")
    assert drawn.keys() == {"replay-docking.png", "replay-inspection.png"}
    for name, path in drawn.items():
        with Image.open(path) as fresh, Image.open(IMAGES / name) as kept:
            assert fresh.size == kept.size
