"""True limits below the vehicle's: the mean force over an uncertain limit, and its learning in flight."""

import numpy as np
import pytest
from scipy.integrate import quad

from controller.laws.deployable.estimate import EFFECTIVENESS
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import command_forces, make_thrusters, write_force_limits
from controller.laws.deployable.thrust_limit import command_for, limited_force
from controller.regions import Region, Sphere
from tests.controller.deployable.scenery import ODIN, Sea, fly, law_for


def mean_force(command, limit, ceiling, spread):
    """Average min(|u|, c |limit|) over a uniform ceiling c, none below zero, by SciPy."""
    low, high = max(ceiling - np.sqrt(3.0) * spread, 0.0), ceiling + np.sqrt(3.0) * spread
    ends = sorted({low, min(max(abs(command / limit), low), high), high})
    total = sum(
        quad(lambda c: min(abs(command), c * abs(limit)), a, b)[0] for a, b in zip(ends, ends[1:], strict=False)
    )
    return np.sign(command) * total / (high - low)


def test_force_is_the_mean_over_the_uncertain_limit():
    rng = np.random.default_rng(1)
    for _ in range(200):
        limit, ceiling, spread = (
            rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 50.0),
            rng.uniform(0.3, 1.1),
            rng.uniform(0.01, 0.3),
        )
        command = limit * rng.uniform(0.0, 1.2)
        force, slope = limited_force(command, limit, ceiling, spread)
        assert force == pytest.approx(mean_force(command, limit, ceiling, spread), rel=1e-6, abs=1e-9)
        if ceiling > np.sqrt(3.0) * spread:
            step = 1e-6
            more, _ = limited_force(command, limit, ceiling + step, spread)
            assert slope == pytest.approx((more - force) / step, abs=1e-3 * abs(limit))


def test_command_gives_the_force_or_the_most():
    rng = np.random.default_rng(2)
    for spread in (0.0, 1e-9, 0.02, 0.2):
        for _ in range(50):
            limit, ceiling = rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 50.0), rng.uniform(0.4, 1.0)
            most, _ = limited_force(9.0 * limit, limit, ceiling, spread)
            for force in (rng.uniform(0.0, 0.999) * most, most):
                command = command_for(force, limit, ceiling, spread)
                assert limited_force(command, limit, ceiling, spread)[0] == pytest.approx(force, rel=1e-6)
            most_command = command_for(most, limit, ceiling, spread)
            assert command_for(2.0 * most, limit, ceiling, spread) == pytest.approx(most_command, rel=1e-6)
    assert limited_force(0.0, 0.0, 1.0, 0.2) == (0.0, 0.0) and command_for(0.0, 0.0, 1.0, 0.2) == 0.0


def test_allocation_uses_the_learned_limit_and_commands_no_more():
    thrusters, limits, forces = make_thrusters(ODIN), np.empty((2, 8)), np.full(8, 40.0)
    thrusters.ceiling[:] = [[0.6], [0.01]]
    thrusters.health[3] = thrusters.lower[3] = thrusters.upper[3] = 0.0
    write_force_limits(thrusters, limits)
    assert np.delete(limits, 3, axis=1) == pytest.approx(np.array([[-16.2], [16.2]]) * np.ones(7))
    assert not limits[:, 3].any()
    command_forces(thrusters, forces)
    assert np.delete(forces, 3) == pytest.approx(16.2 + 27.0 * np.sqrt(3.0) * 0.01)  # to the end of what is possible


@pytest.mark.medium
def test_limit_is_learned_and_rises_again():
    """Thrusters that saturate between two goals; from 15 s on their limits are the vehicle's again."""
    law, sea = law_for([], DeployableGains(speed=3.0, acceleration=1.5)), Sea(noise=(0.02, 0.01), current=np.zeros(3))
    x = law.memory.state_estimate.state
    for k in range(10):
        goal = Region("goal", Sphere((6.0 * (-1) ** k, 3.0 * (k % 3 - 1), 2.5), 0.5), "in")
        sea.limit[:] = 0.6 if k < 5 else 1.0
        fly(law, sea, goal, [], steps=150, first=150 * k)
        if k == 4:  # at the limit, force is effectiveness times ceiling
            assert x[EFFECTIVENESS : EFFECTIVENESS + 4] * x[-8:-4] == pytest.approx(0.6, abs=0.08)
    assert np.all(x[-8:-4] > 0.84) and law.memory.thrusters.health.all()
