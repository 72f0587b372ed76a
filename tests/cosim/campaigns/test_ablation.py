"""Ablations: the deployable law compared with variants that lack one part."""

import json
import re

import numpy as np
import pytest

from controller.laws.deployable.gains import DeployableGains
from cosim.campaigns.ablation import VARIANTS, ablate
from cosim.campaigns.analysis.statistics import mean_ratio
from cosim.campaigns.pages.ablation_page import write_ablation_page
from cosim.campaigns.scenes.conflicts import make_conflict
from cosim.campaigns.scenes.trials import make_trial
from cosim.command_line.cli import main
from cosim.errors import RunError
from tests.cosim.campaigns.scene_data import write


def is_between(table):
    """Return whether a squeeze begins where both of its regions are violated."""
    depths = sorted(region["shape"]["point"][2] for region in table["scenario"]["regions"])
    return depths[0] < table["scenario"]["initial"]["position"][2] < depths[1]


@pytest.fixture
def scenes(tmp_path):
    """Two short conflicts: a squeeze, in which the arbiter decides from the start, and a door."""
    tables = [make_conflict(seed) for seed in range(200)]
    squeeze = next(table for table in tables if table["kind"] == "squeeze, odin" and is_between(table))
    door = next(table for table in tables if table["kind"] == "door, odin")
    for table in (squeeze, door):
        table["scenario"]["time"]["duration"] = 3.0
    return write(tmp_path / "scenes.jsonl", [squeeze, door])


@pytest.mark.medium
def test_variants_are_compared_with_the_complete_law(tmp_path, scenes):
    out = tmp_path / "out"
    done = ablate(scenes, out, ["arbiter-none", "barriers"])
    assert sorted(p.name for p in out.iterdir()) == ["ablation.json", "arbiter-none", "barriers", "whole"]
    assert json.loads((out / "ablation.json").read_text()) == done.numbers
    whole, without = (done.campaigns[name].results for name in ("whole", "arbiter-none"))
    of = done.numbers["variants"]["arbiter-none"]
    mine, theirs = (rows.number("weighted_violation") for rows in (whole, without))
    assert of["weighted_violation"]["one"] == mine.mean() and of["weighted_violation"]["other"] == theirs.mean()
    assert of["weighted_violation"]["ratio"] == pytest.approx(mine.mean() / theirs.mean())
    assert set(of["kinds"]) == {"squeeze, odin", "door, odin"}
    assert done.campaigns["barriers"].summary["gains"]["barriers"] == 0.0
    assert done.campaigns["arbiter-none"].summary["conditions"]["arbiter"] == "none"
    page = write_ablation_page(out, 0).read_text()
    assert "arbiter-none" in page and "squeeze, odin" in page and "Where it changed most" in page


@pytest.mark.medium
def test_ablation_resumes_with_the_missing_variants(tmp_path, scenes):
    ablate(scenes, tmp_path / "out", ["arbiter-crisp"])
    more = ablate(scenes, tmp_path / "out", ["arbiter-crisp", "net-weight"])
    assert {name: campaign.flown for name, campaign in more.campaigns.items()} == {
        "whole": 0, "arbiter-crisp": 0, "net-weight": 2,
    }  # fmt: skip


@pytest.mark.parametrize("name", VARIANTS)
def test_every_variant_takes_out_gains_or_rules_that_exist(name):
    gains = DeployableGains()
    assert (gains._replace(**VARIANTS[name].gains) != gains) != (VARIANTS[name].arbiter != "ordered")


@pytest.mark.parametrize(
    ("variants", "said"),
    [(["motor"], "variant 'motor' is unknown"), ([], "variants are none"), (["lag"] * 2, "each once")],
)
def test_invalid_variants_are_rejected(tmp_path, scenes, variants, said):
    with pytest.raises(RunError, match=said):
        ablate(scenes, tmp_path / "out", variants)
    assert not (tmp_path / "out").exists()


@pytest.mark.medium
def test_command_prints_the_ablation_result(tmp_path, scenes, capsys):
    words = ["--variants", "lag", "--replays", "0", "--out", str(tmp_path / "out")]
    assert main(["compare", "--ablate", str(scenes), *words]) == 0
    said = capsys.readouterr().out.splitlines()
    assert re.fullmatch(
        r"whole \(all of it\): \d of 2 scenes completed, weighted violation [\d.]+ m s on average", said[0]
    )
    assert said[1].startswith("lag (no lag of the thrusters, and no prediction): ") and said[2].endswith(
        "ablation.html"
    )


def test_a_ratio_of_means_has_the_interval_of_its_delta_method():
    """Of many pairs the bootstrap's interval is the normal one of the ratio, by the delta method."""
    rng = np.random.default_rng(3)
    one, other = rng.gamma(4.0, 1.0, 4000), rng.gamma(9.0, 1.0, 4000)
    found = mean_ratio(one, other)
    ratio = one.mean() / other.mean()
    spread = np.std(one - ratio * other) / other.mean() / np.sqrt(4000)
    assert found["ratio"] == pytest.approx(ratio, rel=1e-12)
    assert [found["low"], found["high"]] == pytest.approx([ratio - 1.96 * spread, ratio + 1.96 * spread], rel=5e-3)
    assert mean_ratio(one, 0.0 * other)["ratio"] is None and mean_ratio(one[:0], other[:0])["pairs"] == 0
    assert mean_ratio(np.array([1.0, np.nan]), np.array([2.0, 5.0])) == {
        "pairs": 1, "one": 1.0, "other": 2.0, "ratio": 0.5, "low": 0.5, "high": 0.5,
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count"), [("net weight", 20), ("moments", 30), ("current", 20), ("pocket", 6)])
def test_ablated_part_fails_its_trials(tmp_path, kind, count):
    """Without the part that a trial tries, fewer are completed, and all are with it."""
    tables = [t for t in map(make_trial, range(900_000, 900_400)) if t["kind"] == kind][:count]
    variant = "path-planning" if kind == "pocket" else kind.replace(" ", "-")
    done = ablate(write(tmp_path / "scenes.jsonl", tables), tmp_path / "out", [variant])
    numbers = done.numbers["variants"]
    assert numbers["whole"]["completed"]["rows"] == count > numbers[variant]["completed"]["rows"]
