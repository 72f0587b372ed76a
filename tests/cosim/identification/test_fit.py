"""Numbers of a vehicle found again from samples of its FMU, with noise that is known."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from controller.quaternion import rotation_matrix
from cosim.errors import IdentificationError
from cosim.identification.delays import find_delays
from cosim.identification.findings import require_distinguishable, slow_commands, warnings
from cosim.identification.fit import Problem, fit, integration_step
from cosim.identification.identification_figures import figures_of
from cosim.identification.log import TOPICS, Log, make_topic
from cosim.identification.parameters import DEFAULT_FREE, free_parameters, nuisances, with_mean_nuisances, with_values
from cosim.identification.prediction import validate
from cosim.identification.residuals import Residuals
from cosim.identification.windows import cut_windows
from tests.cosim.identification.pool import fly
from tests.plant_fmu.conftest import WRENCH

TRUTH = {
    "quadratic_damping[1]": 110.0, "added_mass[1,1]": 8.0, "buoyancy": 131.0, "current.x": 0.06, "current.y": -0.04,
}  # fmt: skip
FREE = ("hydrodynamics.quadratic_damping.1", "hydrodynamics.added_mass.1.1", "hydrostatics.buoyancy")
PERIOD, SECONDS, BIAS = 0.05, 42.0, np.array([0.002, -0.001, 0.003])


@pytest.fixture(scope="module")
def log(vehicle):
    """A run of the FMU: surge to and fro, heave, yaw; sensors with white noise."""
    rng = np.random.default_rng(4)
    times = PERIOD * np.arange(int(SECONDS / PERIOD))
    return flown(vehicle, wrench_of(times), times, rng, np.zeros((len(times), 3)))


def wrench_of(times):
    return np.stack([
        25.0 * np.sign(np.sin(2 * np.pi * 0.13 * times)), 8.0 * np.sin(1.1 * times), 6.0 * np.sin(0.7 * times),
        0.5 * np.sin(0.9 * times), 0.5 * np.sin(1.3 * times), 1.0 * np.sin(0.5 * times),
    ], axis=1)  # fmt: skip


def flown(vehicle, wrench, times, rng, force):
    """The log of a run under a wrench, and under a force along the world's axes that the log does not have."""

    def under(tau, push):
        return lambda state: tau + np.append(rotation_matrix(state[3:7]).T @ push, np.zeros(3))

    inputs = [under(*row) for row in zip(wrench, force, strict=True)]
    states = fly(vehicle, TRUTH | {"position.z": 5.0}, WRENCH, inputs, PERIOD)[:-1]

    def noisy(columns, deviation):
        return states[:, columns] + deviation * rng.standard_normal((len(states), len(states[0, columns])))

    topics = (
        make_topic("velocity", times[::2], noisy(slice(7, 10), 0.005)[::2], 0.005),
        make_topic("angular_velocity", times, noisy(slice(10, 13), 0.002) + BIAS, 0.002),
        make_topic("depth", times, noisy(slice(2, 3), 0.003), 0.003),
        make_topic("attitude", times, noisy(slice(3, 7), 0.001), 0.002),
    )
    return Log("pool", times, np.zeros((len(times), 8)), wrench, topics)


def with_values_of(log, name, change):
    """Return a log with other values of a topic."""
    topics = (dataclasses.replace(t, values=change(t)) if t.name == name else t for t in log.topics)
    return dataclasses.replace(log, topics=tuple(topics))


@pytest.fixture(scope="module")
def parameters(log, vehicle):
    return free_parameters(vehicle, FREE) + nuisances(("current", "bias"), [log])


@pytest.fixture(scope="module")
def estimate(log, vehicle, parameters):
    return fit([log], vehicle, parameters)


@pytest.mark.medium
def test_fit_recovers_the_true_parameters(estimate):
    truth = np.array([TRUTH[p.plant] if p.plant else BIAS[p.index] for p in estimate.parameters])
    off = (estimate.values - truth) / (estimate.intervals.half / 1.96)
    assert np.abs(off).max() < 4.0
    assert estimate.values[:3] == pytest.approx(truth[:3], rel=0.02)
    assert estimate.intervals.chi2 == pytest.approx(1.0, abs=0.1)
    assert not estimate.undetermined() and not estimate.rejected and estimate.outliers == 0


@pytest.mark.medium
def test_nominal_intervals_follow_from_the_information_matrix(estimate):
    """Computed anew from the rows, prior included."""
    rows = [r.jacobian for r in estimate.residuals] + [np.diag([1.0 / p.deviation for p in estimate.parameters])]
    covariance = np.linalg.pinv(np.concatenate(rows)) @ np.linalg.pinv(np.concatenate(rows)).T
    assert estimate.intervals.nominal == pytest.approx(np.sqrt(np.diag(covariance)), rel=1e-6)
    assert (estimate.intervals.half >= 1.96 * estimate.intervals.nominal).all()


@pytest.mark.slow
def test_gradient_matches_the_cost(log, vehicle, estimate):
    """The start of each window is eliminated; cost and gradient are still those of all."""
    windows, _ = cut_windows([log], vehicle, estimate.step, 20.0)
    problem = Problem(Residuals([log], vehicle, estimate.parameters, windows, estimate.step))
    deviations = estimate.intervals.nominal
    x = estimate.values + 3.0 * deviations
    residual, jacobian = problem._evaluate(x)
    gradient = jacobian.T @ residual
    for j in range(3):
        bit = np.where(np.arange(len(x)) == j, 0.3 * deviations, 0.0)
        ahead, back = (0.5 * np.sum(np.square(problem._evaluate(x + sign * bit)[0])) for sign in (1, -1))
        assert gradient[j] == pytest.approx((ahead - back) / (2.0 * bit[j]), rel=0.02)


@pytest.mark.medium
def test_fitted_model_predicts_better_than_constant_velocity(log, vehicle, estimate):
    for p in validate([log], vehicle, estimate.parameters, estimate.values, estimate.step):
        if p.topic == "velocity":
            assert p.identified[0] < p.start_vehicle[0] and p.identified[0] < 0.5 * p.constant_velocity[0]


@pytest.mark.medium
@pytest.mark.parametrize(("seconds", "damping"), [(SECONDS, 110.0), (0.5, 110.0), (SECONDS, -1e6)])
def test_figures_are_drawn_of_runs_without_a_topic_or_a_prediction(log, vehicle, estimate, seconds, damping):
    """A window of another run without velocity, a held-out run without a window, and one that diverges."""
    mixed = dataclasses.replace(
        estimate,
        windows=(
            dataclasses.replace(estimate.windows[0], topics=estimate.windows[0].topics[1:]),
            *estimate.windows[1:],
        ),
        values=np.where(np.arange(len(estimate.values)) == 0, damping, estimate.values),
    )
    end = int(seconds / PERIOD)
    shown = dataclasses.replace(log, times=log.times[:end], thrust=log.thrust[:end], wrench=log.wrench[:end])
    is_predicted = seconds == SECONDS and damping > 0.0
    names = [figure.name for figure in figures_of(mixed, vehicle, (), shown)]
    assert names == ["numbers", "residuals", "whiteness", *(["course"] if is_predicted else []), "correlation"]
    assert mixed.residuals_by_topic().keys() == estimate.residuals_by_topic().keys()


@pytest.mark.slow
def test_uninformed_parameter_keeps_its_prior(log, vehicle):
    parameters = free_parameters(vehicle, ("thrusters.time_constant", "hydrodynamics.quadratic_damping.1"))
    estimate = fit([log], vehicle, parameters)
    assert [estimate.parameters[i].name for i in estimate.undetermined()] == ["thrusters.time_constant"]


def shift_times(log, names, delay):
    """Return a log whose samples of some topics come late."""
    late = (dataclasses.replace(t, times=t.times + delay) if t.name in names else t for t in log.topics)
    return dataclasses.replace(log, topics=tuple(late))


@pytest.fixture(scope="module")
def late(log):
    return shift_times(log, TOPICS, 0.2)


@pytest.mark.medium
def test_delays_are_found_before_any_number_is_fitted(log, late, vehicle):
    """The thrusters have no lag, which would look like a delay. Angular velocities of single sines say nothing."""
    for run, delay in ((log, 0.0), (late, 0.2)):
        estimate = find_delays([run], vehicle, 0.025)
        assert [estimate[topic.name] for topic in run.topics] == pytest.approx([delay] * 4, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(("topics", "delay"), [(("velocity",), 0.1), (TOPICS, 0.2)])
def test_delays_are_estimated(log, vehicle, topics, delay):
    """Samples of some topics, or of all, are late by their stamps."""
    delayed = shift_times(log, topics, delay)
    parameters = free_parameters(vehicle, FREE) + nuisances(("current", "bias", "delay"), [delayed])
    done = fit([delayed], vehicle, parameters)
    for p, x in zip(parameters, done.values, strict=True):
        if p.kind == "delay" and (topics == TOPICS or p.plant != "attitude"):
            assert x == pytest.approx(delay if p.plant in topics else 0.0, abs=0.01)
    assert done.values[0] == pytest.approx(TRUTH["quadratic_damping[1]"], rel=0.02)
    assert done.intervals.chi2 < 1.1 and not done.causes


@pytest.mark.slow
def test_a_cause_that_is_not_estimated_is_named(log, late, vehicle, parameters):
    """Samples that are late, and a DVL that measures 5 % too much; what changes in time has no name."""
    said = " ".join(warnings(fit([late], vehicle, parameters), [late]))
    assert "Samples come late" in said and "too: --nuisance current bias delay." in said  # what is named now stays
    done = fit([with_values_of(log, "velocity", lambda t: 1.05 * t.values)], vehicle, parameters)
    assert done.causes[0].flag == "--nuisance scale" and done.causes[0].fraction > 0.3
    said = " ".join(warnings(done, [log]))
    assert "the DVL's scale (" in said and "what it names now, --nuisance current bias: give it whole" in said


@pytest.mark.slow
def test_disturbance_is_reported_and_widens_the_intervals(log, vehicle, parameters):
    """A velocity that wanders by 2 cm/s within seconds: the noise alone does not explain it."""
    wander = 0.02 * np.sin(2 * np.pi * log.topic("velocity").times[:, None] / [5.0, 7.0, 9.0])
    done = fit([with_values_of(log, "velocity", lambda t: t.values + wander)], vehicle, parameters)
    said = " ".join(warnings(done, [log]))
    assert done.intervals.chi2 > 1.2 and "does not explain" in said and "the velocity:" in said
    assert "an error of a sensor that changes in time" in said
    assert (done.intervals.half[:3] > 3.0 * done.intervals.nominal[:3]).any()


@pytest.mark.slow
def test_random_force_is_estimated_window_by_window(vehicle, log, parameters):
    """A force along the world's axes that changes within seconds: without it the model is wrong by name."""
    rng = np.random.default_rng(11)
    times = log.times
    force = np.stack([
        0.5 * np.sin(2 * np.pi * times / period + phase)
        for period, phase in zip((17.0, 23.0, 19.0), rng.uniform(0.0, 6.0, 3), strict=True)
    ], axis=1)  # fmt: skip
    pushed = flown(vehicle, log.wrench, times, rng, force)
    blind, done = (fit([pushed], vehicle, parameters, random_force=known) for known in (False, True))
    assert blind.causes[0].flag == "--nuisance random_force" and blind.causes[0].fraction > 0.5
    assert "a force that changes in time" in " ".join(warnings(blind, [pushed]))
    truth = np.array([TRUTH[p.plant] if p.plant else BIAS[p.index] for p in parameters])
    assert (np.abs(done.values[:2] - truth[:2]) < done.intervals.half[:2]).all()
    assert done.values[:2] == pytest.approx(truth[:2], rel=0.03)
    assert "was estimated beside, constant within windows of 4 s" in " ".join(warnings(done, [pushed]))
    middles = np.array([w.begin + 0.5 * w.steps * done.step for w in done.windows])
    own = np.stack([np.interp(middles, times, x) for x in force.T], axis=1)
    for axis in range(3):
        assert np.corrcoef(done.forces[:, axis], own[:, axis])[0, 1] > 0.8


@pytest.mark.parametrize(("period", "is_slow"), [(0.1, False), (0.5, True)])
def test_slow_commands_are_named(log, period, is_slow):
    """The wrench as a telemetry log at 2 Hz holds it; sticks that rest do not make it slow."""
    first = np.searchsorted(log.times, period * np.floor(log.times / period + 1e-9) - 1e-9)
    held = dataclasses.replace(log, wrench=np.where(log.times[:, None] < 10.0, log.wrench[:1], log.wrench[first]))
    said = slow_commands(held)
    assert (
        said.startswith("Commands of pool, sampled at 2 Hz, show changes of thrust up to 0.5 s late")
        if is_slow
        else not said
    )


def test_free_parameters_are_selected_by_key(vehicle):
    names = [p.name for p in free_parameters(vehicle, ("hydrodynamics.added_mass.diagonal",))]
    assert names == [f"hydrodynamics.added_mass.{i}.{i}" for i in range(1, 7)]
    assert len(free_parameters(vehicle, DEFAULT_FREE)) == 21 + 12 + 4 + 1 + 3
    assert [p.plant for p in free_parameters(vehicle, ("hydrodynamics.added_mass.6.2",))] == ["added_mass[2,6]"]
    for key in ("hydrodynamics.added_mass.7.7", "hull.radius", "mass"):
        with pytest.raises(IdentificationError, match="--free"):
            free_parameters(vehicle, (key,))


def test_fitted_values_are_applied_to_the_vehicle(vehicle):
    keys = ("hydrodynamics.added_mass.2.6", "thrusters.matrix.3", "thrusters.time_constant", "hydrostatics.buoyancy")
    keys = (*keys, "sensors.dvl_position.3", "thrusters.delay")
    changed = with_values(vehicle, free_parameters(vehicle, keys), np.array([0.5, 1.1, 0.2, 130.0, 0.3, 0.12]))
    assert changed.dvl_position.tolist() == [0.0, 0.0, 0.3] and changed.command_delay == 0.12
    assert changed.added_mass[1, 5] == changed.added_mass[5, 1] == 0.5
    assert changed.thruster_matrix[:, 2] == pytest.approx(1.1 * vehicle.thruster_matrix[:, 2])
    assert (changed.thrust_time_constant == 0.2).all() and changed.buoyancy == 130.0


def test_what_all_delays_share_is_that_of_the_commands(vehicle, log):
    delays = nuisances(("delay",), [log])
    late = with_values(vehicle, delays, np.array([0.25 if p.plant == "velocity" else 0.1 for p in delays]))
    assert late.command_delay == pytest.approx(0.1) and late.sensor_delay == {"dvl": pytest.approx(0.15)}


def test_windows_that_tumble_or_have_gaps_are_rejected(log, vehicle):
    step = integration_step([log])
    assert step == pytest.approx(PERIOD / 2)
    rates = log.topic("angular_velocity")
    tumbling = with_values_of(log, rates.name, lambda t: np.where(t.times[:, None] > 30.0, 4.0, t.values))
    _, rejected = cut_windows([tumbling], vehicle, step, 4.0)
    assert rejected == {"it turns at more than 3 rad/s": 3}
    keep = (log.times < 10.0) | (log.times > 12.0)
    gappy = dataclasses.replace(log, times=log.times[keep], thrust=log.thrust[keep], wrench=log.wrench[keep])
    _, rejected = cut_windows([gappy], vehicle, step, 4.0)
    assert list(rejected) == ["a gap of more than 1 s in the commands"]
    with pytest.raises(IdentificationError, match="no window is left"):
        fit([dataclasses.replace(tumbling, topics=(dataclasses.replace(rates, values=rates.values + 9.0),))], vehicle,
            free_parameters(vehicle, FREE))  # fmt: skip


def test_time_before_the_first_and_after_the_last_command_is_left_out(log, vehicle):
    """A vehicle that is held there moves as no model says."""
    step = integration_step([log])
    late = (log.times >= 13.0) & (log.times < 33.0)
    thrust, wrench = (np.where(late[:, None], x, 0.002 * x) for x in (log.thrust, log.wrench))
    windows, rejected = cut_windows([dataclasses.replace(log, thrust=thrust, wrench=wrench)], vehicle, step, 4.0)
    assert 13.0 <= windows[0].begin < 14.5 and windows[-1].begin + 0.6 * 4.0 < 33.5
    assert rejected == {
        "no thruster works before or after it: the vehicle may be held": 3 + int((log.times[-1] - 33) / 4)
    }
    still = dataclasses.replace(log, thrust=0.0 * log.thrust, wrench=0.0 * log.wrench)
    assert len(cut_windows([still], vehicle, step, 4.0)[0]) == len(cut_windows([log], vehicle, step, 4.0)[0])


def test_held_out_runs_have_the_mean_nuisances(log):
    """Currents of fitted runs belong to no other run."""
    free = nuisances(("current", "scale"), [log, log])
    values = np.array([0.1 if "x of run 1" in p.name else -0.3 if "x of run 2" in p.name else 0.02 for p in free])
    shared, means = with_mean_nuisances(free, values)
    assert {p.name: x for p, x in zip(shared, means, strict=True)} == pytest.approx({
        "current x": -0.1, "current y": 0.02, "DVL scale error": 0.02,
    })  # fmt: skip
    assert all(p.run is None for p in shared)


def test_noise_is_estimated_from_fourth_differences():
    rng = np.random.default_rng(0)
    times = np.arange(0.0, 60.0, 0.1)
    smooth = np.stack([np.sin(0.5 * times)] * 3, axis=1)
    topic = make_topic("velocity", times, smooth + 0.02 * rng.standard_normal(smooth.shape))
    assert topic.noise == pytest.approx(np.full(3, 0.02), rel=0.15)


@pytest.mark.parametrize(("correlation", "refused"), [(0.89, False), (-0.89, False), (0.91, True), (-0.91, True)])
def test_inseparable_delay_and_lag_are_rejected_by_name(vehicle, log, correlation, refused):
    keys = ("thrusters.time_constant",)
    parameters = [*free_parameters(vehicle, keys), *nuisances(("delay",), [log])]
    lag = next(i for i, p in enumerate(parameters) if p.kind == "lag")
    delay = next(i for i, p in enumerate(parameters) if p.kind == "delay")
    matrix = np.eye(len(parameters))
    matrix[lag, delay] = matrix[delay, lag] = correlation
    estimate = SimpleNamespace(parameters=parameters, intervals=SimpleNamespace(correlation=matrix))
    if not refused:
        require_distinguishable(estimate)
        return
    with pytest.raises(IdentificationError, match=r"are not separated by these runs \(correlation 0\.91\)") as error:
        require_distinguishable(estimate)
    assert parameters[lag].name in str(error.value) and parameters[delay].name in str(error.value)
