"""Numbers as text: what is no number is said so, wherever a page shows it."""

import math
import re

import pytest

from cosim.report.web_page import number
from cosim.results.wording import format_force, format_number, verdict
from tests.cosim.replay.test_solids import ASSETS, pytestmark, run  # noqa: F401

NOT_SHOWN = re.compile(r"NaN|Infinity|undefined|null|\bnan\b|\binf\b")
SCRIPTS = ("vectors.js", "data.js", "words.js", "axes.js", "floor.js", "outcome.js")
EACH = """
const numbers = [NaN, Infinity, -Infinity, null, undefined, -0, -0.00004, 0.5, 12345.678, -99.99];
const formats = {
  decimals: (x) => decimals(x, 2), figure, clock, meters: (x) => meters(x, 0.1), shortNumber,
  quantity: (x) => ["m", "rad", "rad/s", "N.m", ""].map((unit) => quantity(x, unit)).join(" "),
  reading: (x) => ["m", "rad", ""].map((unit) => reading(x, unit)).join(" "),
  clearanceWords: (x) => [null, "obstacle"].map((criterion) => clearanceWords(x, { criterion, unit: "m" })).join(" "),
  currentWords: (x) => currentWords([x, 0.1, x]), tickTexts: (x) => tickTexts([x, 1]).join(" "),
};
return Object.entries(formats).flatMap(([name, format]) => numbers.map((x) => [name, String(x), format(x)]));
"""
OUTCOME = """
const column = (values) => Float64Array.from(values, (x) => x ?? NaN);
const regions = [{ name: "goal", places }, { name: "wall", unit: "m", criterion: "obstacle", hard: true }];
const columns = { time: column([0, 1]), "goal.place": column([0, at]), "wall.clearance": column([null, null]) };
columns.active = column([0, 0]);
const header = { regions, signals: Object.keys(columns).map((name) => ({ name })) };
const metrics = new Float64Array(20).fill(-1);
metrics[5] = -Infinity;
const data = { step: 0.1, settled_for: 10 };
return outcomeOf(data, { metrics, said: "" }, new Run(header, Object.values(columns)), null).verdict;
"""


def test_every_formatter_of_the_pages_says_what_is_no_number():
    for name, given, text in run(EACH, SCRIPTS):
        assert not NOT_SHOWN.search(text), (name, given, text)
        assert "-" not in text or name == "shortNumber", (name, given, text)  # the minus sign is U+2212


def test_no_script_formats_numbers_for_readers_by_itself():
    """Texts of `toFixed` are for attributes, styles and files; readers get those of `decimals`."""
    for script in ASSETS.glob("*.js"):
        for line in script.read_text(encoding="utf-8").splitlines():
            uses = line.count(".toFixed(")
            rounded = len(re.findall(r"Number\([^`]*?\.toFixed\(", line))
            own = (
                any(mark in line for mark in ("style.", "setProperty", "function tomlNumber"))
                or script.name == "saving.js"
            )
            assert uses == rounded or own or script.name == "words.js", (script.name, line)


@pytest.mark.parametrize(
    ("places", "at", "said"),
    [(None, 0, "how near it came is not recorded"), ([[0] * 3] * 3, 1, "reached 1 of 3 goals in turn")],
)
def test_verdict_of_a_flight_without_a_distance_to_its_goal(places, at, said):
    text = run(OUTCOME, SCRIPTS, places=places, at=at)
    assert said in text and not NOT_SHOWN.search(text)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_python_formatters_say_what_is_no_number(value):
    summary = {
        "has_goal": True, "settled": False, "reached": False, "closest_to_goal": value,
        "min_clearance": {"wall": value}, "hard": ["wall"], "hard_violated": [], "violated_at_start": [],
        "clearance_unit": {"wall": "m"},
        "status": "completed", "max_force_asked": value, "max_force": value, "simulated_time": 1.0,
        "above_surface": [], "time_above_surface": 0.0, "isolations": [], "rejected_samples": 0.0,
        "drag_ratio": None, "goal_miss": None,
    }  # fmt: skip
    assert number(value) == number(None) == "–" and format_number(value, 3) == format_force(value) == "no number"
    assert not NOT_SHOWN.search(verdict(summary | {"min_clearance": {"wall": math.nan}}))
    said = verdict(summary | {"min_clearance": {}, "goals": {"reached": 1, "of": 3}})
    assert said.startswith("The vehicle reached 1 of 3 goals in turn; ")
