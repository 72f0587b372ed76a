"""Criteria and rules of one's own in what shows a run: replay, terminal, report, exports."""

import io

import numpy as np
import pytest
from rich.console import Console

from cosim.export.excerpt import Excerpt
from cosim.export.viewer_scene import Scene
from cosim.live.watching import snapshot_table, snapshots
from cosim.replay.events import events_of
from cosim.replay.header import header_of
from cosim.replay.view_columns import ViewColumns
from cosim.report.contents import contents_of
from cosim.results.run_result import load_run
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from fuzzy_arbiter import Arbiter
from tests.cosim.scenario.test_criteria import RULES, SCENARIO

CRITERIA = [("obstacle", "#D55E00"), ("shape", "#E69F00"), ("depth", "#56B4E9"), ("visibility", "#CC79A7")]


@pytest.fixture(scope="module")
def four(shipped_run):
    return load_run(shipped_run("inspection-visibility", "time.duration=29").folder)


@pytest.fixture(scope="module")
def ruled(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rules")
    (folder / "mine.toml").write_text(RULES)
    (folder / "scenario.toml").write_text(SCENARIO)
    scenario = load_scenario(folder / "scenario.toml", ["initial.position=[6.5, 0.0, 4.2]", "time.duration=4.0"])
    return load_run(run_scenario(scenario, folder / "run", report=False).folder)


def test_header_lists_criteria_and_regions_with_colors(four):
    header = header_of(four.scenario, four.record.columns)
    assert [(one["name"], one["color"]) for one in header["criteria"]] == CRITERIA
    colors = dict(CRITERIA)
    assert [r["color"] for r in header["regions"]] == [
        "#009E73",
        *(colors[r["criterion"]] for r in header["regions"][1:]),
    ]
    assert [rule["label"] for rule in header["rules"]] == [f"R{i}" for i in range(1, 12)]
    assert "visibility pressing → α4 high" in header["rules"][-1]["words"]


def test_events_and_report_name_the_active_criterion(four):
    turns = [(event.time, event.text) for event in events_of(four, ()) if event.kind == "active"]
    assert [text for _, text in turns] == [
        "Gives way to view (visibility)", "Gives way to pillar (obstacle)", "Goes for the goal again",
        "Gives way to pillar (obstacle)", "Goes for the goal again", "Gives way to view (visibility)",
    ]  # fmt: skip
    table = contents_of(four)["criteria"]
    assert [row[0] for row in table.rows] == [f"{i + 1} {name}" for i, (name, _) in enumerate(CRITERIA)]
    obstacle, shape, _, visibility = table.rows
    assert obstacle[1] == "within 0.3 m or rad; approach time: 1 at 1 s, 0 at 3 s" and shape[2] == "never"
    assert visibility[1] == "clearance: 1 at -0.4 m, 0 at 0.1 m"
    assert visibility[3].startswith(f"{turns[0][0]:.2f} to {turns[1][0]:.2f} (view), {turns[5][0]:.2f} to ")
    weights = np.column_stack([four.record[f"weight.{name}"] for name, _ in CRITERIA])
    costs = {row[0].split()[-1]: row[-1] for row in table.rows}  # 5^(2 share - 1) times 2 m, of three with soft regions
    assert costs == {"obstacle": "–", "shape": "10", "depth": "2", "visibility": "0.4"}
    led = (weights.argmax(axis=1) == 0) & (weights[:, 0] >= 0.005)  # below, it is shown as 0.00
    assert float(obstacle[2]) == pytest.approx(led.sum() * 0.01, abs=0.2)  # turns that are back at once do not count


def test_terminal_view_lists_all_criteria(four):
    *_, last = snapshots(str(four.folder), rate=None)
    console = Console(file=io.StringIO(), width=80, height=40)
    console.print(snapshot_table(last))
    shown = console.file.getvalue()
    for name, _ in CRITERIA:
        weight, asks = (four.record[f"{of}.{name}"][-1] for of in ("weight", "membership"))
        assert f" weight {weight:4.2f}, membership {asks:4.2f}" in next(
            line for line in shown.splitlines() if line.startswith(name[:12])
        )


def test_exported_solids_use_criterion_colors(four):
    everything = tuple(range(len(four.record.columns)))
    colors = [solid.color for solid in Scene(Excerpt(four, everything, 1, None)).solids]
    assert colors[-1] == (0xCC, 0x79, 0xA7)


def test_rules_of_an_arbiter_file_match_its_explanation(ruled):
    viewing = ViewColumns(ruled.scenario, ruled.record.columns)
    names = [column.name for column in viewing.columns]
    rows = viewing.compute_rows(ruled.record.stack([ruled.record.columns[i].name for i in viewing.picked]))
    arbiter = Arbiter(ruled.scenario.rules.system)
    inputs = [names.index(f"arbiter.{signal.name}") for signal in ruled.scenario.rules.inputs]
    fired = [names.index(f"rule.R{i}") for i in range(1, 5)]
    for row in rows[::40]:
        explained = [rule.strength for rule in arbiter.explain(row[inputs].tolist()).rules]
        assert row[fired].tolist() == pytest.approx(explained, abs=1e-15)
    assert contents_of(ruled)["arbiter"].startswith("closed; the rules of mine.toml, of distance (clearance.mooring), ")
