"""Runs with custom criteria and rules, against independent computation and the fused loop bit for bit."""

import functools

import numpy as np
import pytest

from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.errors import RunError
from cosim.results.record import load_record
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.criteria import Criterion
from fuzzy_arbiter.formats import load
from tests.cosim.batch.test_fused import assert_same_signals
from tests.cosim.scenario.test_criteria import RULES, SCENARIO
from tests.cosim.simulation.keep import kept_rows

FOUR = "inspection-visibility"
PAST_THE_PILLAR = "law.gains.path_planning=0"  # close, since no path makes way for it
NOISY = ["sensing.position_noise=0.02", "sensing.velocity_noise=0.01"]


@pytest.fixture
def own(tmp_path):
    """A scenario with rules of its own, whose centroids are in closed form."""
    (tmp_path / "mine.toml").write_text(RULES)
    (tmp_path / "scenario.toml").write_text(SCENARIO)
    return tmp_path / "scenario.toml"


@pytest.fixture
def swept(own):
    """The same with a rule of weight 0.9, so that centroids are swept."""
    (own.parent / "mine.toml").write_text(
        RULES.replace("depth_asks is yes then depth is high", "depth_asks is yes then depth is high with 0.9")
    )
    own.write_text(SCENARIO.replace("[arbiter]", '[arbiter]\nengine = "exact"'))
    return own


@functools.lru_cache
def flown(*changes):
    return kept_rows(load_scenario(FOUR, list(changes)))


def test_weights_are_those_of_numpy_and_scikit_fuzzy():
    """Memberships by NumPy from what is recorded; weights by scikit-fuzzy, whose samples at D leave it D²/6 off."""
    run = flown("time.duration=14.0", PAST_THE_PILLAR)
    every = slice(0, None, 38)  # rows at which the arbiter decides, every 0.38 s
    # an upright pillar: what its distance does, of the recorded place and velocity
    pillar = np.stack([run["position.x"] - 4.2, run["position.y"] - 2.7])
    distance = np.linalg.norm(pillar, axis=0)
    w, x, y, z = (run[f"quaternion.e{i}"] for i in range(4))
    u, v, s = (run[f"velocity.{name}"] for name in "uvw")
    north = (1 - 2 * (y * y + z * z)) * u + 2 * (x * y - w * z) * v + 2 * (x * z + w * y) * s
    east = 2 * (x * y + w * z) * u + (1 - 2 * (x * x + z * z)) * v + 2 * (y * z - w * x) * s
    closing = -(pillar[0] * north + pillar[1] * east) / distance
    time = np.where(closing > 0.0, (distance - 0.6) / np.where(closing > 0.0, closing, 1.0), np.inf)
    memberships = {
        "obstacle": np.maximum(
            np.interp(distance - 0.6, [0.0, 0.3], [1.0, 0.0]), np.interp(time, [1.0, 3.0], [1.0, 0.0])
        ),
        "shape": np.interp(np.hypot(run["position.x"] - 7.4, run["position.y"] - 2.2) - 1.0, [0.0, 0.3], [1.0, 0.0]),
        "depth": np.interp(5.5 - run["position.z"], [0.0, 0.2], [1.0, 0.0]),
        "visibility": np.interp(run["view.clearance"], [-0.4, 0.1], [1.0, 0.0]),
    }
    points = 501
    reference = Arbiter([Criterion(name) for name in memberships], engine="skfuzzy", points=points)
    samples = np.column_stack([values[every] for values in memberships.values()])
    for name, values in memberships.items():
        np.testing.assert_allclose(run[f"membership.{name}"][every], values[every], atol=1e-4)
    weights = np.column_stack([run[f"weight.{name}"][every] for name in memberships])
    expected = np.array([reference(np.clip(sample, 0.0, 1.0).tolist()) for sample in samples])
    np.testing.assert_allclose(weights, expected, atol=1.5e-4 + (1.0 / (points - 1)) ** 2)  # slopes of 1.5 at the most
    assert weights[:, 0].max() > 0.9 and weights[:, 3].max() > 0.99  # not all of them nothing


def assert_same_to_the_last_bit(scenario):
    run = kept_rows(scenario)
    with FusedFlyer(Variation(scenario, ())) as flyer:
        _, trace = flyer.fly_one(scenario, trace=True)
    assert_same_signals(trace, run, scenario)
    assert max(np.ptp(trace[f"weight.{name}"]) for name in scenario.criterion_names) > 0.05
    return run


def test_weights_use_the_laws_estimate_under_noise():
    scenario, degrees = load_scenario(FOUR, [*NOISY, "initial.position=[2.0, 1.4, 5.45]", "time.duration=3.0"]), []
    with Master(scenario) as master:
        depth = master.signals.index("membership.depth")
        for k in range(300):
            expected = master.law.expected.copy()
            master.step(k)
            if k % 2 == 0 and k > 20:
                depths = np.array([expected[2], master.state.position[2], master.true_state.position[2]])
                degrees.append(np.interp(5.5 - depths, [0.0, 0.2], [1.0, 0.0]))
                assert master.row[depth] == pytest.approx(degrees[-1][0], abs=1e-9)
    by_estimate, by_measurement, of_truth = np.abs(np.diff(degrees, axis=0)).sum(axis=0)
    assert 0.5 < of_truth < by_measurement - 0.3
    assert by_estimate - of_truth < 0.25 * (by_measurement - of_truth)


def test_fused_loop_with_four_criteria_equals_the_master():
    assert_same_to_the_last_bit(load_scenario(FOUR, ["time.duration=14.0", *NOISY]))


def test_fused_loop_with_curves_equals_the_master():
    changes = [
        "criteria.obstacle.membership={ramp=0.3,approach_time={sigmoid=[2.0,-3.0]}}",
        "criteria.shape.membership={clearance={gaussian=[0.0,0.3]}}",
        "criteria.depth.membership={clearance={z_shape=[0.0,0.5]}}",
        "criteria.visibility.membership={clearance={formula='1 / (1 + exp(20 * (x + 0.15)))'}}",
    ]
    run = assert_same_to_the_last_bit(load_scenario(FOUR, ["time.duration=14.0", PAST_THE_PILLAR, *NOISY, *changes]))
    clean = kept_rows(load_scenario(FOUR, ["time.duration=4.0", *changes]))
    every = slice(0, None, 38)  # rows at which the arbiter decides
    riser = np.hypot(clean["position.x"] - 7.4, clean["position.y"] - 2.2) - 1.0
    np.testing.assert_allclose(clean["membership.shape"][every], np.exp(-(riser**2) / 0.18)[every], atol=1e-4)
    seen = 1.0 / (1.0 + np.exp(20.0 * (clean["view.clearance"] + 0.15)))
    np.testing.assert_allclose(clean["membership.visibility"][every], seen[every], atol=1e-3)
    assert np.ptp(run["membership.obstacle"]) > 0.5


@pytest.mark.parametrize(
    ("rules", "changes"),
    [
        ("own", ["time.duration=6.0", "arbiter.inputs.charge=[[1, 1], [4, 0.1]]"]),
        ("swept", ["time.duration=6.0"]),
        (
            "own",
            ["time.duration=20.0", "sensing.through=sensors", "sensing.position_noise=0", "sensing.velocity_noise=0"],
        ),
    ],
    ids=["closed form", "exact centroids", "sensors"],
)
def test_fused_loop_with_an_arbiter_file_equals_the_master(rules, changes, request):
    file = request.getfixturevalue(rules)
    assert_same_to_the_last_bit(load_scenario(file, ["initial.position=[6.5, 0.0, 4.2]", *changes]))


def test_record_holds_the_arbiter_inputs(own, tmp_path):
    scenario = load_scenario(
        own,
        [
            "initial.position=[6.5, 0.0, 4.2]",
            "time.duration=4.0",
            *(c.replace("0.02", "0").replace("0.01", "0") for c in NOISY),
        ],
    )
    record = load_record(run_scenario(scenario, tmp_path / "run", report=False).folder)
    inputs = [record[f"arbiter.{name}"] for name in ("distance", "soon", "charge", "depth_asks")]
    arbiter = Arbiter(load(own.parent / "mine.toml"))
    names = [output.name for output in arbiter.system.outputs]
    for k in range(0, len(record), 20):
        weights = dict(zip(names, arbiter(np.clip([x[k] for x in inputs], 0.0, [5, 10, 1, 1]).tolist()), strict=True))
        assert {name: record[f"weight.{name}"][k] for name in names} == weights
    np.testing.assert_allclose(inputs[0][::2], np.minimum(record["mooring.clearance"], 5.0)[::2])
    np.testing.assert_allclose(inputs[2][::2], np.interp(record["time"], [0, 10, 20], [1.0, 0.6, 0.1])[::2], atol=1e-12)
    again = run_scenario(load_scenario(tmp_path / "run" / "scenario.toml"), tmp_path / "again", report=False)
    assert (again.folder / "record.parquet").read_bytes() == (tmp_path / "run" / "record.parquet").read_bytes()


def test_fused_loop_rejects_sampling_engines(own):
    with pytest.raises(RunError, match=r"arbiter.engine is 'grid', expected 'closed'"):
        FusedFlyer(Variation(load_scenario(own, ["arbiter.engine=grid"]), ()))


def test_visibility_criterion_changes_the_motion():
    """With the criterion the joint enters the view within six seconds, without its gain never."""
    seen = flown("time.duration=14.0")
    assert (seen["view.clearance"][600:] > 0.0).all()
    assert (flown("time.duration=14.0", "regions.view.gain=0")["view.clearance"] < -0.4).all()


@pytest.mark.slow
def test_visibility_priority_changes_the_motion():
    """First instead of last, it holds the view where the risers press, and enters them deeper."""
    last, first = flown(), flown("criteria.visibility.order=0")
    assert (last["view.clearance"] > 0.0).mean() > 0.55
    assert first["view.clearance"][3400:].min() > -0.3 > last["view.clearance"][3400:].min()
    assert first["risers.clearance"].min() < -0.15 < -0.1 < last["risers.clearance"].min()
    assert min(last["pillar.clearance"].min(), first["pillar.clearance"].min()) > 0.0
