"""Motions that integration cannot follow, and times at numerical limits: rejected or exact."""

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tests.plant_fmu.conftest import refused


@pytest.mark.slow
def test_step_with_unstable_stages_is_rejected(make_slave):
    """Ends may rest by chance while the stages between do not: each accepted run stays near the true speed."""
    accepted = 0
    for force in [5.0, *np.linspace(1.0, 400.0, 60)]:
        slave = make_slave("bluerov2_heavy").start(weight=131.588, substep=0.5)
        slave.set_values({"wrench.X": force})
        true = (-13.7 + np.sqrt(13.7**2 + 4 * 141.0 * force)) / (2 * 141.0)
        try:
            for _ in range(40):
                slave.step(0.5)
        except FMICallException:
            continue
        accepted += 1
        assert slave.get("velocity.u")[0] == pytest.approx(true, rel=0.1), force
    assert accepted > 0


def test_sample_ticks_continue_through_time_zero(make_slave, fmi):
    """Rounding is coarser at the start than near zero, where ticks must still come one after the other."""
    model = make_slave(fmi=fmi, interface="me")
    model.set_values({"imu.rate": 1e4})
    model.begin(-1500.0)
    _, following = model.update_discrete()
    for near in (-15.0886, -1.9999, -1e-3):
        time = near
        for _ in range(301):
            model.fmu.enterContinuousTimeMode()
            model.fmu.setTime(time)
            model.fmu.enterEventMode()
            before, (_, following) = time, model.update_discrete()
            assert following > before
            time = following


@pytest.mark.parametrize(
    ("start", "step", "force", "count"),
    [pytest.param(0.0, 0.01, 20.0, 30_000, marks=pytest.mark.medium), (1e8, 0.02, 200.0, 20), (-1e8, 0.02, 200.0, 20)],
)
def test_accumulated_step_times_miss_no_sample(make_slave, fmi, start, step, force, count):
    """Each step ends with its own sample, in minutes of steps and at late times.

    Each addition of 0.02 s to 1e8 s is 4 ns short of it, and half as many again may be those of the tick.
    """
    slave = make_slave(fmi=fmi)
    slave.set_values({"depth_sensor.rate": 1.0 / step, "wrench.Z": force, "substep": step})
    slave.begin(start)
    for _ in range(count):
        slave.step(step)
        measured, true = slave.get("measured.depth", "position.z")
        assert abs(measured - true) < 1e-7


def test_time_equals_the_step_end_near_a_tick(make_slave):
    """Eight times a tenth of a second, added up, are a last bit short of the eighth tick."""
    slave = make_slave(fmi=3).start(**{"depth_sensor.rate": 10.0})
    for _ in range(12):
        slave.step(0.1)
        assert slave.get("time") == [slave.time]


@pytest.mark.parametrize("start", [1e6, 1e8])
def test_repeated_step_is_rejected(make_slave, fmi, start):
    slave = make_slave(fmi=fmi)
    slave.begin(start)
    slave.fmu.doStep(start, 1e-3)
    for time in (start, start + 0.05):
        refused(slave, lambda: slave.fmu.doStep(time, 1e-3))  # noqa: B023


def test_time_beyond_the_representable_range_is_rejected(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    slave.begin(1e9)
    refused(slave, lambda: slave.step(1.0), "beyond 1e+09 s")


def test_outputs_of_initialization_are_those_after_it(make_slave, fmi):
    """First samples with their noise, and the current as it begins."""
    slave = make_slave(fmi=fmi)
    slave.set_values({"depth_sensor.rate": 10.0, "depth_sensor.noise": 0.1, "position.z": 5.0})
    slave.set_values({"current_variation.x": 0.5, "seed": 9})
    slave.enter()
    names = ["measured.depth", "water_velocity.x", "der(velocity.u)"]
    during = slave.get(*names)
    assert slave.jacobian(["measured.depth"], ["position.z"]) == [[1.0]]
    slave.fmu.exitInitializationMode()
    assert during == slave.get(*names)
    assert during[0] != 5.0 and during[1] != 0.0


@pytest.mark.parametrize("length", [1e-160, 1e-7])
def test_zero_quaternion_has_zero_derivatives(make_model, length):
    """Identity, whatever its last digits."""
    model = make_model(**{"velocity.u": 1.0})
    x = model.states()
    x[3:7] = [length, 0.0, 0.0, 0.0]
    model.put_states(x)
    unknowns = ["der(position.x)", "attitude.yaw", "der(velocity.w)"]
    assert not model.jacobian(unknowns, [f"quaternion.e{i}" for i in range(4)]).any()


@pytest.mark.parametrize("i", range(4))
def test_non_unit_quaternion_is_normalized_and_logged(make_slave, fmi, i):
    slave = make_slave(fmi=fmi, logging_on=True).start(**{"quaternion.e0": 0.0, f"quaternion.e{i}": 1.5})
    assert slave.said[0][1] == "quaternion of length 1.5 normalized"
    assert slave.get(f"quaternion.e{i}") == [1.0]
