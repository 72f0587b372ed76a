"""Model exchange: the same plant under an importer's own integrator."""

import ctypes
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy import simulate_fmu

from plant_fmu import load_vehicle
from plant_fmu.build import cached_fmu
from tests.plant_fmu.conftest import STATES, refused

MOVING = {
    "velocity.u": 0.4, "velocity.v": -0.3, "velocity.r": 0.3, "position.z": 2.0, "current.x": 0.2, "wrench.X": 20.0,
    "wrench.Z": -8.0, "wrench.K": 3.0, "wrench.N": 4.0, "thrust[1]": 12.0, "thrust[6]": -9.0,
}  # fmt: skip
LAGS = {"thrust_time_constant[1]": 0.3, "thrust_rate_limit[6]": 15.0, "wrench_time_constant": 0.5}
BOTTOM = {"current_shear.y": 0.1, "bottom_depth": 3.0, "hull_radius": 0.3}
DRIFT = {"current_variation.x": 0.3, "current_variation.y": 0.2, "seed": 5,
         "current_correlation_time": 4.0, "current_variation_period": 0.37}  # fmt: skip


def by_cvode(fmi, values, end, interval, output):
    """Run the model in FMPy with CVODE; return the recorded outputs."""
    return simulate_fmu(
        str(cached_fmu(load_vehicle("odin"), fmi)), fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-10,
        stop_time=end, output_interval=interval, start_values=values, output=output,
    )  # fmt: skip


@pytest.mark.medium(fast=4)
@pytest.mark.parametrize(
    ("more", "tolerance"),
    # knots of a drifting current are time events, the same for any integrator; a contact has kinks
    [({}, 1e-7), (LAGS, 1e-7), (DRIFT, 1e-7), (BOTTOM, 1e-4)],
    ids=["plain", "lags", "drift", "bottom"],
)
def test_cvode_ends_where_co_simulation_does(make_slave, fmi, more, tolerance):
    interval = 0.01 if more is DRIFT else 1.0
    result = by_cvode(fmi, MOVING | more, 10.0, interval, [*STATES, "water_velocity.x"])
    slave = make_slave(fmi=fmi).start(**MOVING, **more, substep=0.0025)
    for k in range(1000):
        slave.fmu.doStep(k * 0.01, 0.01)
    ends = np.array([result[name][-1] for name in STATES])
    assert np.abs(ends - slave.get(*STATES)).max() < tolerance
    assert more is not DRIFT or np.std(result["water_velocity.x"]) > 0.02


def test_samples_are_the_same_in_both(make_slave, fmi):
    noisy = {"depth_sensor.rate": 4.0, "depth_sensor.noise": 0.1, "seed": 3}
    result = by_cvode(fmi, MOVING | noisy, 5.0, 0.1, ["measured.depth"])
    slave = make_slave(fmi=fmi).start(**MOVING, **noisy)
    found = dict(zip(np.round(result["time"], 9), result["measured.depth"], strict=True))  # after the event, the last
    for k in range(51):
        if k % 5:  # not at the time of a sample
            assert found[round(k * 0.1, 9)] == pytest.approx(slave.get("measured.depth")[0], abs=1e-7)
        slave.fmu.doStep(k * 0.1, 0.1)


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
    refused(model, lambda: model.set_values({"mass": 140.0}), "mass: not allowed in continuous-time mode")


def test_states_may_also_be_set_one_by_one(make_model):
    """As CasADi does, which calls neither fmi2SetContinuousStates nor fmi3SetContinuousStates."""
    model = make_model()
    model.set_values({"position.x": 1.0})
    refused(model, lambda: model.set_values({"position.x": 1e7}), "position.x")
    assert model.get("position.x") == [1.0]


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e7])
def test_invalid_states_are_discarded(make_model, value):
    """The status makes an integrator try a shorter step; the model is unchanged."""
    model = make_model()
    x = model.states()
    refused(model, lambda: model.put_states(np.r_[value, x[1:]]), "position.x", "discarded", status=2)
    assert model.said[-1][0] == 2
    assert (model.states() == x).all() and np.isfinite(model.rates()).all()


def test_time_before_the_start_is_rejected(make_slave, fmi):
    model = make_slave(fmi=fmi, interface="me")
    model.begin(5.0)
    for time in (5.0, 6.0, 5.0):
        model.fmu.setTime(time)
    for time in (4.999, -1.0):
        said = f"time is {time:g} s, expected the start time of 5 s or later"
        refused(model, lambda: model.fmu.setTime(time), said)  # noqa: B023
    state = model.save()
    assert model.get("time" if fmi == 3 else "position.x") == [5.0 if fmi == 3 else 0.0]
    model.fmu.reset()
    model.restore(state)  # with its start
    refused(model, lambda: model.fmu.setTime(4.0), "expected the start time")
    model.free(state)


def test_interfaces_reject_functions_of_the_other(make_slave, fmi):
    slave, model = make_slave(fmi=fmi).start(), make_slave(fmi=fmi, interface="me").start()
    nothing = [ctypes.byref(ctypes.c_double())] * 4 if fmi == 3 else []
    step = (ctypes.c_double(0.0), ctypes.c_double(0.1), 1, *nothing)
    for unit, function, arguments, said in (
        (model, "DoStep", step, "stepping: not offered in model exchange"),
        (slave, "EnterContinuousTimeMode", (), "entering continuous-time mode: not offered in co-simulation"),
        (slave, "EnterEventMode", (), "entering event mode: not offered in co-simulation"),
    ):
        assert unit.fmu.dll[f"fmi{fmi}{function}"](ctypes.c_void_p(unit.fmu.component), *arguments) == 3
        assert unit.said[-1][1] == said


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
    elements = root.findall(".//*[@reinit='true']" + ("" if fmi == 3 else "/.."))
    assert len(elements) == 14 and all(e.get("name").startswith("actuator.") for e in elements)


def test_event_mode_may_be_entered_again_in_fmi_2(make_slave, fmi):
    model = make_slave(fmi=fmi, interface="me").start()
    if fmi == 2:
        model.fmu.enterEventMode()
    else:
        refused(model, model.fmu.enterEventMode)


def test_nominals_are_those_of_the_description(make_slave, fmi):
    model = make_slave(fmi=fmi, interface="me").start()
    described = [float(u.variable.derivative.nominal) for u in model.description.derivatives]
    found = np.zeros(27)
    model.fmu.getNominalsOfContinuousStates(found.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), 27)
    assert found.tolist() == described
    refused(model, lambda: model.rates(5), "5 values, expected 27")
