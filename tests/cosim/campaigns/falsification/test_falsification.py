"""``cosim falsify``: from its flags to a folder with reproducible rows."""

import json
import re
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest

from cosim.campaigns.campaign import run_campaign
from cosim.campaigns.falsification import falsification as module
from cosim.campaigns.falsification.falsification import costs_of, run_falsification
from cosim.campaigns.falsification.search_work import ScenarioSearch, SceneSearch, SearchSettings
from cosim.campaigns.pages.falsification_page import write_falsification_page
from cosim.campaigns.rerun import rerun
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import Score
from cosim.campaigns.scenes.generator import generate_scenes
from cosim.campaigns.scenes.law_gains import gains_from
from cosim.campaigns.scenes.scene_rows import refused_row, row_of, table_of
from cosim.campaigns.scenes.scene_work import SceneTask
from cosim.campaigns.store.folder import PARTS
from cosim.campaigns.sweeps.design import vary_from
from cosim.command_line.cli import main
from cosim.scenario.scenario import load_scenario
from tests.cosim.campaigns.fake import Choosy, fakes
from tests.cosim.campaigns.scene_data import BRIEF, interrupt_after, rows
from tests.cosim.campaigns.test_pages import check, runs_of

__all__ = ["fakes"]

pytest.importorskip("cma")
NEARING = Conditions(duration=12.0)  # long enough to come near to obstacles


def search(budget=40, conditions=BRIEF, family="plain", **settings):
    task = SceneTask("pd", gains_from("pd"), conditions)
    return SceneSearch(family, task, SearchSettings(budget=budget, **settings))


def varied(objective="clearance", budget=30):
    scenario = load_scenario("paper", ["arbiter.engine=closed", "time.duration=0.3", "sensing.position_noise=0.02"])
    vary = vary_from(["initial.position.1=-2:2", "regions.SR1.gain=500:5000:log", "limit.force=400,800"])
    return ScenarioSearch(scenario, vary, SearchSettings(objective, budget))


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Return a search whose scenes last long enough to approach an obstacle."""
    return run_falsification(search(60, NEARING), tmp_path_factory.mktemp("found") / "out")


@pytest.mark.medium
def test_search_finds_worse_scenes_than_random_sampling(found):
    s = found.summary
    assert found.flown == s["flown"] == s["random"]["flown"] == 60
    assert s["worst"][0]["cost"] == found.results["min_clearance"].min() < s["random"]["worst"][0]["cost"]
    dice = pq.read_table(found.folder / "random" / "results.parquet")
    made = [json.loads(line)["goal"]["centre"] for line in generate_scenes(60)]
    assert [json.loads(line)["goal"]["centre"] for line in dice["scene"].to_pylist()] == made
    for part, results in ((s, found.results), (s["random"], None)):
        clearance = results["min_clearance"] if results else dice["min_clearance"].to_numpy()
        least = [clearance[:flights].min() for flights, _ in part["best"]]
        assert least == [cost for _, cost in part["best"]] and least == sorted(least, reverse=True)


@pytest.mark.medium
def test_page_shows_search_random_and_worst_replays(found):
    page = check(write_falsification_page(found.folder, 1))
    worst, dice = found.summary["worst"], found.summary["random"]["worst"]
    assert page.asked == [f"worst/{worst[0]['row']}/replay.html"]
    listed = [row for row in page.rows if row[-1].startswith("cosim rerun")]
    assert [(int(row[0]), int(row[2])) for row in listed] == [
        (one["row"], other["row"]) for one, other in zip(worst, dice, strict=False)
    ]
    assert [path.name for path in (found.folder / "figures").iterdir()] == ["convergence.svg"]
    (run,) = runs_of(found.folder / page.asked[0])
    assert run["status"] == "completed"


@pytest.mark.medium
def test_page_says_when_every_flight_was_refused(tmp_path, fakes, monkeypatch):
    monkeypatch.setattr(Choosy, "refused_above", -9.0)
    fakes(Choosy)
    campaign = run_falsification(varied(), tmp_path / "out")
    assert campaign.summary["refused"] == len(campaign.results) and campaign.summary["worst"] == []
    page = write_falsification_page(tmp_path / "out", 1)
    assert check(page).asked == [] and "30 could not be flown" in page.read_text()


@pytest.mark.medium
def test_falsification_rows_are_reproducible(found, tmp_path):
    key = found.summary["worst"][0]["row"]
    again = rerun(found.folder, key, tmp_path / "run")
    assert again.differing == {} and again.apart == {} and again.run is not None
    key = found.summary["random"]["worst"][0]["row"]
    assert rerun(found.folder / "random", key, tmp_path / "dice").differing == {}


@pytest.mark.medium
def test_scenario_rows_are_reproducible_with_the_found_values(tmp_path):
    campaign = run_falsification(varied(), tmp_path / "out")
    first, last = campaign.results.table.to_pylist()[0], campaign.results.table.to_pylist()[-1]
    assert -2.0 <= last["initial.position.1"] <= 2.0 and last["limit.force"] in (400.0, 800.0)
    assert first["initial.position.1"] != last["initial.position.1"]
    again = rerun(tmp_path / "out", 29, tmp_path / "run")
    assert again.differing == {} and again.apart == {}
    assert check(write_falsification_page(tmp_path / "out", 0)).asked == []


@pytest.mark.parametrize("make", [search, varied])
@pytest.mark.slow
def test_resumed_search_gives_the_same_rows(make, tmp_path, monkeypatch):
    whole = run_falsification(make(), tmp_path / "whole")
    with monkeypatch.context() as patch:
        interrupt_after(patch, 3)
        with pytest.raises(KeyboardInterrupt):
            run_falsification(make(), tmp_path / "out")
    assert (tmp_path / "out" / PARTS).exists()
    rest = run_falsification(make(), tmp_path / "out")
    assert 0 < rest.flown < len(whole.results) and rows(rest.results) == rows(whole.results)
    again = run_falsification(make(), tmp_path / "out")
    assert again.flown == 0 and again.summary == rest.summary
    assert not (tmp_path / "out" / PARTS).exists()


@pytest.mark.slow
def test_rows_are_the_same_for_any_number_of_workers(tmp_path):
    one, two = (run_falsification(search(), tmp_path / str(n), workers=n) for n in (1, 2))
    assert rows(one.results) == rows(two.results)


@pytest.mark.slow
def test_failure_rate_is_estimated_by_multilevel_splitting(tmp_path):
    campaign = run_falsification(search(200, Conditions(duration=8.0), rare_event=True), tmp_path / "out")
    estimate = campaign.summary["estimate"]
    assert 100 < campaign.flown == len(campaign.results) <= 200
    # so few flights may leave copies of one alone, which bound nothing from above
    assert 0.0 <= estimate["low"] <= estimate["probability"] < estimate["high"] <= 1.0
    assert campaign.summary["random"] is None and not (tmp_path / "out" / "random").exists()
    page = check(write_falsification_page(tmp_path / "out", 0))
    assert sum(row[1].count("e-") == 1 for row in page.rows if len(row) == 2) >= len(estimate["levels"]) - 1
    assert run_falsification(search(200, Conditions(duration=8.0), rare_event=True), tmp_path / "out").flown == 0


@pytest.mark.slow
def test_large_failure_rate_equals_monte_carlo(tmp_path):
    """A barrier that is off has a violation in some per cent of plain scenes."""
    task = SceneTask("unarbitrated", gains_from("unarbitrated"), Conditions(duration=40.0))
    settings = SearchSettings(budget=1000, rare_event=True)
    estimate = run_falsification(SceneSearch("plain", task, settings), tmp_path / "rate").summary["estimate"]
    (tmp_path / "s.jsonl").write_text("\n".join(generate_scenes(1000, 5000)))
    campaign = run_campaign(tmp_path / "s.jsonl", "unarbitrated", tmp_path / "dice", task.conditions)
    counted = campaign.summary["rates"]["violation"]
    assert max(estimate["low"], counted["low"]) < min(estimate["high"], counted["high"])


def test_costs_rank_outcomes_by_severity():
    def row(seed, clearance, time, stopped=-1, weighted=0.0):
        score = Score(np.isfinite(time), time, clearance, 1.0, 1.0, 1e-3, stopped, weighted_violation=weighted)
        return row_of(seed, score, 0.01)

    rows = row(0, 0.3, 20.0), row(1, -0.1, 30.0, -1, 2.0), row(2, 0.2, np.inf), row(3, 0.5, np.inf, 7, 0.1)
    table = table_of([*rows, refused_row(4, "no")])
    for objective, costs in {
        "clearance": [0.3, -0.1, 0.2, module._STOPPED],
        "arrival": [-20.0, -30.0, -120.0, -120.0],
        "violation": [0.0, -2.0, 0.0, -0.1],
    }.items():
        assert costs_of(table, objective, 120.0).tolist() == [*costs, module._REFUSED], objective


@pytest.mark.medium
def test_similar_rows_are_listed_once(found):
    points = np.tile(np.linspace(0.0, 1.0, 60)[:, None], 3)
    costs = np.linspace(1.0, 0.0, 60)
    listed = module._worst(found.folder, found.results, costs, points)
    assert [one["row"] for one in listed] == [59, 53, 47, 41, 35, 29, 23, 17, 11, 5]
    assert len(module._worst(found.folder, found.results, np.full(60, module._REFUSED), points)) == 0


def test_without_cma_no_run_starts(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "cma", None)
    assert main(["falsify", "plain", "--law", "pd", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert re.search(r"a search needs cma \(the extra falsify\); .* install .*cma>=", said) and said.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.medium
def test_command_prints_the_search_result(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("cosim.campaigns.scenes.conditions.Conditions.duration", 0.4)
    words = ["falsify", "hard", "--law", "pd", "--budget", "20", "--replays", "0", "--out", str(tmp_path / "out")]
    for lines in (4, 5):
        assert main(words) == 0
        said = capsys.readouterr().out.splitlines()
        assert len(said) == lines and said[-1] == str(tmp_path / "out" / "falsification.html")
        assert said[-4].startswith("search: 20 flights, ") and said[-3].startswith("random: 20 flights, ")
    assert said[0] == f"{tmp_path / 'out'}: was complete already"
