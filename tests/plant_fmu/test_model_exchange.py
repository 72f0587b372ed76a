"""Model exchange: the same plant under an importer's own integrator."""

import ctypes
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException
from scipy.integrate import solve_ivp

from plant_fmu import load_vehicle
from plant_fmu.build import cached_fmu
from tests.plant_fmu.conftest import STATES

MOVING = {
    "velocity.u": 0.4, "velocity.v": -0.3, "velocity.r": 0.3, "position.z": 2.0, "current.x": 0.2, "wrench.X": 20.0,
    "wrench.Z": -8.0, "wrench.K": 3.0, "wrench.N": 4.0, "thrust[1]": 12.0, "thrust[6]": -9.0,
}  # fmt: skip
LAGS = {"thrust_time_constant[1]": 0.3, "thrust_rate_limit[6]": 15.0, "wrench_time_constant": 0.5}


def by_cvode(fmi, values, end, interval, output):
    """Run the model in FMPy with CVODE; return the recorded outputs."""
    return simulate_fmu(
        str(cached_fmu(load_vehicle("odin"), fmi)), fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-10,
        stop_time=end, output_interval=interval, start_values=values, output=output,
    )  # fmt: skip


def end_of(result):
    return np.array([result[name][-1] for name in STATES])


def cosimulated(make_slave, fmi, values, end, step=0.01, **more):
    slave = make_slave(fmi=fmi).start(**values, **more)
    for k in range(round(end / step)):
        slave.fmu.doStep(k * step, step)
    return slave


@pytest.mark.medium(fast=3)
@pytest.mark.parametrize("more", [{}, LAGS, {"current_shear.y": 0.1, "bottom_depth": 3.0, "hull_radius": 0.3}])
def test_cvode_ends_where_co_simulation_does(make_slave, fmi, more):
    result = by_cvode(fmi, MOVING | more, 10.0, 1.0, STATES)
    slave = cosimulated(make_slave, fmi, MOVING | more, 10.0, substep=0.0025)
    tolerance = 1e-7 if "bottom_depth" not in more else 1e-4  # the contact's kinks
    assert np.abs(end_of(result) - slave.get(*STATES)).max() < tolerance


def test_a_drifting_current_is_the_same_in_both(make_slave, fmi):
    """Its knots are time events: the same values at the same times for any integrator."""
    drift = {"current_variation.x": 0.3, "current_variation.y": 0.2, "seed": 5}
    drift |= {"current_correlation_time": 4.0, "current_variation_period": 0.37}
    result = by_cvode(fmi, MOVING | drift, 10.0, 0.01, [*STATES, "water_velocity.x"])
    slave = cosimulated(make_slave, fmi, MOVING | drift, 10.0, substep=0.0025)
    assert np.abs(end_of(result) - slave.get(*STATES)).max() < 1e-7
    assert np.std(result["water_velocity.x"]) > 0.02


def test_samples_are_the_same_in_both(make_slave, fmi):
    noisy = {"depth_sensor.rate": 4.0, "depth_sensor.noise": 0.1, "seed": 3}
    result = by_cvode(fmi, MOVING | noisy, 5.0, 0.1, ["measured.depth"])
    slave = make_slave(fmi=fmi).start(**MOVING, **noisy)
    rows = [slave.get("measured.depth")[0]]
    for k in range(50):
        slave.fmu.doStep(k * 0.1, 0.1)
        rows.append(slave.get("measured.depth")[0])
    times, first = np.unique(np.round(result["time"], 9), return_index=True)
    last = np.r_[first[1:], len(result)] - 1  # after the event, where one falls on the time
    at = {t: result["measured.depth"][i] for t, i in zip(times, last, strict=True)}
    ours = {round(k * 0.1, 9): x for k, x in enumerate(rows)}
    off_grid = [t for t in ours if abs(t * 4 - round(t * 4)) > 1e-6]
    assert len(off_grid) > 30
    assert [at[t] for t in off_grid] == pytest.approx([ours[t] for t in off_grid], abs=1e-7)


@pytest.mark.medium(fast=1)
def test_scipy_integrates_the_derivatives(make_model, make_slave, fmi):
    """Through the plain functions alone: set time, set states, get derivatives."""
    model = make_model(**MOVING, **LAGS)

    def rates(t, x):
        model.fmu.setTime(t)
        model.put_states(x)
        return model.rates()

    end = solve_ivp(rates, (0.0, 5.0), model.states(), method="DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
    slave = cosimulated(make_slave, fmi, MOVING | LAGS, 5.0, substep=0.0025)
    assert np.abs(end[:13] - slave.get(*STATES)).max() < 1e-7


def test_events_occur_on_the_sample_grid(make_slave, fmi):
    model = make_slave(fmi=fmi, interface="me").start(**{"compass.rate": 8.0, "usbl.rate": 3.0})
    changed, following = model.update_discrete()
    times = []
    for _ in range(11):
        times.append(following)
        model.fmu.enterContinuousTimeMode()
        model.fmu.setTime(following)
        model.fmu.enterEventMode()
        changed, following = model.update_discrete()
        assert not changed
    assert times == pytest.approx(
        sorted({k / 8 for k in range(1, 9)} | {k / 3 for k in range(1, 4)} | {9 / 8}), rel=1e-12
    )


def test_a_lag_switched_on_starts_from_the_present_force(make_slave, fmi):
    model = make_slave(fmi=fmi, interface="me").start()
    assert model.update_discrete() == (False, None)
    model.set_values({"thrust[1]": 20.0})
    assert model.update_discrete() == (True, None)  # the command is followed at once
    model.fmu.enterContinuousTimeMode()
    model.set_values({"thrust[1]": 10.0})
    model.fmu.enterEventMode()
    model.set_values({"thrust_time_constant[1]": 0.5, "thrust[1]": -10.0})
    model.update_discrete()
    assert model.get("thruster_force[1]", "der(actuator.thrust[1])") == [10.0, -40.0]


def test_parameters_change_only_in_event_mode(make_slave, fmi):
    model = make_slave(fmi=fmi, interface="me").start()
    model.set_values({"mass": 130.0})
    model.update_discrete()
    model.fmu.enterContinuousTimeMode()
    model.set_values({"thrust[1]": 3.0})
    with pytest.raises(FMICallException):
        model.set_values({"mass": 140.0})
    assert "mass: not allowed in continuous-time mode" in model.said[-1][1]


def test_states_may_also_be_set_one_by_one(make_model):
    """As CasADi does, which calls neither fmi2SetContinuousStates nor fmi3SetContinuousStates."""
    model = make_model()
    model.set_values({"position.x": 1.0})
    assert model.get("position.x") == [1.0]
    with pytest.raises(FMICallException):
        model.set_values({"position.x": 1e7})
    assert model.get("position.x") == [1.0]


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e7])
def test_invalid_states_are_discarded(make_model, value):
    """The status makes an integrator try a shorter step; the model is unchanged."""
    model = make_model()
    x = model.states()
    with pytest.raises(FMICallException) as caught:
        model.put_states(np.r_[value, x[1:]])
    assert caught.value.status == 2
    assert "position.x" in model.said[-1][1] and "discarded" in model.said[-1][1]
    assert (model.states() == x).all()
    assert np.isfinite(model.rates()).all()


def test_time_before_the_start_is_rejected(make_slave, fmi):
    model = make_slave(fmi=fmi, interface="me")
    model.begin(5.0)
    for time in (5.0, 6.0, 5.0):
        model.fmu.setTime(time)
    for time in (4.999, -1.0):
        with pytest.raises(FMICallException):
            model.fmu.setTime(time)
        assert model.said[-1][1] == f"time is {time:g} s, expected the start time of 5 s or later"
    state = model.save()
    assert model.get("time" if fmi == 3 else "position.x") == [5.0 if fmi == 3 else 0.0]
    model.fmu.reset()
    model.restore(state)  # with its start
    with pytest.raises(FMICallException):
        model.fmu.setTime(4.0)
    model.free(state)


def test_the_wrong_number_of_states_is_refused(make_slave, fmi):
    model = make_slave(fmi=fmi, interface="me").start()
    with pytest.raises(FMICallException):
        model.rates(5)
    assert "5 values, expected 27" in model.said[-1][1]


def test_interfaces_reject_functions_of_the_other(make_slave, fmi):
    slave, model = make_slave(fmi=fmi).start(), make_slave(fmi=fmi, interface="me").start()
    version = f"fmi{fmi}"
    step = model.fmu.dll[f"{version}DoStep"]
    nothing = [ctypes.byref(ctypes.c_double())] * 4 if fmi == 3 else []
    assert step(ctypes.c_void_p(model.fmu.component), ctypes.c_double(0.0), ctypes.c_double(0.1), 1, *nothing) == 3
    assert model.said[-1][1] == "stepping: not offered in model exchange"
    for function, action in (
        ("EnterContinuousTimeMode", "entering continuous-time mode"),
        ("EnterEventMode", "entering event mode"),
    ):
        assert slave.fmu.dll[f"{version}{function}"](ctypes.c_void_p(slave.fmu.component)) == 3
        assert slave.said[-1][1] == f"{action}: not offered in co-simulation"


def test_boolean_outputs_change_only_at_events(make_model):
    """As the standards ask of discrete variables."""
    model = make_model(hull_radius=0.3, bottom_depth=50.0)
    model.set_values({"thrust[1]": 1e3})
    x = model.states()
    x[2] = 49.9
    model.put_states(x)
    model.rates()
    assert not model.flag("thrust_saturated[1]") and not model.flag("bottom_contact")
    model.fmu.enterEventMode()
    model.update_discrete()
    assert model.flag("thrust_saturated[1]") and model.flag("bottom_contact")


def test_reinitialized_states_are_declared(make_slave, fmi):
    """Forces without a lag jump with their commands."""
    folder = make_slave(fmi=fmi, interface="me").folder
    root = ElementTree.parse(Path(folder) / "modelDescription.xml").getroot()
    parents = {child: parent for parent in root.iter() for child in parent}
    elements = [e if fmi == 3 else parents[e] for e in root.iter() if e.get("reinit") == "true"]
    assert len(elements) == 14 and all(e.get("name").startswith("actuator.") for e in elements)


def test_event_mode_may_be_entered_again_in_fmi_2(make_slave, fmi):
    model = make_slave(fmi=fmi, interface="me").start()
    if fmi == 2:
        model.fmu.enterEventMode()
        return
    with pytest.raises(FMICallException):
        model.fmu.enterEventMode()


def test_nominals_are_those_of_the_description(make_slave, fmi):
    model = make_slave(fmi=fmi, interface="me").start()
    described = [float(u.variable.derivative.nominal) for u in model.description.derivatives]
    found = np.zeros(27)
    get = model.fmu.getNominalsOfContinuousStates
    get(found.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), 27)
    assert found.tolist() == described
