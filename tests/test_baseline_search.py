"""The gain search of the baseline laws: its draws, its ranking, and its result."""

import math
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from benchmarks import baselines
from benchmarks.__main__ import main
from benchmarks.baselines import RANGES, Candidate, Outcome, draws, outcome
from controller import LAWS
from cosim.campaigns.scenes.flyer import Score

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("law", RANGES)
def test_draws_are_repeated_by_their_seed_and_stay_in_their_ranges(law):
    first, again = (draws(law, 50, np.random.default_rng(3)) for _ in range(2))
    near = draws(law, 50, np.random.default_rng(3), first[0], 1.5)
    assert first == again
    for name, (low, high) in RANGES[law].items():
        values, around, best = (
            [getattr(g, name) for g in first],
            [getattr(g, name) for g in near],
            getattr(first[0], name),
        )
        assert min(values) >= 0.999 * low and max(values) <= 1.001 * high and len(set(values)) > 40
        assert max(values) > 2.0 * min(values)
        assert min(around) >= 0.999 * max(low, best / 1.5) and max(around) <= 1.001 * min(high, best * 1.5)
    left = set(LAWS[law].gains_type._fields) - set(RANGES[law])
    assert all(getattr(gains, name) == getattr(LAWS[law].gains_type(), name) for gains in first for name in left)


def score(reached=True, reach_time=20.0, min_clearance=0.1, effort=1000.0, failed_step=-1):
    return Score(reached, reach_time, min_clearance, effort, 1.0, 1e-6, failed_step)


def test_medians_use_only_reached_scenes_without_violation():
    scores = [
        score(reach_time=10.0, effort=1.0),
        score(reach_time=30.0, effort=3.0),
        score(reach_time=1.0, effort=9.0, min_clearance=-0.01),
        score(reached=False, reach_time=math.inf, effort=9.0),
        score(reached=False, reach_time=math.inf, min_clearance=math.nan),
        score(reached=False, reach_time=math.inf, failed_step=7),
    ]
    assert outcome(scores) == Outcome(scenes=6, violations=3, reached=3, reach_time=20.0, effort=2.0)
    assert outcome([score(reached=False)]).reach_time == math.inf


def test_violations_count_before_scenes_reached_and_those_before_time():
    better = [(0, 9, 50.0), (0, 9, 60.0), (0, 8, 10.0), (1, 10, 5.0)]
    ranks = [Outcome(10, violations, reached, time, 0.0).rank for violations, reached, time in better]
    assert ranks == sorted(ranks)


class Landscape:
    """In place of flights: some scenes are violated where the reach is short; fastest is a k_p1 of 100."""

    def __init__(self, monkeypatch, needed):
        self.flights, self._needed = [], needed
        monkeypatch.setattr(baselines, "_fly_on", self.fly_on)
        monkeypatch.setattr(baselines, "ProcessPoolExecutor", ThreadPoolExecutor)

    def fly_on(self, job):
        _, (gains, scores), scenes, _ = job
        more = [i for i in scenes if i not in scores]
        self.flights.extend(more)
        time = 10.0 + 10.0 * abs(math.log(gains.k_p1 / 100.0)) + 5.0 * gains.reach
        flown = {i: score(reach_time=time + i % 3, min_clearance=gains.reach - self._needed(i)) for i in more}
        return Candidate(gains, scores | flown)


def test_search_finds_the_optimum_and_prunes_candidates(monkeypatch):
    landscape = Landscape(monkeypatch, lambda i: 0.4)
    found = baselines.search("pd", 80, 0, 2)
    assert 0.4 <= found.gains.reach < 0.8 and len(found.scores) == baselines.SCENES
    assert found.gains.k_p1 == pytest.approx(100.0, rel=0.2)
    assert len(landscape.flights) < 0.3 * 80 * baselines.SCENES
    assert baselines.search("pd", 80, 0, 1).gains == found.gains


def test_safety_outranks_time_even_for_one_late_scene(monkeypatch):
    Landscape(monkeypatch, lambda i: 1.0 if i == baselines.SCENES - 7 else 0.06)
    found = baselines.search("pd", 80, 0, 1)
    assert found.outcome.violations == 0 and found.gains.reach >= 1.0


def test_scenes_alternate_between_plain_and_hard():
    plain, hard, more = (baselines._scene(i) for i in range(3))
    assert (plain.seed, hard.seed, more.seed) == (10_000, 10_000, 10_001)
    assert plain.failed_thruster is None and more.failed_thruster is None and hard.failed_thruster is not None


def test_other_laws_start_from_the_pd_result(monkeypatch):
    begun = []
    landscape = Landscape(monkeypatch, lambda i: 0.0)
    fly_on = landscape.fly_on
    monkeypatch.setattr(baselines, "_fly_on", lambda job: begun.append(job[1].gains) or fly_on(job))
    pd = LAWS["pd"].gains_type(k_p1=77.0, reach=0.7)
    baselines.search("sun_cheah", 20, 0, 1, pd)
    assert {(gains.k_p1, gains.reach) for gains in begun[:10]} == {(77.0, 0.7)}


def test_law_without_ranges_is_rejected(capsys):
    with pytest.raises(SystemExit):
        main(["baselines", "ismail_dunnigan"])
    assert "'ismail_dunnigan'" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.timeout(900)  # 600 flights by each law
def test_documented_table_matches_the_default_gains(capsys):
    main(["baselines", "--draws", "0", "--workers", "1"])
    printed = re.findall(
        r"^(\w+), (\w+), in full: (\d+) violations and (\d+) reached .*: ([\d.]+) s, (\d+) N s$",
        capsys.readouterr().out,
        re.M,
    )
    rows = re.findall(
        r"^\| `(\w+)` \| (plain|hard) \| (\d+) \| (\d+) \| ([\d.]+) \| (\d+) \|",
        (ROOT / "docs" / "baselines.md").read_text(),
        re.M,
    )
    assert len(rows) == len(RANGES) * len(baselines.KINDS)
    assert sorted(rows) == sorted(printed)
