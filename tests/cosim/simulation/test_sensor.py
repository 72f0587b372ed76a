"""Information that reaches law and arbiter, and information that is withheld."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pytest

from controller import LAWS, IsmailDunniganLaw
from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master
from tests.cosim.simulation.keep import kept_rows

PERIODS = ["time.step=0.01", "time.control=0.01", "time.arbiter=0.01", "time.duration=2.0"]
THRUSTERS = ["arbiter.engine=closed", "actuation.through=thrusters", *PERIODS]
NOISY = ["sensing.position_noise=0.02", "sensing.velocity_noise=0.01", "sensing.seed=7"]
DEAD = ["sensing.dead_from=0.5", "sensing.dead_for=0.3"]


def run(*overrides, name="paper"):
    return kept_rows(load_scenario(name, [*THRUSTERS, *overrides]))


def stack(kept, *names):
    return np.column_stack([kept[name] for name in names])


SENSED = ("sensed.x", "sensed.y", "sensed.z", "sensed.u", "sensed.v", "sensed.w")
TRUE = ("position.x", "position.y", "position.z", "velocity.u", "velocity.v", "velocity.w")


@dataclass
class Given:
    """All that a law was given."""

    built: list = field(
        default_factory=list
    )  # by the checks of the shipped and the changed scenario, then by the master
    steps: list = field(default_factory=list)


@pytest.fixture
def spy(monkeypatch):
    """Return a function that runs a scenario with a law in the printed one's place that keeps all that it is given."""

    class Spy(IsmailDunniganLaw):
        given: ClassVar[Given]

        @classmethod
        def for_vehicle(cls, vehicle, gains, desired_quaternion, period, n_regions):
            now = (*vehicle, gains, desired_quaternion, period, n_regions)
            cls.given.built.append([np.array(part) for part in now])
            return cls(gains, desired_quaternion, period, n_regions)

        def step(self, state, goal, regions, weights, forces):
            self.given.steps.append([np.array(part) for part in (*state, *goal, *regions, weights)])
            super().step(state, goal, regions, weights, forces)

    def of(*overrides):
        Spy.given = Given()
        kept = run(*overrides)
        return Spy.given, kept

    monkeypatch.setitem(LAWS, "ismail_dunnigan", Spy)
    return of


UNTOLD = [
    "plant.current=[0.2,0.1,0.0]",
    "plant.parameters.weight=1300.0",
    "plant.parameters.buoyancy=1210.0",
    "plant.parameters.mass=140.0",
    "plant.parameters.r_G.z=0.08",
    "plant.parameters.r_B.x=0.02",
    "failures=[{thruster=2,time=0.0}]",
]


def same(one, other):
    return len(one) == len(other) > 0 and all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("untold", [*([key] for key in UNTOLD), UNTOLD], ids=[*UNTOLD, "all"])
def test_undisclosed_conditions_do_not_change_law_inputs(spy, untold):
    """Construction and first step have the same arguments bit for bit; the last step, in another place, has not."""
    (plain, _), (changed, _) = spy(*NOISY), spy(*NOISY, *untold)
    assert same(plain.built[-1], changed.built[-1])
    assert same(plain.steps[0], changed.steps[0])
    assert not np.array_equal(plain.steps[-1][0], changed.steps[-1][0])


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("told", ["regions.SR1.shape.radius=0.6", "goal.velocity=[0.1,0,0]", "sensing.seed=8"])
def test_disclosed_conditions_change_law_inputs(spy, told):
    """Keep the test above from passing by blindness."""
    assert not same(spy(*NOISY)[0].steps[0], spy(*NOISY, told)[0].steps[0])


def test_the_law_is_built_for_the_vehicle(spy):
    assert not same(spy()[0].built[-1], spy("vehicle=bluerov2_heavy")[0].built[-1])


@pytest.mark.parametrize("time", [1.0, 0.995])
def test_failed_thruster_gives_zero_from_the_next_step_on(time):
    kept = run(f"failures=[{{thruster=3,time={time}}}]")
    given, asked = kept["thruster_force[3]"][:-1], kept["thrust[3]"][:-1]
    assert np.abs(given[:100]).min() > 0.0
    assert not given[100:].any()
    assert np.abs(asked[100:]).max() > 1.0  # and the failure is not reported to the law


def test_reported_failure_reaches_law_and_allocation(spy):
    given, kept = spy("failures=[{thruster=3,time=1.0}]", "report_failures=true", "law.gains.k_p1=0.01")
    health = [arguments[3] for arguments in given.steps]
    assert all(h.all() for h in health[:100])
    assert [list(h) for h in health[100:]] == [[1, 1, 0, 1, 1, 1, 1, 1]] * 101
    assert kept["thrust[3]"][:100].any()
    assert not kept["thrust[3]"][100:].any()
    # seven of ODIN's eight still give any wrench: what the limits did not cut acts as asked for
    uncut = np.flatnonzero(kept["allocation_saturated"][:-1] == 0.0)
    uncut = uncut[uncut >= 100]
    assert uncut.size > 0
    acting, asked = (stack(kept, *(f"{what}.{a}" for a in "XYZKMN")) for what in ("actuation", "command"))
    assert acting[uncut] == pytest.approx(asked[uncut], abs=1e-9)


def test_noise_is_white_of_the_stated_size_and_held_for_a_control_period():
    kept = run(*NOISY, "time.control=0.02", "time.duration=40.0", "law.gains.k_p1=0.001")
    noise = stack(kept, *SENSED) - stack(kept, *TRUE)
    assert np.abs(noise[1::2] - noise[:-1:2]).max() < 1e-12  # two steps a control period
    noise = noise[::2]
    assert noise.std(axis=0) == pytest.approx([0.02] * 3 + [0.01] * 3, rel=0.1)
    assert np.abs(noise.mean(axis=0)).max() < 0.002
    correlation = np.corrcoef(np.hstack([noise[1:], noise[:-1]]).T) - np.eye(12)
    assert np.abs(correlation).max() < 0.1
    assert np.array_equal(
        stack(kept, "sensed.p", "sensed.q", "sensed.r"), stack(kept, *(f"velocity.{a}" for a in "pqr"))
    )


def test_noise_depends_only_on_the_seed():
    def noise(*keys):
        kept = run(*NOISY, *keys)
        return stack(kept, *SENSED) - stack(kept, *TRUE)

    assert noise() == pytest.approx(noise("plant.current=[0.2,0,0]"), abs=1e-12)
    assert np.abs(noise() - noise("sensing.seed=8")).max() > 0.01


def test_arbiter_uses_measurements_and_record_holds_true_clearances():
    """Large noise: the measured position is meters off, so that memberships differ from the true ones."""
    kept = run("sensing.position_noise=3.0", "law.gains.k_p1=0.001", "arbiter.ramp=1.0")
    p, told = stack(kept, *TRUE[:3]), stack(kept, *SENSED[:3])
    center = np.array([2.0, 0.0, 1.8])
    assert kept["SR1.clearance"] == pytest.approx(np.linalg.norm(p - center, axis=1) - 0.5)
    seen = np.linalg.norm(told - center, axis=1) - 0.5
    assert kept["membership.obstacle"] == pytest.approx(np.clip(1.0 - seen, 0.0, 1.0), abs=1e-9)
    assert np.ptp(kept["membership.obstacle"]) > 0.5


class Still(IsmailDunniganLaw):
    """Command zero for any input."""

    def step(self, state, goal, regions, weights, forces):
        self.told.append((state.position.copy(), state.velocity_body.copy()))
        forces[:] = 0.0


@pytest.fixture
def still(monkeypatch):
    Still.told = []
    monkeypatch.setitem(LAWS, "ismail_dunnigan", Still)
    return Still.told


def test_sensor_outage_gives_nan_and_holds_the_weights(still):
    kept = run(*DEAD, "initial.velocity=[1.0,0,0,0,0,0]", "regions.SR3.shape.tolerance=0.1", "arbiter.ramp=2.0")
    lost = np.isnan(stack(kept, *SENSED))
    time = kept["time"]
    dead = (time >= 0.5 - 1e-9) & (time < 0.8 - 1e-9)
    assert dead.sum() == 30
    assert np.array_equal(lost.all(axis=1), dead)
    assert np.array_equal(lost.any(axis=1), dead)
    assert [bool(np.isnan(p).all() and np.isnan(v[:3]).all() and np.isfinite(v[3:]).all()) for p, v in still] == list(
        dead
    )
    weight = kept["weight.obstacle"]
    assert len(np.unique(weight[49:80])) == 1
    assert weight[80] != weight[79] and weight[49] != weight[48]
    assert np.isfinite(stack(kept, "SR1.clearance", "goal.clearance", "weight.obstacle")).all()


def test_a_frozen_sensor_repeats_its_last_values(still):
    kept = run(*DEAD, *NOISY, "sensing.frozen=true", "initial.velocity=[1.0,0,0,0,0,0]")
    sensed = stack(kept, *SENSED)
    assert np.isfinite(sensed).all()
    assert np.array_equal(sensed[50:80], np.tile(sensed[49], (30, 1)))
    assert np.abs(sensed[80] - sensed[79])[0] > 0.05


def test_sensor_frozen_from_the_start_holds_initial_values(still):
    kept = run(
        "sensing.dead_from=0.0", "sensing.dead_for=0.3", "sensing.frozen=true", "initial.velocity=[1.0,0,0,0,0,0]"
    )
    assert np.array_equal(stack(kept, *SENSED)[:30], np.tile([0.0, 0.0, 1.0, 1.0, 0.0, 0.0], (30, 1)))


def test_exact_sensing_leaves_the_record_as_it_was():
    plain = load_scenario("paper", THRUSTERS)
    with Master(plain) as master:
        names = [column.name for column in master.signals.columns]
    assert not [name for name in names if name.startswith(("sensed.", "law.")) or ".shift." in name]


def test_diagnostics_of_the_law_are_columns():
    kept = run(name="paper-deployable")
    assert kept["law.position.x"][1:] == pytest.approx(kept["position.x"][1:], abs=0.05)
    assert kept["law.path_cost"][0] > 5.0
    # a law that drives thrusters: the wrench that it asks for is what they amount to
    with Master(load_scenario("paper-deployable", THRUSTERS)) as master:
        B = master.scenario.vehicle.thruster_matrix
    thrusts = stack(kept, *(f"thrust[{i + 1}]" for i in range(8)))
    assert np.abs(thrusts).max() <= 27.0
    assert stack(kept, *(f"command.{a}" for a in "XYZKMN")) == pytest.approx(thrusts @ B.T, abs=1e-9)
