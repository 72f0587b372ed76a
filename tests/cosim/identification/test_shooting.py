"""Predictions against the FMU itself, their sensitivities against finite differences of ten digits more."""

import numpy as np
import pytest

from cosim.errors import IdentificationError
from cosim.identification.shooting import STATE_SIZE, Directions, Shooter
from tests.cosim.identification.pool import fly
from tests.plant_fmu.conftest import STATES, WRENCH

BODY = {
    "current.x": 0.1, "current.y": -0.2, "added_mass[1,5]": 0.4, "added_mass[2,4]": -0.3, "linear_damping[6]": 0.2,
    "added_mass[3,3]": 20.0, "quadratic_damping[3]": 150.0, "buoyancy": 131.0, "r_B.z": -0.015, "r_G.x": 0.01,
    "mass": 13.0, "inertia.xz": 0.02,
}  # fmt: skip
STEP, STEPS = 0.02, 100


@pytest.fixture(scope="module")
def shooter(vehicle):
    return Shooter(vehicle)


def start_and_wrench(seed=1):
    rng = np.random.default_rng(seed)
    start = np.concatenate([[0.3, -0.2, 2.0], [0.9, 0.2, -0.3, 0.25], 0.5 * rng.standard_normal(6)])
    start[3:7] /= np.linalg.norm(start[3:7])
    wrench = np.repeat(rng.standard_normal((STEPS // 10, 6)) * [20, 20, 20, 2, 2, 2], 10, axis=0)
    return start, np.stack([wrench, np.zeros_like(wrench)], axis=1)


def test_prediction_matches_the_fmu(vehicle, shooter):
    start, wrench = start_and_wrench()
    times = np.arange(1, STEPS + 1) * STEP
    begin = BODY | dict(zip(STATES, start, strict=True))
    expected = fly(vehicle, begin, WRENCH, wrench[:, 0], STEP)[1:]
    # the FMU's own steps are of 5 ms; a quarter of the step leaves 1/256 of the difference
    coarse = shooter.predict(BODY, start, wrench, STEP, times).states
    fine = shooter.predict(BODY, start, np.repeat(wrench, 4, axis=0), STEP / 4, times).states
    assert np.abs(coarse - expected).max() < 1e-4
    assert np.abs(fine - expected).max() < 1e-10  # rounding


def test_samples_between_steps_are_interpolated(shooter):
    start, wrench = start_and_wrench()
    times = np.sort(np.random.default_rng(3).uniform(0.0, STEP * STEPS, 40))
    found = shooter.predict(BODY, start, wrench, STEP, times)
    fine = shooter.predict(BODY, start, np.repeat(wrench, 20, axis=0), STEP / 20, times)
    assert np.abs(found.states - fine.states).max() < 1e-4
    assert np.abs(found.rates - fine.rates).max() < 1e-2


def all_directions(rng):
    n_start, inputs = STATE_SIZE, rng.standard_normal((2, STEPS, 2, 6))
    count = n_start + len(BODY) + 2 + 2
    start, force = np.zeros((count, STATE_SIZE)), np.zeros((count, 3))
    start[:n_start] = np.eye(STATE_SIZE)
    parameters = [None] * n_start + list(BODY) + [None] * 4
    rows = [None] * (count - 4) + [0, 1, None, None]
    force[-2, 0] = force[-1, 1] = 1.0
    return Directions(start, parameters, rows, force, inputs)


def test_a_wrench_may_change_within_a_step(shooter):
    start, wrench = start_and_wrench()
    wrench[:, 1] = np.random.default_rng(5).standard_normal((STEPS, 6))
    fine = np.repeat(wrench, 40, axis=0)
    fine[:, 0] += fine[:, 1] * np.tile((np.arange(40) - 19.5) / 40, STEPS)[:, None]
    fine[:, 1] = 0.0
    times = np.array([0.5, 2.0])
    found, expected = (shooter.predict(BODY, start, w, STEP * STEPS / len(w), times).states for w in (wrench, fine))
    assert np.abs(found - expected).max() < 1e-4


def name_of(along, j):
    return along.parameters[j] or ""


def test_sensitivities_match_central_differences(shooter):
    """Central differences of two widths, extrapolated: their error is of order four."""
    rng = np.random.default_rng(2)
    start, wrench = start_and_wrench()
    force, times = np.array([0.5, -0.3, 0.0]), np.linspace(0.013, STEP * STEPS, 30)
    along = all_directions(rng)
    found = shooter.predict(BODY, start, wrench, STEP, times, along, force).tangents

    def moved(j, by):
        name, row = along.parameters[j], along.inputs[j]
        parameters = BODY | ({name: BODY[name] + by} if name else {})
        changed = wrench + by * along.wrench[row] if row is not None else wrench
        begin = start + by * along.start[j]
        return shooter.predict(parameters, begin, changed, STEP, times, force=force + by * along.force[j]).states

    for j in range(len(along.parameters)):
        h = 1e-6 if name_of(along, j).startswith("r_") else 1e-5 * max(1.0, abs(BODY.get(name_of(along, j), 0.0)))
        one, two = ((moved(j, k * h) - moved(j, -k * h)) / (2 * k * h) for k in (1, 2))
        expected = (4.0 * one - two) / 3.0
        scale = np.abs(expected).max()
        assert scale > 0.0 or along.parameters[j] is None
        assert np.abs(found[:, j] - expected).max() <= 1e-6 * max(scale, 1e-3), along.parameters[j]


def measured(shooter, start, wrench):
    """Quaternions and angular velocities of the free motion at the ends of its steps."""
    times = np.arange(STEPS + 1) * STEP
    return shooter.predict(BODY, start, wrench, STEP, times).states[:, [3, 4, 5, 6, 10, 11, 12]]


def test_true_turns_as_inputs_give_the_same_motion(shooter):
    start, wrench = start_and_wrench()
    times = np.linspace(0.1, STEP * STEPS, 20)
    free = shooter.predict(BODY, start, wrench, STEP, times).states
    turns = measured(shooter, start, wrench)
    given = shooter.predict(BODY, start, wrench, STEP, times, turns=turns).states
    assert np.abs(given - free).max() < 2e-3
    pushed = np.add(wrench, [0, 0, 0, 3.0, -2.0, 4.0])  # moments that the turns do not show change nothing
    assert np.abs(shooter.predict(BODY, start, pushed, STEP, times, turns=turns).states - given).max() < 1e-9


def test_sensitivities_with_given_turns_match_central_differences(shooter):
    start, wrench = start_and_wrench()
    turns, times = measured(shooter, start, wrench), np.array([0.5, 1.3, 2.0])
    along = all_directions(np.random.default_rng(2))
    along.start[3:7], along.start[10:13] = 0.0, 0.0  # these are inputs
    found = shooter.predict(BODY, start, wrench, STEP, times, along, turns=turns).tangents
    for j, name in enumerate(along.parameters):
        row, h = along.inputs[j], 1e-5 * max(1.0, abs(BODY.get(name or "", 0.0)))
        ends = [
            shooter.predict(
                BODY | ({name: BODY[name] + by} if name else {}), start + by * along.start[j],
                wrench + (by * along.wrench[row] if row is not None else 0.0), STEP, times, force=by * along.force[j],
                turns=turns,
            ).states
            for by in (h, -h)
        ]  # fmt: skip
        expected = (ends[0] - ends[1]) / (2 * h)
        assert np.abs(found[:, j] - expected).max() <= 1e-4 * max(np.abs(expected).max(), 1e-3), name


def test_invalid_body_parameters_are_rejected(shooter):
    start, wrench = start_and_wrench()
    with pytest.raises(IdentificationError, match="not positive definite"):
        shooter.predict({"added_mass[1,1]": -50.0}, start, wrench, STEP, np.array([1.0]))


def test_diverging_motion_is_rejected(shooter):
    start, wrench = start_and_wrench()
    with pytest.raises(IdentificationError, match="no numbers"):
        shooter.predict({}, start, 1e9 * wrench, STEP, np.array([1.0]))
