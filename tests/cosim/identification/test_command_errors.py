"""What sampled commands leave open: its size, its way through the motion, and residuals weighed by it."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from cosim.identification.actuation import CommandedForces
from cosim.identification.command_errors import most_likely_size, noise_parts, open_impulses, whitener
from cosim.identification.fit import fit, integration_step
from cosim.identification.log import Log, make_topic
from cosim.identification.parameters import free_parameters, nuisances
from cosim.identification.residuals import Residuals
from cosim.identification.windows import cut_windows
from plant_fmu import load_vehicle
from tests.cosim.identification.pool import THRUST, fly

LAG, STEP, PERIOD = 0.12, 0.01, 0.107  # s; the period is no multiple of that of the sticks
FREE = ("hydrodynamics.quadratic_damping.1", "hydrodynamics.added_mass.1.1", "thrusters.time_constant")


@pytest.fixture(scope="module")
def vehicle():
    return dataclasses.replace(load_vehicle("bluerov2_heavy"), thrust_time_constant=np.full(8, LAG))


@pytest.fixture(scope="module")
def whole(vehicle):
    """A run of the FMU whose forces change every 0.2 s by steps, each of them logged."""
    rng = np.random.default_rng(8)
    times = STEP * np.arange(round(30.0 / STEP))
    sticks = np.repeat(rng.uniform(-12.0, 12.0, (len(times) // 20, 3)), 20, axis=0)  # surge, heave, yaw
    wrench = np.zeros((len(times), 6))
    wrench[:, [0, 2]], wrench[:, 5] = sticks[:, :2], 0.1 * sticks[:, 2]
    thrust = wrench @ np.linalg.pinv(vehicle.thruster_matrix).T
    start = {"position.z": 8.0, "quadratic_damping[1]": 110.0, "added_mass[1,1]": 8.0}
    states = fly(vehicle, start, THRUST, thrust, STEP)[:-1]

    def noisy(columns, every, deviation):
        chosen = states[::every, columns]
        return times[::every], chosen + deviation * rng.standard_normal(chosen.shape), deviation

    topics = (
        make_topic("velocity", *noisy(slice(7, 10), 15, 0.005)),
        make_topic("angular_velocity", *noisy(slice(10, 13), 5, 0.002)),
        make_topic("depth", *noisy(slice(2, 3), 5, 0.003)),
        make_topic("attitude", *noisy(slice(3, 7), 5, 0.001)[:2], 0.002),  # half a rotation
    )  # fmt: skip
    return Log("pool", times, thrust, np.zeros((len(times), 6)), topics)


@pytest.fixture(scope="module")
def sampled(whole):
    """The same as a log at 9.3 Hz has it."""
    at = np.floor(np.arange(whole.times[0], whole.times[-1], PERIOD) / STEP).astype(int)
    return dataclasses.replace(
        whole, times=whole.times[at], thrust=whole.thrust[at], wrench=whole.wrench[at], sampled=True
    )


@pytest.mark.medium
def test_samples_are_joined_by_straight_lines(sampled, vehicle):
    forces = CommandedForces(sampled, vehicle, 0.02)
    found = forces.actuation(0.0, np.ones(8)).wrench[:, 0]
    dense = np.linspace(0.0, 0.02, 2001)[None, :] + 0.02 * np.arange(40)[:, None]
    wrench = sampled.thrust @ vehicle.thruster_matrix.T
    expected = np.stack([np.interp(dense, sampled.times, x).mean(axis=1) for x in wrench.T], axis=1)
    assert found[:40] == pytest.approx(expected, abs=0.03)


def test_open_impulses_are_those_of_steps_at_any_time(whole, sampled, vehicle):
    """The impulse of all changes less that of the samples, over many periods."""
    impulses = open_impulses(sampled.times, sampled.thrust, vehicle.thruster_matrix)
    wrench = whole.thrust @ vehicle.thruster_matrix.T
    edges = np.searchsorted(whole.times, sampled.times)
    true = STEP * np.array([wrench[i:j].sum(axis=0) for i, j in zip(edges, edges[1:], strict=False)])
    ends = wrench[edges]
    error = true - 0.5 * np.diff(sampled.times)[:, None] * (ends[1:] + ends[:-1])
    said = np.einsum("bij,bkj->bik", impulses.roots, impulses.roots)
    for axis in (0, 2, 5):
        ratio = np.sqrt(np.square(error[:, axis]).mean() / said[:, axis, axis].mean())
        assert ratio == pytest.approx(1.0, abs=0.15)


@pytest.mark.medium
def test_residuals_by_an_impulse_are_those_of_a_motion_with_it(sampled, vehicle):
    """The wrench of one period through the lag, added to what moves the FMU's equations."""
    step = integration_step([sampled])
    windows, _ = cut_windows([sampled], vehicle, step, 4.0)
    problem = Residuals([sampled], vehicle, free_parameters(vehicle, FREE), windows, step)
    values = np.array([p.start for p in problem.parameters])
    settings = problem.settings(values)
    window = windows[1]
    residual, _, _ = problem.raw(1, settings, window.start, full=False)
    by = problem._by_impulse(1, settings, window.start)
    impulses = problem._forces[0].impulses
    first = np.searchsorted(impulses.begins, window.first * step + 1.0)
    before = np.searchsorted(impulses.ends, window.first * step - 3.0 * LAG - 0.05, side="right")
    fine = 100  # of each step
    grid = step / fine * np.arange((window.first + window.steps) * fine + 1)
    inside = np.clip(
        np.minimum(grid[1:], impulses.ends[first]) - np.maximum(grid[:-1], impulses.begins[first]), 0, None
    )
    pole = np.exp(-step / fine / LAG)
    behind = lfilter([1.0 - pole], [1.0, -pole], inside / inside.sum()) * fine / step
    ends = np.concatenate([[0.0], behind])[::fine]
    share = np.stack([behind.reshape(-1, fine).mean(axis=1), np.diff(ends)], axis=1)
    for column in range(6):
        push = 1e-3 * share[:, :, None] * impulses.roots[first][:, column]
        actuation = settings[0].actuation
        wrench = actuation.wrench.copy()
        wrench[: len(push)] += push
        moved = [dataclasses.replace(settings[0], actuation=dataclasses.replace(actuation, wrench=wrench))]
        difference = (problem.raw(1, moved, window.start, full=False)[0] - residual) / 1e-3
        found = by[:, 12 * (first - before) + column]
        assert found == pytest.approx(difference, abs=0.01 * np.abs(difference).max() + 1e-6)


def test_whitened_residuals_are_white():
    rng = np.random.default_rng(2)
    by = rng.standard_normal((40, 6))
    covariance = np.eye(40) + 0.49 * by @ by.T
    root = whitener(by, 0.7)(np.eye(40))
    assert root @ covariance @ root.T == pytest.approx(np.eye(40), abs=1e-9)
    assert whitener(by, 0.7)(by[:, 0]) == pytest.approx(root @ by[:, 0])


def test_size_of_the_errors_is_found():
    rng = np.random.default_rng(3)
    windows = [rng.standard_normal((60, 10)) for _ in range(40)]
    residuals = [by @ (1.7 * rng.standard_normal(10)) + rng.standard_normal(60) for by in windows]
    assert most_likely_size(residuals, windows) == pytest.approx(1.7, rel=0.1)
    assert most_likely_size([rng.standard_normal(60) for _ in windows], windows) < 0.1


def test_noise_of_a_topic_is_found_beside_the_errors():
    """Of the noise that differences say, one topic has 0.3: the step of the likelihood finds that in a few turns."""
    rng, own = np.random.default_rng(4), np.repeat(["velocity", "angular_velocity"], 60)
    noise = np.where(own == "velocity", 1.0, 0.3)
    windows = [rng.standard_normal((120, 8)) for _ in range(40)]
    residuals = [by @ rng.standard_normal(8) + noise * rng.standard_normal(120) for by in windows]
    found = {"velocity": 1.0, "angular_velocity": 1.0}
    for _ in range(3):
        scale = np.array([found[name] for name in own])
        whiteners = [whitener(by / scale[:, None], 1.0) for by in windows]
        parts = noise_parts([r / scale for r in residuals], whiteners, [own] * 40)
        found = {name: found[name] * part for name, part in parts.items()}
    assert found == pytest.approx({"velocity": 1.0, "angular_velocity": 0.3}, rel=0.05)


@pytest.mark.medium
def test_sampled_commands_give_honest_numbers(sampled, vehicle):
    """Held commands, as if every change were logged, are sure of wrong numbers."""
    truth = np.array([110.0, 8.0, LAG])
    start = dataclasses.replace(vehicle, thrust_time_constant=np.full(8, 0.2))
    parameters = free_parameters(start, FREE) + nuisances(("current",), [sampled])
    held, done = (fit([dataclasses.replace(sampled, sampled=is_so)], start, parameters) for is_so in (False, True))
    assert held.intervals.chi2 > 3.0 > 1.3 > done.intervals.chi2
    assert (np.abs(done.values[:3] - truth) < 1.5 * done.intervals.half[:3]).all()  # three standard deviations
    assert np.abs(done.values[0] - truth[0]) < np.abs(held.values[0] - truth[0])
    assert done.values[:2] == pytest.approx(truth[:2], rel=0.1)
    assert 0.5 < done.command_error < 2.0
