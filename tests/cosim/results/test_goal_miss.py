"""Why a goal was missed, which thrusters a law isolated, and how many samples it rejected: one text everywhere."""

import json

import numpy as np
import pytest

from cosim.command_line.cli import main
from cosim.replay.events import events_of
from cosim.results.law_reports import Isolations
from cosim.results.run_result import load_run
from cosim.results.wording import verdict

SCENARIO = """
vehicle = "odin"
[time]
duration = {duration}
step = 0.02
[plant]
current = [{current}, 0.0, 0.0]
substep = 0.02
[initial]
position = [0.0, 0.0, 2.0]
[goal]
type = "sphere"
center = [{goal}, 0.0, 2.0]
radius = 0.5
[law]
name = "deployable"
[actuation]
through = "thrusters"
[arbiter]
engine = "closed"
"""
REGION = """
[[regions]]
name = "{name}"
criterion = "obstacle"
keep = "{keep}"
hard = {hard}
gain = 100.0
shape = {shape}
"""
SENSING = "[sensing]\nposition_noise = 0.02\nvelocity_noise = 0.01\n"
WEAK = "[law.gains]\nacceleration = 0.001\nvelocity_bandwidth = 0.01\n"
BALL = '{ type = "sphere", center = [3.0, 0.0, 2.0], radius = 1.0 }'
WALL = '{ type = "half_space", point = [1.5, 0.0, 0.0], normal = [1.0, 0.0, 0.0] }'


@pytest.fixture
def ran(tmp_path, capsys):
    """Return a function that runs a scenario by the command line, and returns the run and what was printed."""

    def run(text, duration=20.0, current=0.0, goal=3.0):
        file, out = tmp_path / "scene.toml", tmp_path / "run"
        file.write_text(SCENARIO.format(duration=duration, current=current, goal=goal) + text)
        assert main(["run", str(file), "--out", str(out), "--no-report"]) == 0
        return load_run(out), capsys.readouterr().out

    return run


@pytest.mark.medium
@pytest.mark.parametrize(
    ("text", "changes", "words"),
    [
        (REGION.format(name="rock", keep="out", hard="true", shape=BALL), {}, "The goal was blocked: 0."),
        (REGION.format(name="wall", keep="in", hard="true", shape=WALL), {}, "stopped before the hard region wall"),
        ("", {"duration": 0.4}, "m from the goal, had 0.4 s."),
        ("", {"duration": 6.0, "goal": 6.0}, "The time was too short: the vehicle, "),
        ("", {"duration": 14.0, "goal": 3.0}, "The time was too short: the vehicle was in the goal for the last "),
        ("", {"current": -1.3}, "The thrust was not enough: "),
        ("", {"current": -1.6}, "The thrust was not enough: "),
        (WEAK, {"current": -1.0, "goal": 6.0, "duration": 14.0}, "The vehicle was adrift: 8."),
        ("[sensing]\ndead_from = 1.0\ndead_for = 99.0\n", {"goal": 9.0}, "the law had no measurement for the last 19."),
    ],
    ids=["covered", "wall", "shortest", "short", "late", "current", "strong current", "weak gains", "blind"],
)
def test_missed_goal_has_its_cause_in_console_summary_and_events(ran, text, changes, words):
    run, printed = ran(text, **changes)
    miss = json.loads((run.folder / "summary.json").read_text())["goal_miss"]
    assert words in miss and miss.endswith("`cosim check FILE` looks for a way into the goal and for enough thrust.")
    assert miss in printed and verdict(run.summary) in printed
    *_, event, end = events_of(run, [])
    assert (event.kind, event.time, event.text) == ("goal", end.time, f"Misses the goal. {miss}")


@pytest.mark.medium
def test_isolated_thruster_is_reported_once_in_the_same_words(ran):
    run, printed = ran(SENSING + "[[failures]]\nthruster = 6\ntime = 4.0\n", duration=28.0, goal=12.0)
    (isolation,) = run.summary["isolations"]
    assert isolation["thruster"] == 6 and 4.0 < isolation["time"] < 18.0 and run.summary["goal_miss"] is None
    assert f"It isolated thruster 6 at {isolation['time']:.2f} s." in printed
    texts = {event.text: event.time for event in events_of(run, [])}
    assert texts["The law isolates thruster 6"] == isolation["time"]


@pytest.mark.medium
def test_settled_run_rejects_nothing_and_misses_nothing(ran):
    run, printed = ran(SENSING, duration=25.0)
    assert run.summary["rejected_samples"] == 0.0 and run.summary["isolations"] == []
    assert run.summary["goal_miss"] is None and "isolated" not in printed and "rejected" not in printed


def test_isolations_are_found_across_blocks_with_those_that_are_used_again():
    signal, changes = np.array([0, 0, 3, 3, 5, 5, 3, 0, 5, np.nan]), []
    for cut in range(len(signal)):
        isolations = Isolations()
        for part in (slice(0, cut), slice(cut, None)):
            isolations.add(np.arange(10.0)[part], signal[part])
        changes.append(isolations.changes)
    expected = [(2.0, 3, True), (4.0, 5, True), (6.0, 5, False), (7.0, 3, False), (8.0, 5, True)]
    assert all(found == expected for found in changes)
