"""External names and texts in pages and pictures are escaped, never executed."""

import html.parser
import json
import re
import tomllib
from pathlib import Path

import pytest
import tomli_w

from cosim.replay.page import replay_page
from cosim.results.run_result import load_run
from cosim.run.run_folder import report_again
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from fuzzy_arbiter.__main__ import main as fuzzy_main
from plant_fmu import load_vehicle
from plant_fmu.contents.page import page
from plant_fmu.pictures import PICTURES, image
from tests.cosim.replay.browser import CHROMEDRIVER, CHROMIUM, Browser

ROOT = Path(__file__).parents[2]
ATTACK = (
    r"""</script></title><img src=x onerror="window.harmed=1"><svg onload='window.harmed=1'><!-- $\frac{$ &lt;b&gt;"""
)
PLAIN = "Something to read"
HOSTILE = '</script><script>alert("1")</script><!-- & "quoted" \'too\' \\ \u2028 Wrack-Öffnung 海底 $title'


class Elements(html.parser.HTMLParser):
    """What elements a page has, with the names of their attributes, and what stands in its scripts."""

    def __init__(self, text):
        super().__init__()
        self.found, self.scripts, self.title = [], [], ""
        self._in = ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, tuple(name for name, _ in attributes)))
        self._in = tag

    def handle_endtag(self, tag):
        self._in = ""

    def handle_data(self, data):
        if self._in == "script":
            self.scripts.append(data)
        elif self._in == "title":
            self.title += data


def runs_of(tmp_path_factory, title):
    """Return the folder of a run, with a title in all places that take one."""
    folder = tmp_path_factory.mktemp("pages")
    table = tomllib.loads((ROOT / "plant_fmu/vehicles/odin.toml").read_text(encoding="utf-8"))
    vehicle = folder / "boat.toml"
    vehicle.write_text(tomli_w.dumps(table | {"title": title, "source": title}), encoding="utf-8")
    scenario = folder / "it.toml"
    scenario.write_text(f"base = 'paper'\ntitle = {json.dumps(title)}\nvehicle = 'boat.toml'\n", encoding="utf-8")
    run_scenario(load_scenario(scenario, ["time.duration=0.2"]), folder / "run")
    return folder / "run"


@pytest.fixture(scope="module")
def attacked(tmp_path_factory):
    return runs_of(tmp_path_factory, ATTACK)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return runs_of(tmp_path_factory, PLAIN)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["report.html", "replay.html"])
def test_a_title_adds_no_element(attacked, plain, name):
    texts = [(folder / name).read_text(encoding="utf-8") for folder in (attacked, plain)]
    ours, theirs = (Elements(text) for text in texts)
    assert ours.found == theirs.found and len(ours.found) > 50
    assert "window.harmed" in texts[0]
    assert not any(name.startswith("on") for _, names in ours.found for name in names)


@pytest.mark.medium
def test_the_data_of_a_page_stay_in_their_script(attacked):
    """A reader of HTML finds the data whole: nothing within them ends the element that they stand in."""
    (data,) = (s for s in Elements((attacked / "replay.html").read_text(encoding="utf-8")).scripts if s[:2] == "[{")
    assert "<" not in data
    assert ATTACK in json.dumps(json.loads(data)).encode().decode("unicode_escape")


@pytest.mark.parametrize("text", [HOSTILE, "<!--<script>", "</ScRiPt >", "\u2028\u2029", "\\u003c/script>", "]]>"])
def test_texts_of_a_run_do_not_end_the_script(text):
    """A scenario's file may not have such names, but whoever makes one in Python may."""
    ours, plain = (Elements(replay_page([{"name": said, said: [said]}], said)) for said in (text, PLAIN))
    assert ours.found == plain.found and ours.title == text
    assert json.loads(ours.scripts[0]) == [{"name": text, text: [text]}]


@pytest.mark.slow
def test_printable_pages_accept_any_title(attacked):
    _, files = report_again(attacked, ("html", "png"))
    assert files
    assert load_run(attacked).scenario.title == f"{ATTACK} (changed: time.duration = 0.2 s)"


@pytest.mark.medium
def test_page_within_an_fmu_is_escaped(tmp_path, attacked):
    vehicle = load_vehicle(attacked / "vehicle.toml")
    ours, plain = (Elements(page(v, 3)).found for v in (vehicle, load_vehicle("odin")))
    assert ours == plain


@pytest.mark.medium
@pytest.mark.parametrize("kind", PICTURES)
def test_vehicle_pictures_escape_any_title(attacked, kind):
    svg = image(PICTURES[kind](load_vehicle(attacked / "vehicle.toml")), "svg").decode()
    assert "<img" not in svg and "<script" not in svg


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("kind", ["terms", "profile", "surface", "decisions"])
def test_arbiter_pictures_escape_any_name(tmp_path, kind):
    name = r"<img src=x onerror='harm()'>$\frac{$"
    variable = {"name": name, "universe": [0, 1], "terms": {name: [[0, 1], [1, 0]], "b": [[0, 0], [1, 1]]}}
    table = {
        "inputs": [variable, variable | {"name": "y"}],
        "outputs": [variable | {"name": f"{name} {i}"} for i in (1, 2)],
        "rules": [f'if "{name}" is "{name}" then "{name} {i}" is "{name}"' for i in (1, 2)]
        + [f'if y is b then "{name} {i}" is b' for i in (1, 2)],
    }
    (tmp_path / "it.json").write_text(json.dumps(table))
    assert fuzzy_main(["plot", str(tmp_path / "it.json"), kind, "--out", str(tmp_path / "it.svg")]) == 0
    svg = (tmp_path / "it.svg").read_text()
    assert "<img" not in svg and "<svg onload" not in svg


def test_scripts_never_create_elements_from_text():
    banned = re.compile(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function|srcdoc|on\w+=")
    files = [path for package in ("cosim", "plant_fmu") for path in (ROOT / package).rglob("*.js")]
    assert len(files) > 20
    for path in files:
        assert not banned.search(path.read_text(encoding="utf-8")), path


@pytest.mark.slow
@pytest.mark.skipif(not (CHROMIUM and CHROMEDRIVER), reason="chromium and chromedriver are not installed")
def test_injected_text_runs_no_script_in_a_browser(attacked, tmp_path):
    pytest.importorskip("selenium")
    browser = Browser(tmp_path / "profile")
    try:
        browser.open(attacked / "replay.html")
        assert browser.js("return window.harmed === undefined && document.images.length === 0")
        assert ATTACK in browser.js("return document.title + document.body.textContent")
        browser.driver.get((attacked / "report.html").as_uri())
        assert browser.js("return window.harmed === undefined && document.images.length === 0")
    finally:
        browser.driver.quit()
