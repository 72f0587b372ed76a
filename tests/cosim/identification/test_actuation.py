"""The wrench of a run's commands against the plant's own thrusters, and its derivatives against differences."""

import dataclasses

import numpy as np
import pytest

from cosim.errors import IdentificationError
from cosim.identification.actuation import CommandedForces, steady_forces
from cosim.identification.log import Log
from tests.cosim.identification.pool import THRUST, fly
from tests.plant_fmu.conftest import WRENCH

STEP = 0.02


def log_of(vehicle, seed=0, rows=60, period=0.05):
    rng = np.random.default_rng(seed)
    thrust = rng.uniform(-50.0, 50.0, (rows, vehicle.n_thrusters))
    wrench = rng.uniform(-1.0, 1.0, (rows, 6))
    return Log("one", period * np.arange(rows), thrust, wrench, ())


@pytest.mark.medium
def test_wrench_matches_the_plant(vehicle):
    """The FMU gives the wrench at moments; its mean over a step follows from Simpson's rule on its substeps."""
    bent = dataclasses.replace(
        vehicle, thrust_time_constant=np.full(8, 0.12), thrust_curve=np.full(8, 0.5), thrust_dead_band=np.full(8, 0.05)
    )
    log = log_of(vehicle)
    forces = CommandedForces(log, bent, STEP / 4)
    found = forces.actuation(0.12, np.ones(8)).wrench[:, 0]
    rows = np.floor(np.arange(10 * 20) * STEP / 4 / 0.05 + 1e-9).astype(int)
    names, inputs = (*THRUST, *WRENCH), np.repeat(np.hstack([log.thrust, log.wrench])[rows], 2, axis=0)
    start = dict(zip(names, inputs[0], strict=True)) | {"position.z": 5.0}
    start |= dict(zip((f"actuator.{name}" for name in THRUST), steady_forces(log.thrust[:1], bent)[0], strict=True))
    flown = fly(bent, start, names, inputs, STEP / 8, [f"actuation.{name}" for name in "XYZKMN"])
    # mean and middle differ by h^2/24 of the curvature
    assert found[: len(rows)] == pytest.approx(flown[1::2], abs=2e-2)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(("lag", "is_sampled"), [(0.03, False), (0.1, True), (0.4, False)])
def test_wrench_derivatives_match_central_differences(vehicle, lag, is_sampled):
    log = dataclasses.replace(log_of(vehicle, period=0.1 if is_sampled else 0.05), sampled=is_sampled)
    forces, h = CommandedForces(log, vehicle, STEP), 1e-6
    arguments = [np.array(lag), np.linspace(0.9, 1.1, 8), np.linspace(0.0, 0.2, 8), np.zeros(13)]
    found = forces.actuation(lag, *arguments[1:])
    exact = found.by_lag[None], found.by_scale, found.by_loss, found.by_changes
    assert len(found.by_changes) == (13 if is_sampled else 0)
    for k, derivatives in enumerate(exact):
        for i, derivative in enumerate(derivatives):
            bit = h * (np.arange(arguments[k].size) == i).reshape(arguments[k].shape)
            ahead, back = (
                forces.actuation(*(x + sign * bit if n == k else x for n, x in enumerate(arguments))).wrench
                for sign in (1, -1)
            )
            assert derivative == pytest.approx((ahead - back) / (2.0 * h), rel=1e-6, abs=1e-4 if k == 0 else 1e-6)


def test_a_loss_backward_is_one_of_negative_commands_alone(vehicle):
    """As commands of less force are, where those are negative."""
    log, losses, scales = log_of(vehicle), np.linspace(0.0, 0.3, 8), np.linspace(0.9, 1.1, 8)
    less = dataclasses.replace(log, thrust=np.where(log.thrust < 0.0, (1.0 - losses) * np.clip(log.thrust, -40.0, 0.0),
                                                    log.thrust))  # fmt: skip
    found = CommandedForces(log, vehicle, STEP).actuation(0.1, scales, losses)
    assert found.wrench == pytest.approx(CommandedForces(less, vehicle, STEP).actuation(0.1, scales).wrench, abs=1e-9)


def test_lag_conserves_the_impulse(vehicle):
    """All that is commanded arrives, but for what is still on its way: the gap at the end, times the lag."""
    log, lag = log_of(vehicle), 0.1
    forces = CommandedForces(log, vehicle, STEP)
    now, late = (forces.actuation(T, np.ones(8)).wrench for T in (0.0, lag))
    missing = STEP * (now[:, 0] - late[:, 0]).sum(axis=0)
    steady = vehicle.thruster_matrix @ np.clip(log.thrust, vehicle.thrust_min, vehicle.thrust_max)[[0, -2]].T
    reached = late[-1, 0] + late[-1, 1] / 2.0 - log.wrench[-2]
    assert missing == pytest.approx(lag * (reached - steady[:, 0]), abs=1e-2 * np.abs(steady).max() * lag)


def test_rate_limit_is_rejected(vehicle):
    slow = dataclasses.replace(vehicle, thrust_rate_limit=np.full(8, 10.0))
    with pytest.raises(IdentificationError, match="rate_limit"):
        CommandedForces(log_of(vehicle), slow, STEP)


@pytest.mark.parametrize("phase", [0.2, 0.5, 0.87])
def test_changes_between_samples_may_be_steps(vehicle, phase):
    """Steps at one part of each period have the same impulse and, behind a lag, nearly the same wrench."""
    log = dataclasses.replace(log_of(vehicle, period=0.1), wrench=np.zeros((60, 6)), sampled=True)
    times = np.concatenate([log.times[:1], log.times[:-1] + 0.1 * phase])
    steps = CommandedForces(dataclasses.replace(log, times=times, sampled=False), vehicle, 0.1)
    lines, scales = CommandedForces(log, vehicle, 0.1), np.linspace(0.9, 1.1, 8)
    changes = np.append(np.repeat([phase - 0.5, phase * (1.0 - phase) / 2.0 - 1.0 / 12.0], 6), 0.0)
    expected = steps.actuation(0.0, scales).wrench[:58, 0]
    assert lines.actuation(0.0, scales, changes=changes).wrench[:58, 0] == pytest.approx(expected)
    fine, few = (
        CommandedForces(x, vehicle, 0.005) for x in (dataclasses.replace(log, times=times, sampled=False), log)
    )
    late = np.where(np.arange(13) < 6, changes, 0.0)
    behind, near, far = (
        x.wrench[400:1140:20, 0] - 0.5 * x.wrench[400:1140:20, 1] for x in (  # at samples, long after the first one
            fine.actuation(0.3, scales), few.actuation(0.3, scales, changes=changes),
            few.actuation(0.3, scales, changes=late),
        )
    )  # fmt: skip
    assert np.abs(near - behind).max() < 0.5 * np.abs(far - behind).max()


def test_smoothness_is_a_second_moment(vehicle):
    """A filter's second moment is half the second derivative of what it filters: of a slow sine, known by hand."""
    times = 0.1 * np.arange(200)
    sine = np.repeat(5.0 * np.sin(0.8 * times)[:, None], vehicle.n_thrusters, axis=1)
    log = Log("one", times, sine, np.zeros((200, 6)), (), sampled=True)
    forces, scales = CommandedForces(log, vehicle, STEP), np.ones(vehicle.n_thrusters)
    found = forces.actuation(0.0, scales).by_changes[12, :, 0]
    middles = STEP * (np.arange(len(found)) + 0.5)
    expected = (-(0.8**2) * 5.0 * np.sin(0.8 * middles) * 0.1**2 / 12.0)[:, None] * vehicle.thruster_matrix.sum(axis=1)
    assert found[20:-20] == pytest.approx(expected[20:-20], abs=0.1 * np.abs(expected).max())
