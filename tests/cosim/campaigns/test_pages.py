"""Pages of campaigns, sweeps and comparisons: complete, self-contained, reproducible, with worst replays."""

import json
import re
import shutil
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from cosim.campaigns.analysis.statistics import quantiles
from cosim.campaigns.campaign import run_campaign
from cosim.campaigns.comparison import compare
from cosim.campaigns.pages.campaign_figures import cumulative_fractions, distributions
from cosim.campaigns.pages.campaign_page import write_campaign_page
from cosim.campaigns.pages.comparison_page import write_comparison_page
from cosim.campaigns.pages.sections import SECTIONS
from cosim.campaigns.pages.sweep_page import write_sweep_page
from cosim.campaigns.parameter_sweep import run_sweep
from cosim.command_line.cli import main
from cosim.errors import RunError
from cosim.report.web_page import number
from tests.cosim.campaigns.fake import Choosy, design, fakes, paper
from tests.cosim.campaigns.scene_data import BRIEF, HARD, PLAIN, write
from tests.cosim.campaigns.test_comparison import idle
from tests.page_checker import Checker
from tests.security.test_pages import Elements

__all__ = ["fakes", "idle"]

REFUSED = PLAIN[2] | {"seed": 7, "weight_minus_buoyancy": 1e6}


def check(page):
    """Return a page that needs nothing but the files beside it."""
    checker = Checker(page.read_text())
    assert all((page.parent / link).exists() for link in checker.asked), checker.asked
    for svg in (page.parent / "figures").glob("*.svg"):
        ET.parse(svg)
    return checker


def without_wall(text):
    return re.sub('<span class="wall">.*?</span>', "", text)


def runs_of(replay):
    data = re.search(r'<script type="application/json" id="runs">(.*?)</script>', replay.read_text(), re.S)
    return json.loads(data.group(1))


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Return the folder of a campaign of two kinds of scenes and a refused one, with its page and a replay."""
    folder = tmp_path_factory.mktemp("flown")
    run_campaign(write(folder / "s.jsonl", [*PLAIN[:4], *HARD[4:], REFUSED]), "ismail_dunnigan", folder / "out", BRIEF)
    write_campaign_page(folder / "out", 1)
    return folder / "out"


@pytest.mark.medium
def test_campaign_page_is_complete_and_matches_the_summary(flown):
    checker = check(flown / "campaign.html")
    s = json.loads((flown / "summary.json").read_text())
    worst = s["worst"][0]
    assert checker.asked == [f"worst/{worst['row']}/replay.html"]
    rate = s["rates"]["violation"]
    told = f"{100 * rate['share']:.1f}\N{NO-BREAK SPACE}% ({100 * rate['low']:.1f} to {100 * rate['high']:.1f})"
    assert next(row for row in checker.rows if row[0] == "all")[-1] == told
    assert {row[0] for row in checker.rows} >= {"plain", "drift, noise, failure"}
    assert ["7", s["reasons"]["7"]] in checker.rows and "weight_minus_buoyancy" in s["reasons"]["7"]
    assert [w["row"] for w in s["worst"]] == [
        int(row[0]) for row in checker.rows if len(row) == 5 and "cosim" in row[4]
    ]
    names = {p.stem for p in (flown / "figures").iterdir()}
    assert names == {"rates", "distributions", "depends", "clearances"}


@pytest.mark.medium
def test_a_replay_shows_the_flight_of_the_row(flown):
    key = json.loads((flown / "summary.json").read_text())["worst"][0]["row"]
    (run,) = runs_of(flown / "worst" / str(key) / "replay.html")
    assert run["name"] == f"ismail_dunnigan-scene-{key}" and run["duration"] == BRIEF.duration
    assert run["status"] == "completed"


@pytest.mark.slow
def test_rewritten_page_is_identical_without_new_runs(flown, monkeypatch):
    before = (flown / "campaign.html").read_bytes()
    monkeypatch.setattr("cosim.campaigns.pages.replays.run_scenario", None)
    write_campaign_page(flown, 1)
    assert (flown / "campaign.html").read_bytes() == before
    assert not [p.name for p in flown.rglob(".*") if p.name != ".lock"]


@pytest.mark.slow
def test_page_is_identical_between_processes(tmp_path, monkeypatch):
    pages = []
    for name, workers in (("one", 1), ("two", 2)):
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        write(tmp_path / name / "s.jsonl", [*PLAIN[:3], *HARD[3:]])
        words = ["--law", "ismail_dunnigan", "--out", "out", "--workers", str(workers), "--replays", "1"]
        assert main(["campaign", "s.jsonl", *words]) == 0
        pages.append(without_wall((tmp_path / name / "out" / "campaign.html").read_text()))
    assert pages[0] == pages[1] and "replay" in pages[0]


@pytest.mark.slow
def test_ctrl_c_during_replays_leaves_a_page_without_them(tmp_path, monkeypatch):
    out = tmp_path / "out"
    run_campaign(write(tmp_path / "s.jsonl", PLAIN[:2]), "ismail_dunnigan", out, BRIEF)
    with monkeypatch.context() as patch:
        patch.setattr("cosim.run.run_scenario.Master.run", lambda *_, **__: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            write_campaign_page(out, 2)
    assert check(out / "campaign.html").asked == [] and list((out / "worst").iterdir()) == []
    write_campaign_page(out, 2)
    assert len(check(out / "campaign.html").asked) == 2


@pytest.mark.medium
def test_replay_that_differs_is_marked_on_the_page(tmp_path, monkeypatch):
    from cosim.campaigns.rerun import Repeat

    out = tmp_path / "out"
    run_campaign(write(tmp_path / "s.jsonl", PLAIN[:1]), "ismail_dunnigan", out, BRIEF)
    monkeypatch.setattr(Repeat, "differences", lambda self, run: {"min_clearance": (0.5, 0.4)})
    write_campaign_page(out, 1)
    assert "the flight step by step differs: min_clearance" in (out / "campaign.html").read_text()


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("scenes", [[REFUSED], PLAIN[:1]], ids=["none that could be flown", "one"])
def test_page_of_few_scenes_is_complete(tmp_path, scenes):
    run_campaign(write(tmp_path / "s.jsonl", scenes), "ismail_dunnigan", tmp_path / "out", BRIEF)
    text = write_campaign_page(tmp_path / "out", 0).read_text()
    check(tmp_path / "out" / "campaign.html")
    assert ("None of the 1 scenes could be flown" in text) == (scenes[0] is REFUSED)
    assert (tmp_path / "out" / "figures").exists() == (scenes[0] is not REFUSED)


@pytest.mark.medium
def test_run_stopped_by_the_plant_has_a_replay_up_to_the_stop(tmp_path):
    out = tmp_path / "out"
    done = run_campaign(
        write(tmp_path / "s.jsonl", [PLAIN[0] | {"righting_moment": -5e4}]), "ismail_dunnigan", out, BRIEF
    )
    (row,) = done.results.table.to_pylist()
    assert row["stopped_at"] > 0.0
    write_campaign_page(out, 1)
    cell = next(r for r in check(out / "campaign.html").rows if len(r) == 4 and r[0] == "20000")
    assert cell[1] == f"stopped at {row['stopped_at']:.2f} s" and cell[2].startswith("replay; the plant stops: ")
    (run,) = runs_of(out / "worst" / "20000" / "replay.html")
    assert run["status"].startswith("failed")


def test_incomplete_campaign_has_no_page(tmp_path, fakes):
    with pytest.raises(RunError, match="is not complete"):
        write_campaign_page(tmp_path, 0)
    run_sweep(paper(), design(3), tmp_path / "out")
    with pytest.raises(RunError, match="holds no campaign of scenes"):
        write_campaign_page(tmp_path / "out", 0)
    (tmp_path / "out" / "summary.json").write_text("[")
    with pytest.raises(RunError, match=r"summary\.json: cannot be read"):
        write_sweep_page(tmp_path / "out", 0)


@pytest.mark.slow
def test_sweep_page_lists_varied_keys_and_outcomes(tmp_path, fakes):
    fakes(Choosy)
    run_sweep(paper(), design(40), tmp_path / "out")
    checker = check(write_sweep_page(tmp_path / "out", 0))
    assert ["gain k_p1 [N/m3]", "law.gains.k_p1", "10 to 30"] in checker.rows
    assert ["gain of SR1", "regions.SR1.gain", "500 to 5000, logarithmic"] in checker.rows
    head = ["", "start position y [m]", "gain of SR1", "gain k_p1 [N/m3]", "chance reaches"]
    told = {row[0]: row[1:] for row in checker.rows[checker.rows.index(head) + 1 :]}
    share = json.loads((tmp_path / "out" / "summary.json").read_text())["effects"]["initial.position.1"]["violated"]
    assert (
        told["violated a hard region"][0] == f"{100 * share['share']:.0f}\N{NO-BREAK SPACE}%, ρ\N{NO-BREAK SPACE}+0.87"
    )
    assert told["violated a hard region"][-1] == f"{100 * share['floor']:.0f}\N{NO-BREAK SPACE}%"
    assert told["minimum clearance [m]"][0].endswith("ρ\N{NO-BREAK SPACE}+1.00") and told["effort [N s]"][0] == "", (
        "it is all of the gain"
    )
    assert sum("expected less" in row[-1] for row in checker.rows) == 5
    names = {p.stem for p in (tmp_path / "out" / "figures").iterdir()}
    assert names == {"rates", "distributions", "depends", "by-min-clearance", "by-reach-time"}
    run_sweep(paper(), design(3, vary=["initial.position.1=1.6:2"]), tmp_path / "none")
    assert "None of the 3 rows could be flown" in write_sweep_page(tmp_path / "none", 1).read_text()


@pytest.mark.slow
def test_the_page_of_a_comparison_has_all_laws_in_each_replay(tmp_path, idle):
    out = tmp_path / "out"
    compare(write(tmp_path / "s.jsonl", [*HARD[:2], REFUSED]), ["ismail_dunnigan", "idle"], out, BRIEF)
    checker = check(write_comparison_page(out, 1))
    assert checker.asked and "p:" in (out / "compare.html").read_text()
    runs = runs_of(out / checker.asked[0])
    assert [run["name"] for run in runs] == ["ismail_dunnigan", "idle"]
    assert {p.stem for p in (out / "figures").iterdir()} == {"rates", "distributions", "scenes-ismail_dunnigan-idle"}
    compare(tmp_path / "s.jsonl", ["ismail_dunnigan", "idle"], out, BRIEF)  # a folder with a page is accepted
    with pytest.raises(RunError, match=r"compare\.json: cannot be read"):
        write_comparison_page(tmp_path, 1)


def test_replay_count_must_be_a_number(capsys):
    for text in ("-1", "all", "1e9"):
        with pytest.raises(SystemExit):
            main(["campaign", "s.jsonl", "--law", "ismail_dunnigan", "--out", "o", "--replays", text])
        assert "from 0 to 1000" in capsys.readouterr().err


ATTACK = """</script></title><script>harm()</script><img src=x onerror="harm()"> {{ s }} 5 %"""
LOOKED_UP = {"kind", "completed_by", "beside"}  # keys whose texts decide what a page shows
FREE = {"versions", "gains", "conditions", "reasons"}  # tables whose keys are names from outside


def hostile(value, free=False):
    """Return numbers of a page with an attack in place of each text and of each name from outside."""
    if isinstance(value, dict):
        return {
            f"{ATTACK} {i}" if free else key: item if key in LOOKED_UP else hostile(item, key in FREE)
            for i, (key, item) in enumerate(value.items())
        }
    if isinstance(value, list):
        return [hostile(item) for item in value]
    return ATTACK if isinstance(value, str) else value


def campaign_to_attack(out, flown, fakes, idle):
    shutil.copytree(flown, out)
    return out / "summary.json", write_campaign_page


def sweep_to_attack(out, flown, fakes, idle):
    fakes(Choosy)
    run_sweep(paper(), design(20), out)
    return out / "summary.json", write_sweep_page


def comparison_to_attack(out, flown, fakes, idle):
    compare(write(out.parent / "s.jsonl", [*HARD[:2], REFUSED]), ["ismail_dunnigan", "idle"], out, BRIEF)
    return out / "compare.json", write_comparison_page


@pytest.mark.medium
@pytest.mark.parametrize("make", [sweep_to_attack, campaign_to_attack, comparison_to_attack])
def test_hostile_texts_are_escaped(make, flown, tmp_path, fakes, idle):
    """A page whose numbers hold attacks has the elements that it has without them."""
    numbers, write_page = make(tmp_path / "out", flown, fakes, idle)
    page, table = write_page(numbers.parent, 0), json.loads(numbers.read_text())
    plain = Elements(page.read_text()).found
    numbers.write_text(json.dumps(hostile(table)))
    write_page(numbers.parent, 0)
    attacked = page.read_text()
    assert Elements(attacked).found == plain and "script" not in {tag for tag, _ in plain}
    assert "harm()" in attacked and "{{ s }} 5\N{NO-BREAK SPACE}%" in attacked


@pytest.mark.parametrize(
    ("x", "text"), [(None, "–"), (-0.12345, "−0.1235"), (34064.2, "34064"), (12.0, "12"), (1.5e12, "1.5e+12")]
)
def test_table_numbers_are_formatted(x, text):
    assert number(x) == text


@pytest.mark.parametrize("n", [1, 2, 5, 40, 1001, 1000], ids=lambda n: f"{n} numbers")
@pytest.mark.parametrize("never", [0, 3])
def test_median_marker_matches_the_table(n, never):
    """Of an even number of rows the median lies between two, and so does the dot; both exclude NaN."""
    values = np.append(np.random.default_rng(n).exponential(size=n), np.full(never, np.nan))
    (drawn,) = distributions({"effort": {"": values}}, "")
    (axes,) = (axes for axes in drawn.figure.axes if axes.get_visible())
    (dot,) = (line for line in axes.lines if line.get_marker() == "o")
    ((_, _, row),) = SECTIONS["quantile_rows"]({"all": {"quantiles": {"effort": quantiles(values)}}})
    table = dict(zip(SECTIONS["quantile_names"], row, strict=True))
    assert number(dot.get_xdata()[0]) == number(table["median"])
    finite = sorted(values[:n])
    assert dot.get_xdata()[0] == pytest.approx((finite[(n - 1) // 2] + finite[n // 2]) / 2)
    (curve,) = (line for line in axes.lines if line is not dot)
    x, shares = curve.get_data()
    below = shares[x < dot.get_xdata()[0]][-1:].sum()
    assert below <= dot.get_ydata()[0] <= shares[x >= dot.get_xdata()[0]][0], "the dot lies on the curve"


def test_cumulative_shares_count_unreached_rows():
    values, shares = cumulative_fractions(np.array([3.0, np.nan, 1.0, np.nan]))
    assert values.tolist() == [1.0, 3.0] and shares.tolist() == [0.25, 0.5]
    assert [a.size for a in cumulative_fractions(np.zeros(0))] == [0, 0]
