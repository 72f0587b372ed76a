"""The deployable law as a whole: memory, repeatability, what it does with nonsense."""

import copy
import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from controller import VehicleState
from controller.laws.deployable import DeployableGains
from controller.laws.deployable.estimate import LAG
from controller.quaternion import rotation_matrix
from controller.regions import Box, DepthBand, Region, Sphere, pack
from controller.regions.region_set import clearance_at
from tests.controller.deployable.scenery import GOAL, ODIN, REGIONS, Sea, fly, law_for

ROOT = Path(__file__).parents[3]
NOISE = (0.02, 0.01)


@pytest.mark.medium
def test_memory_is_the_complete_state_of_the_law():
    """A law that is given a copy of another's memory in mid-flight goes on as that one does, to the last bit."""
    law, sea = law_for(REGIONS), Sea(noise=NOISE)
    fly(law, sea, steps=150)
    twin, other_sea = law_for(REGIONS), copy.deepcopy(sea)
    assert twin.memory is not law.memory
    twin.memory = copy.deepcopy(law.memory)
    sea.failed = other_sea.failed = 1
    ours, theirs = (fly(*pair, steps=300, first=150) for pair in ((law, sea), (twin, other_sea)))
    assert np.array_equal(ours, theirs)
    assert np.array_equal(law.report, twin.report)
    assert ours.any(axis=1).all()


@pytest.mark.medium
def test_laws_share_no_state():
    one, other = law_for(REGIONS), law_for(REGIONS)
    alone = fly(law_for(REGIONS), Sea(noise=NOISE), steps=60)
    broken = Sea(restoring=12.0)
    broken.left[3] = 0.0
    fly(other, broken, steps=60)
    assert np.array_equal(fly(one, Sea(noise=NOISE), steps=60), alone)


@pytest.mark.slow
def test_interpreted_law_equals_compiled_law_to_rounding():
    """Plain Python in a process of its own; what overflows there is the generator of random numbers, on purpose."""
    code = (
        "import numpy as np\n"
        "from tests.controller.deployable.scenery import *\n"
        "print(fly(law_for(REGIONS), Sea(noise=(0.02, 0.01)), steps=12).tolist())\n"
    )
    environment = os.environ | {"SUBREACH_INTERPRETED": "1", "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "ignore"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    plain = np.array(eval(done.stdout))
    assert plain == pytest.approx(fly(law_for(REGIONS), Sea(noise=NOISE), steps=12), abs=1e-7)
    assert plain.any(axis=1).all()


@pytest.mark.medium
def test_goal_is_reached_without_violation_and_within_force_limits():
    law, sea, clear = law_for(REGIONS), Sea(noise=NOISE), []

    def check(t):
        at = [np.add(r.shape.center, np.multiply(r.velocity, t)) for r in REGIONS[:2]]
        clear.extend(np.linalg.norm(sea.position - c) - r.shape.radius for c, r in zip(at, REGIONS, strict=False))

    forces = fly(law, sea, steps=1500, each=check)
    assert min(clear) > 0.0
    assert np.abs(forces).max() <= 27.0
    assert np.linalg.norm(sea.position - GOAL.shape.center) < 0.5
    assert np.linalg.norm(sea.velocity) < 0.05
    assert law.estimate[0] == pytest.approx(sea.net_weight, abs=1.0)


def dead(which):
    """Return what a sensor gives that is dead from 3 s to 4 s."""
    last = []

    def change(t, state):
        if not 3.0 <= t < 4.0:
            last[:] = [state]
            return state
        if which == "frozen":
            return last[0]
        if which == "everything":
            return VehicleState(*(np.full_like(part, np.nan) for part in state[:3]), state.thruster_health)
        nothing = np.full_like(getattr(state, which), np.nan)
        return state._replace(**{which: nothing})

    return change


@pytest.mark.medium
@pytest.mark.parametrize(
    "which",
    [
        *(pytest.param(w, marks=pytest.mark.slow) for w in ("position", "quaternion", "velocity_body")),
        "everything",
        "frozen",
    ],
)
def test_one_second_sensor_outage_is_tolerated(which):
    """Forces stay finite and within limits, nothing is touched, no thruster is given up, the goal is reached."""
    law, sea, clear = law_for(REGIONS), Sea(noise=NOISE), []
    ball = REGIONS[0].shape

    def check(t):
        clear.append(np.linalg.norm(sea.position - ball.center) - ball.radius)
        assert law.memory.thrusters.health.all(), t

    forces = fly(law, sea, steps=1500, change=dead(which), each=check)
    assert np.isfinite(forces).all() and np.abs(forces).max() <= 27.0
    assert min(clear) > 0.0
    assert np.linalg.norm(sea.position - GOAL.shape.center) < 0.5


@pytest.mark.medium
def test_expected_state_error_is_below_the_noise():
    law, sea, errors = law_for(REGIONS), Sea(noise=NOISE), []
    assert np.isnan(law.expected).all()
    for k in range(600):
        fly(law, sea, steps=1, first=k)
        errors.append(law.expected - [*sea.position, *(rotation_matrix(sea.quaternion).T @ sea.velocity)])
    position, velocity = np.sqrt(np.mean(np.square(errors[100:]), axis=0)).reshape(2, 3).max(axis=1)
    assert position < 0.3 * NOISE[0] and velocity < 0.7 * NOISE[1]
    lost = sea.measured()._replace(position=np.full(3, np.nan), velocity_body=np.full(6, np.nan))
    for k in range(round(2.0 * law.gains.coast / 0.02)):
        fly(law, sea, steps=1, first=600 + k, change=lambda _, state: lost)
    assert np.isnan(law.expected).all()


def test_without_measurements_forces_are_zero():
    def nothing(t, state):
        return VehicleState(*(np.full_like(part, np.nan) for part in state[:3]), state.thruster_health)

    law = law_for(REGIONS)
    names = [diagnostic.name for diagnostic in law.diagnostics]
    unknown = [names.index(name) for name in ("bound", "thrust_limit", "drag", "acceleration_error")]
    assert np.isnan(law.report[unknown]).all()
    assert not fly(law, Sea(), steps=50, change=nothing).any()
    assert np.isnan(law.report[unknown]).all()


@pytest.mark.medium
@pytest.mark.parametrize("rise", [0.0, 5.0])
def test_with_attitude_alone_the_weight_is_compensated(rise):
    """The vertical speed settles where drag balances `rise`; without one it is the estimate's error that is left."""
    own, sea = law_for([], gains=DeployableGains(rise=rise)), Sea(current=(0.0, 0.0, 0.0), noise=NOISE)

    def lost(t, state):
        if t < 10.0:
            return state
        return state._replace(position=np.full(3, np.nan), velocity_body=np.r_[np.full(3, np.nan), sea.omega])

    pushed = fly(own, sea, regions=[], steps=1100, change=lost)[-1]
    assert (ODIN.thruster_matrix @ pushed)[2] == pytest.approx(-sea.net_weight - rise, abs=1.0)
    assert own.memory.report.time_since_measurement > 2.0 and np.isnan(own.memory.report.bound)


@pytest.mark.medium
def test_state_uncertainty_widens_margins():
    """At a goal that a ball covers it waits at the margin, which grows by three standard deviations."""
    ball, waits = REGIONS[0], []
    goal = Region("goal", Sphere(ball.shape.center, 0.5), "in")
    for deviation in (0.0, 0.1):
        own, sea = law_for([ball]), Sea()
        given = np.r_[np.full(3, deviation), np.full(9, 1e-3)]
        fly(own, sea, goal, [ball], 1500, change=lambda t, state, given=given: state._replace(deviation=given))
        waits.append(np.linalg.norm(sea.position - ball.shape.center) - ball.shape.radius)
    assert 0.03 <= waits[0] < 0.04
    assert waits[1] - waits[0] == pytest.approx(0.3, abs=0.01)


@pytest.mark.medium
def test_conflicting_regions_keep_the_promised_clearances():
    """A plate comes down onto the band in which the vehicle is: one of them must be violated, and says so before."""
    plate = Region("plate", Box((0.0, 0.0, -1.2), (40.0, 40.0, 1.0)), "out", (0.0, 0.0, 0.1))
    band, own, sea, rows = Region("band", DepthBand(2.5, 1.0), "in"), law_for([0, 1]), Sea(noise=NOISE), []
    packed = pack([plate, band])

    def check(t):
        packed.move_to(t)
        rows.append((min(clearance_at(packed, i, sea.position) for i in range(2)), own.memory.report.bound))

    fly(own, sea, regions=[plate, band], steps=2500, each=check)
    clearance, bound = np.array(rows).T
    assert clearance.min() < -0.05 and -0.1 < bound[:500].max() <= 0.0
    assert np.all(clearance[1:] >= bound[:-1] - 1e-3)


@pytest.mark.medium
def test_delay_is_estimated_as_lag_and_regions_are_satisfied():
    """Commands come 0.2 s late, and forces follow them behind a lag of 0.15 s; the law is given neither."""
    own, sea, least, packed = law_for(REGIONS), Sea(noise=NOISE, lag=0.15, delay=10), [], pack(REGIONS)

    def check(t):
        packed.move_to(t)
        least.append(min(clearance_at(packed, i, sea.position) for i in range(len(REGIONS))))

    fly(own, sea, steps=1000, each=check)
    assert min(least) > 0.0 and clearance_at(pack([GOAL]), 0, sea.position) > 0.0
    assert own.memory.state_estimate.state[LAG] == pytest.approx(0.35, abs=0.06)
    assert own.memory.thrusters.health.all()


@pytest.mark.medium
def test_region_uncertainty_widens_its_clearance():
    clear = []
    for deviation in (0.0, 0.1):
        regions, least, sea = [dataclasses.replace(REGIONS[0], deviation=deviation), *REGIONS[1:]], [], Sea()

        def check(t, least=least, sea=sea, ball=REGIONS[0].shape):
            least.append(np.linalg.norm(sea.position - ball.center) - ball.radius)

        fly(law_for(regions), sea, regions=regions, steps=1500, each=check)
        assert np.linalg.norm(sea.position - GOAL.shape.center) < 0.5
        clear.append(min(least))
    assert clear[1] > clear[0] + 0.2


@pytest.mark.medium
def test_contradictory_regions_give_finite_forces_within_limits():
    """The vehicle within one ball, and two more closing it in from either side."""
    walls = [Region(f"{x}", Sphere((x, 0.0, 2.5), 1.2), "out") for x in (-1.0, 0.05, 1.0)]
    law, sea = law_for(walls), Sea(noise=NOISE)
    forces = fly(law, sea, regions=walls, steps=400)
    assert np.isfinite(forces).all() and np.abs(forces).max() <= 27.0
    assert np.isfinite(law.report).all()


@pytest.mark.medium
def test_two_reported_failures_stay_isolated():
    def told(t, state):
        health = np.ones(8)
        health[2] = 0.0 if t > 0.5 else 1.0
        health[5] = 0.0 if t > 1.0 else 1.0
        return state._replace(thruster_health=health)

    forces = fly(law_for(REGIONS), Sea(noise=NOISE), steps=300, change=told)
    assert not forces[60:, 2].any() and not forces[60:, 5].any()
    assert forces[60:, [0, 1, 3, 4]].any(axis=0).all()
