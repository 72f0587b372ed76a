"""Complete runs in lanes against the fused loop, which steps the FMU."""

import math
import pickle

import numpy as np
import pytest

from cosim.batch.fused import FusedFlyer
from cosim.batch.lanes import LanesFlyer
from cosim.batch.outcome import OUTCOME
from cosim.batch.variation import Variation
from cosim.errors import RunError
from cosim.scenario.scenario import load_scenario

BASE = (
    "arbiter.engine=closed", "time.duration=12", "time.step=0.01", "time.control=0.01", "time.arbiter=0.01",
    "plant.substep=0.01", "limit.force=200.0", "initial.velocity=[0,0,0,0,0,0]", "plant.current=[0,0,0]",
    "intersection=[]",
)  # fmt: skip
KEYS = (
    "initial.position.0", "initial.position.2", "initial.velocity.0", "law.gains.k_p1", "law.gains.gamma",
    "regions.SR1.gain", "regions.SR2.shape.radius", "goal.centre.1", "plant.current.0", "plant.parameters.weight",
    "limit.force", "arbiter.ramp",
)  # fmt: skip


def variation(keys=KEYS, *overrides):
    return Variation(load_scenario("paper", [*BASE, *overrides]), keys)


def drawn(of, rows, seed=1, spread=0.1):
    base = np.array([of.number(key) for key in of.keys], dtype=float)
    scale = np.where(base == 0.0, 1.0, np.abs(base))
    return base + spread * scale * np.random.default_rng(seed).uniform(-1.0, 1.0, (rows, base.size)), np.arange(rows)


def compare(of, values, seeds):
    """Fly a batch both ways, hold one against the other, and return what the lanes gave."""
    with LanesFlyer(of) as lanes, FusedFlyer(of) as fused:
        got, expected = lanes.fly(values, seeds), fused.fly(values, seeds)
    assert got.refused.keys() == expected.refused.keys()
    for row, why in got.refused.items():  # the plant's Python side has a word more to say than its C side
        assert expected.refused[row].startswith(why) or why.startswith("seed is"), (row, why, expected.refused[row])
    for name in OUTCOME.names:
        # estimates of what is 0 are rounding themselves: they are held against the weight
        least = 1e-12 * 1e3 if name.startswith("phi") else 1e-12
        np.testing.assert_allclose(got.outcomes[name], expected.outcomes[name], rtol=1e-12, atol=least, err_msg=name)
    return got


@pytest.mark.slow
def test_papers_runs_equal_the_fused_loop():
    """Each lane with other numbers, and a last batch that does not fill the lanes."""
    of = variation()
    flown = compare(of, *drawn(of, 2 * 8 + 3))
    assert len(np.unique(flown.outcomes["final_x"])) == 19
    assert 0 < flown.outcomes["violated"].sum() < 19 and flown.outcomes["reached"].any()


@pytest.mark.medium
def test_single_and_empty_batches_are_valid():
    of = variation()
    values, seeds = drawn(of, 9)
    with LanesFlyer(of) as lanes:
        together = lanes.fly(values, seeds).outcomes
        for i in (0, 8):
            alone = lanes.fly(values[i : i + 1], seeds[i : i + 1]).outcomes
            assert alone.tobytes() == together[i : i + 1].tobytes()
        assert lanes.fly(values[:0], seeds[:0]).outcomes.shape == (0,)


REGIONS = {
    "half_space": 'keep="in", shape={type="half_space", point=[9.0,0,0], normal=[1.0,0.1,0]}',
    "box": 'keep="out", shape={type="box", centre=[4.0,0,3], size=[1.0,1,1], quaternion=[0.9,0.1,0,0.2]}',
    "cylinder": 'keep="out", shape={type="cylinder", start=[4.0,-1,3], end=[4.0,1,3.5], radius=0.4}',
    "ellipsoid": 'keep="out", shape={type="ellipsoid", centre=[4.0,0,3], semi_axes=[0.5,0.8,0.3]}',
    "prism": 'keep="out", shape={type="prism", corners=[[3.0,-1],[5.0,-1],[4.0,1.0]], top=1.0, bottom=4.0}',
    "pipe": 'keep="in", shape={type="pipe", points=[[0.0,0,0],[4.0,0,2],[8.0,0,6]], radius=2.0}',
    "cone": 'keep="in", shape={type="cone", feature=[9.0,0,5], axis=[-1.0,0,0], half_angle=0.6, range=12.0}',
    "orientation": 'keep="in", shape={type="orientation", quaternion=[1.0,0,0,0], tolerance=0.1}',
    "visibility": 'keep="in", shape={type="visibility", feature=[9.0,0,4], camera_axis=[1.0,0,0], half_angle=0.4}',
    "moving sphere": 'keep="out", velocity=[-0.3,0.1,0], shape={type="sphere", centre=[7.0,0,4], radius=0.5}',
}


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("name", REGIONS)
def test_every_shape_equals_the_fused_loop(name):
    region = f'{{name="it", criterion="obstacle", gain=80.0, {REGIONS[name]}}}'
    of = variation(
        ("initial.position.1", "law.gains.k_p1", "regions.it.gain"), f"regions=[{region}]", "time.duration=4"
    )
    compare(of, *drawn(of, 3))


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize(
    "overrides",
    [
        ("time.control=0.05", "time.arbiter=0.1", "time.step=0.005"),
        ("goal.velocity=[0.05,0,0.01]", "limit.time_constant=0.2"),
        ("plant.parameters.free_surface=true", "plant.current=[0.1,-0.1,0]", "plant.parameters.current_shear.x=0.02"),
        ("plant.parameters.bottom_depth=5.2", "plant.parameters.hull_radius=0.3"),
        ("limit.force=inf", "actuation.through=thrusters"),
        ("limit.force=inf", "actuation.through=thrusters", "actuation.limits=per-thruster"),
        ("regions=[]",),
        ("limit.force=inf", "time.step=0.002", "plant.substep=0.001"),
    ],
)
def test_settings_equal_the_fused_loop(overrides):
    of = variation(("initial.position.1", "law.gains.k_v1", "goal.radius"), *overrides, "time.duration=5")
    compare(of, *drawn(of, 5))


def test_lane_stopped_by_the_guard_does_not_affect_others():
    step = [f"{key}=0.02" for key in ("time.step", "time.control", "time.arbiter", "plant.substep")]
    of = variation(("law.gains.k_v1", "initial.position.1"), "limit.force=inf", *step)
    values, seeds = drawn(of, 11)
    values[2, 0], values[9, 0] = 2.5e4, 3e5  # damping by the law that its own period cannot follow
    flown = compare(of, values, seeds).outcomes
    stopped = np.isfinite(flown["stopped_at"])
    assert stopped[[2, 9]].all() and not stopped[[0, 1, 3, 4]].any()
    assert 1.0 > flown["stopped_at"][2] > flown["stopped_at"][9] > 0.0


def test_non_finite_thrust_stops_the_lane_as_in_the_fmu():
    of = variation(("law.gains.k_p1",), "limit.force=inf", "actuation.through=thrusters", "time.duration=0.1")
    flown = compare(of, np.array([[18.8], [1e308], [20.0]]), np.arange(3)).outcomes
    np.testing.assert_array_equal(flown["stopped_at"], [math.nan, 0.0, math.nan])


def test_nan_clearance_is_reported_as_nan():
    flat = 'shape={type="ellipsoid", centre=[0.0,0,0], semi_axes=[5e-324,1.0,1.0]}'
    region = f'{{name="it", criterion="obstacle", keep="out", gain=80.0, {flat}}}'
    of = variation((), f"regions=[{region}]", "initial.position=[0,0,0.5]", "time.duration=0.1")
    assert np.isnan(compare(of, np.zeros((1, 0)), np.arange(1)).outcomes["min_clearance"]).all()


# ---- what is refused ----


def test_rejected_rows_equal_those_of_full_validation():
    """Also in words; the first row is bad, and all between two good numbers is taken unasked."""
    keys = (
        "law.gains.k_p1", "regions.SR1.shape.radius", "plant.parameters.weight", "initial.velocity.0", "limit.force",
        "plant.parameters.thrust_max[1]",
    )  # fmt: skip
    of = variation(keys, "time.duration=0.2")
    values, seeds = drawn(of, 24)
    bad = {
        0: (0, 0.0), 3: (0, -1.0), 4: (0, math.nan), 7: (1, 0.0), 9: (1, 2e9), 10: (2, -1.0), 11: (2, math.inf),
        13: (3, 2e4), 14: (3, math.nan), 15: (4, -1.0), 16: (4, math.nan), 17: (5, -1e6), 18: (2, 1e300),
    }  # fmt: skip
    for row, (column, value) in bad.items():
        values[row, column] = value
    seeds[20], seeds[21] = -1, 2**31
    values[22, 4] = math.inf  # no limit at all
    flown = compare(of, values, seeds)
    assert set(flown.refused) == {*bad, 20, 21}
    assert np.isnan(flown.outcomes["final_x"][0]) and not flown.outcomes["violated"][0]


def test_varied_elements_of_composite_values_equal_the_fused_loop():
    """Points of a prism, parts of a quaternion: each row is checked whole."""
    prism = '{name="it", criterion="shape", keep="out", gain=50.0, ' + REGIONS["prism"].partition(", ")[2] + "}"
    keys = ("regions.it.shape.corners.2.1", "initial.quaternion.3", "regions.it.gain")
    of = variation(keys, f"regions=[{prism}]", "time.duration=2")
    values, seeds = drawn(of, 9)
    values[:, 1] = 0.0
    values[4, 0], values[5, 1] = -1.0, 0.5  # no polygon, no unit quaternion
    assert set(compare(of, values, seeds).refused) == {4, 5}


def test_integer_keys_stay_integer_and_integer_shapes_accept_fractions():
    of = variation(("goal.centre.0", "sensing.seed"), "goal.centre=[128, 0.0, 5.0]", "time.duration=0.1")
    values = np.array([[129.0, 1.0], [126.0, 2.5], [127.5, 3.0], [128.0, 4.0]])
    assert set(compare(of, values, np.arange(4)).refused) == {1}


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("law.name=pd", "law.name"),
        ("arbiter.engine=exact", "arbiter.engine"),
        ("master.order=jacobi", "master.order"),
        ("sensing.position_noise=0.1", "sensing"),
        ("commands.enabled=true", "commands.enabled"),
        ("failures=[{thruster=1, time=1.0}] limit.force=inf actuation.through=thrusters", "failures"),
        ("plant.parameters.current_variation.x=0.1", "plant.parameters.current_variation.x"),
        ("plant.parameters.dvl.rate=5.0", "plant.parameters.dvl.rate"),
    ],
)
def test_unsupported_scenarios_are_rejected_by_key(override, named):
    with pytest.raises(RunError, match=named.replace(".", r"\.")):
        LanesFlyer(variation((), *override.replace(", ", ",").split()))


@pytest.mark.parametrize(
    "key", ["time.duration", "plant.substep", "sensing.position_noise", "plant.parameters.imu.rate", "arbiter.points"]
)
def test_unsupported_varied_keys_are_rejected_by_name(key):
    with pytest.raises(RunError, match=key.replace(".", r"\.")):
        LanesFlyer(variation((key,)))


def test_pickled_variation_gives_the_same_run():
    of = variation()
    values, seeds = drawn(of, 3)
    with LanesFlyer(of) as here, LanesFlyer(pickle.loads(pickle.dumps(of))) as there:
        assert here.fly(values, seeds).outcomes.tobytes() == there.fly(values, seeds).outcomes.tobytes()
