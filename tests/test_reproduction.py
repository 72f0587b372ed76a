"""The figures of docs/reproduction.md against runs of the shipped scenarios."""

from pathlib import Path

import numpy as np
import pytest

from cosim.results.record import load_record
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master

TEXT = " ".join((Path(__file__).parents[1] / "docs" / "reproduction.md").read_text().split())
CENTER, RADIUS = np.array([8.0, 0.0, 5.0]), 0.5
PRINTED = ("paper", "paper-limited", "paper-calibrated")


def row(words):
    """Return the middle cell of the row whose claim begins so."""
    return TEXT.partition(f"| {words}")[2].split(" | ")[1]


@pytest.fixture
def flown(shipped_run):
    return {name: shipped_run(name, "arbiter.engine=closed") for name in PRINTED}


@pytest.fixture
def records(flown):
    return {name: load_record(run.folder) for name, run in flown.items()}


def turned(record):
    """Return the angle from the identity attitude [deg] at each step."""
    e = record.stack([f"quaternion.e{i}" for i in range(4)])
    return np.degrees(2.0 * np.arctan2(np.linalg.norm(e[:, 1:], axis=1), np.abs(e[:, 0])))


def position(record):
    return record.stack([f"position.{axis}" for axis in "xyz"])


@pytest.mark.slow
def test_documented_attitude_errors_match_the_runs(records):
    angles = {name: turned(record) for name, record in records.items()}
    said = [
        f"{a.max():.1f}° at {records[n]['time'][a.argmax()]:.{2 if n == 'paper' else 1}f} s" for n, a in angles.items()
    ]
    assert row("The attitude is kept") == f"at most {'; '.join(said)}"


@pytest.mark.slow
def test_documented_root_mean_square_errors_match_the_runs(records):
    errors = [np.linalg.norm(position(record) - CENTER, axis=1) / np.sqrt(3.0) for record in records.values()]
    ends = "; ".join(f"{error[-1]:.3f}" for error in errors)
    assert row("The root-mean-square error") == f"from {errors[0][0]:.3f} m to {ends} m at the end"
    assert f"tolerance r_v/√3 = {RADIUS / np.sqrt(3.0):.3f} m" in TEXT


@pytest.mark.slow
def test_documented_goal_region_times_match_the_runs(records):
    said = row("The vehicle converges")
    switches = {}
    for name, record in records.items():
        inside = np.linalg.norm(position(record) - CENTER, axis=1) <= RADIUS
        switches[name] = record["time"][1:][np.diff(inside.astype(int)) != 0]
    first, out, last = switches["paper"]
    assert f"in at {first:.2f} s, out again at {out:.2f} s, back inside from {last:.2f} s; never in 120 s" in said
    assert not switches["paper-limited"].size
    assert switches["paper-calibrated"].size == 8 and "in and out four times" in said
    away = position(records["paper-calibrated"])[records["paper-calibrated"]["time"] >= switches["paper-calibrated"][0]]
    assert f"up to {np.linalg.norm(away - CENTER, axis=1).max():.1f} m from the center" in said


@pytest.mark.slow
def test_documented_intersection_weights_match_the_runs(flown, records):
    for name, record in records.items():
        ((start, end), *_) = flown[name].summary["intersection_windows"]
        within = (record["time"] >= start - 1e-9) & (record["time"] < end - 1e-9)
        weights = record.stack([f"weight.{criterion}" for criterion in ("obstacle", "shape", "depth")])
        assert within.any() and (weights[within] == [1.0, 0.0, 0.0]).all()
        assert np.abs(position(record)[:, 1]).max() == 0.0
    sums = [run.summary["weights_sum_max"] for run in flown.values()]
    assert f"their sum at most {max(sums):.2f}" in row("Only a single α")


@pytest.mark.slow
def test_documented_estimates_match_the_runs(flown):
    ends = [run.summary["estimate_final"] for run in flown.values()]
    first, second, third = (f"{end[0]:.2f}" if i == 0 else f"{end[0]:.1f}" for i, end in enumerate(ends))
    assert f"at the end {first}; {second}; {third} N".replace("-", "−") in row("The uncertain restoring forces")
    assert max(abs(end[3]) for end in ends) < 0.04


class AllOn:
    """The paper's law with every weight at 1."""

    def __init__(self, law):
        self.law, self.output, self.diagnostics = law, law.output, law.diagnostics

    @property
    def estimate(self):
        return self.law.estimate

    @property
    def report(self):
        return self.law.report

    def step(self, state, goal, regions, weights, forces):
        self.law.step(state, goal, regions, np.ones_like(weights), forces)


class SampledPath:
    """Observer that keeps the position."""

    def __init__(self, master):
        self.where, self.rows = master.signals.index("position.x"), []

    def observe(self, k, row):
        self.rows.append(row[self.where : self.where + 3].copy())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "said"), [("paper", "1.1 mm (`paper`)"), ("paper-limited", "0.6 mm (`paper-limited`)")]
)
def test_arbiter_effect_at_the_papers_gains_matches_the_document(name, said):
    ways = []
    for all_on in (False, True):
        scenario = load_scenario(name, ["arbiter.engine=closed", "time.duration=20"])
        law = law_of(scenario)
        with Master(scenario, AllOn(law) if all_on else law) as master:
            kept = SampledPath(master)
            master.run([kept])
        ways.append(np.array(kept.rows))
    assert f"{1e3 * np.abs(ways[0] - ways[1]).max():.1f} mm (`{name}`)" == said
    assert said in row("One region at a time")
    within = [[np.linalg.norm(way - [2.0, 0.0, z], axis=1) < 0.5 for z in (1.8, 2.2)] for way in ways]  # SR1 and SR2
    np.testing.assert_array_equal(*[a & b for a, b in within])


@pytest.mark.slow
def test_documented_deployable_run_matches_the_run(shipped_run):
    run = shipped_run("paper-deployable", "arbiter.engine=closed")
    summary, record = run.summary, load_record(run.folder)
    clear = " and ".join(f"{summary['min_clearance'][name]:.3f}" for name in ("SR1", "SR2"))
    assert f"inside from {summary['settle_time']:.2f} s, {clear} m clear of SR1 and SR2" in TEXT
    assert f"at most {summary['max_force']:.1f} N on the body and {summary['max_speed']:.2f} m/s" in TEXT
    assert f"the attitude within {turned(record).max():.1f}°" in TEXT
    assert f"φ̂1 at {summary['estimate_final'][0]:.2f} N".replace("-", "−") in TEXT
    assert f"{np.abs(position(record)[:, 1]).max():.2f} m to the side" in TEXT
