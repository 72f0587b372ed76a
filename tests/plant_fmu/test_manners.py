"""Rejections of the FMU: a message that names the variable, and an unchanged state."""

import ctypes
import math

import pytest
from fmpy.fmi1 import FMICallException

from plant_fmu import load_vehicle
from plant_fmu.build import cached_fmu
from tests.plant_fmu.conftest import STATES, CoSimulationInstance


def refused(slave, call, *words):
    slave.said.clear()
    with pytest.raises(FMICallException):
        call()
    text = " ".join(message for _, message in slave.said)
    assert slave.said, "nothing was logged"
    assert all(status >= 3 for status, _ in slave.said)
    for word in words:
        assert word in text


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["thrust[3]", "wrench.M", "mass", "position.x"])
def test_nan_and_infinity_are_rejected(make_slave, fmi, name, value):
    slave = make_slave(fmi=fmi)
    before = slave.get(name)
    refused(slave, lambda: slave.set_values({name: value}), name, "not a finite number")
    assert slave.get(name) == before


@pytest.mark.parametrize(
    ("name", "value"),
    [("mass", -1e9), ("mass", 0.0), ("thrust_time_constant[1]", -0.1), ("quadratic_damping[2]", -1.0), ("substep", 0.0),
     ("weight", -1.0), ("wrench_force_limit", -1.0), ("quaternion.e0", 2.5), ("thrust[1]", 1e10)],
)  # fmt: skip
def test_values_out_of_range_are_refused(make_slave, fmi, name, value):
    slave = make_slave(fmi=fmi)
    refused(slave, lambda: slave.set_values({name: value}), name, "outside [")


def test_rejected_value_leaves_all_values_unchanged(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    refused(slave, lambda: slave.set_values({"weight": 1.0, "mass": -1.0}), "mass")
    assert slave.get("weight") == [1226.25]


REFUSALS = {
    "a mass matrix that is not positive definite": (
        None,
        lambda slave: slave.start(**{"added_mass[1,2]": 1e6}),
        ["positive definite"],
    ),
    "setting an output": (
        None,
        lambda slave: slave.set_values({"attitude.roll": 0.1}),
        ["attitude.roll", "calculated"],
    ),
    "stepping before initialization": (None, lambda slave: slave.step(0.1), ["before initialization"]),
    "an unknown log category": (
        None,
        lambda slave: slave.fmu.setDebugLogging(True, ["logEverything"]),
        ['log category "logEverything" is unknown'],
    ),
    "setting a state after initialization": (
        {},
        lambda slave: slave.set_values({"position.x": 1.0}),
        ["position.x", "initialization"],
    ),
    "a step from another time": ({}, lambda slave: slave.fmu.doStep(5.0, 0.1), ["the plant is at 0"]),
    "a step of too many substeps": ({}, lambda slave: slave.fmu.doStep(0.0, 1e9), ["substeps"]),
    "a step of too many samples": (
        {"substep": 1.0, "depth_sensor.rate": 9e3},
        lambda slave: slave.fmu.doStep(0.0, 200.0),
        ["1.8e+06 substeps", "rates of sensors"],
    ),
    **{
        f"a step of {step} s": ({}, lambda slave, step=step: slave.fmu.doStep(0.0, step), ["step size"])
        for step in (0.0, -0.1, math.nan, math.inf)
    },
}


@pytest.mark.parametrize(("start", "call", "words"), REFUSALS.values(), ids=REFUSALS)
def test_calls_are_refused_with_their_reason(make_slave, fmi, start, call, words):
    slave = make_slave(fmi=fmi)
    if start is not None:
        slave.start(**start)
    refused(slave, lambda: call(slave), *words)


def test_invalid_tunable_parameter_rejects_the_step(make_slave, fmi):
    slave = make_slave(fmi=fmi).start()
    slave.set_values({"thrust_min[1]": 30.0})
    refused(slave, lambda: slave.step(0.1), "thrust_min[1] = 30 is above thrust_max[1] = 27")


def test_quaternion_must_have_a_direction(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    slave.set_values({"quaternion.e0": 0.0})
    assert slave.get("attitude.roll", "attitude.pitch", "attitude.yaw") == [0.0, 0.0, 0.0]  # and no NaN
    refused(slave, slave.start, "quaternion")


def test_valid_start_logs_nothing(make_slave, fmi):
    said = make_slave(fmi=fmi, logging_on=True).start().said
    assert [text for status, text in said if status > 0] == []


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"wrench.X": 9e8}, "substep"),
        ({"wrench.K": 1e5}, "substep"),  # finite and within range, yet wrong: the damping outruns the step
        ({"wrench.K": 2.99e6}, "substep"),
        ({"wrench.K": 1e9}, "substep"),
        ({"linear_damping[1]": 2e5, "wrench.X": 10.0}, "substep"),
    ],
)  # fmt: skip
def test_unstable_step_is_rejected_and_leaves_the_state(make_slave, fmi, change, words):
    slave = make_slave("bluerov2_heavy", fmi).start()
    rest = dict(zip(change, slave.get(*change), strict=True))
    slave.set_values(change)
    before = slave.get(*STATES)
    refused(slave, lambda: slave.fmu.doStep(0.0, 0.05), "not taken", words)
    assert slave.get(*STATES) == before
    slave.set_values(rest)
    slave.fmu.doStep(0.0, 0.05)  # and goes on


def test_step_out_of_range_is_rejected_and_leaves_the_state(make_slave, fmi):
    slave = make_slave(fmi=fmi).start(**{"position.x": 999_999.0, "velocity.u": 100.0})
    refused(slave, lambda: slave.step(0.1), "position.x becomes 10000", "outside [-1000000, 1000000]")
    assert slave.get("position.x") == [999_999.0]


def test_no_step_beyond_the_stop_time(make_slave):
    slave = make_slave(fmi=3)
    slave.fmu.enterInitializationMode(startTime=0.0, stopTime=0.02)
    slave.fmu.exitInitializationMode()
    slave.step(0.01)
    slave.step(0.01 * (1 + 1e-9))  # a master's rounding
    refused(slave, lambda: slave.step(0.01), "stop time")


def test_invalid_times_are_rejected(make_slave):
    slave = make_slave(fmi=2)
    refused(slave, lambda: slave.fmu.setupExperiment(startTime=math.nan), "start time")
    refused(slave, lambda: slave.fmu.setupExperiment(startTime=1.0, stopTime=0.5), "stop time")


@pytest.mark.parametrize(("start", "stop"), [(math.nan, None), (1.0, 0.5), (0.0, math.nan), (-2e9, None)])
def test_refused_times_block_initialization(make_slave, fmi, start, stop):
    """Until valid times are set: an importer that ignores the status must not run at rejected times."""
    slave = make_slave(fmi=fmi)
    if fmi == 2:
        with pytest.raises(FMICallException):
            slave.fmu.setupExperiment(startTime=start, stopTime=stop)
        state = slave.save()
        for _ in range(2):
            said = "entering initialization: start and stop time were refused"
            refused(slave, slave.fmu.enterInitializationMode, said)
            slave.restore(state)  # which keeps it
        slave.free(state)
        slave.fmu.setupExperiment(startTime=1.0)
        slave.fmu.enterInitializationMode()
    else:
        with pytest.raises(FMICallException):
            slave.fmu.enterInitializationMode(startTime=start, stopTime=stop)
        refused(slave, slave.fmu.exitInitializationMode, "leaving initialization: not allowed before initialization")
        slave.fmu.enterInitializationMode(startTime=1.0)
    slave.fmu.exitInitializationMode()


def test_a_reset_forgets_refused_times(make_slave):
    slave = make_slave(fmi=2)
    with pytest.raises(FMICallException):
        slave.fmu.setupExperiment(startTime=math.nan)
    slave.fmu.reset()
    slave.fmu.enterInitializationMode()


def test_initialization_is_entered_once(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    slave.fmu.enterInitializationMode()
    said = "entering initialization: it was entered already and has not ended"
    refused(slave, slave.fmu.enterInitializationMode, said)
    slave.fmu.exitInitializationMode()  # the first counts
    said = "entering initialization: not allowed once initialization has ended"
    refused(slave, slave.fmu.enterInitializationMode, said)


def test_reading_no_variables_succeeds(make_slave):
    assert make_slave(fmi=2).fmu.getInteger([]) == []
    assert make_slave(fmi=3).fmu.getInt32([]) == []


def test_wrong_token_is_rejected(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    slave.fmu.guid = "{not this one}"
    with pytest.raises(Exception, match="Failed to instantiate"):
        slave.fmu.instantiate()


def test_unsupported_functions_are_logged(make_slave):
    slave = make_slave(fmi=3).start()
    refused(slave, slave.fmu.enterConfigurationMode, "fmi3EnterConfigurationMode", "not offered")


def test_reset_restores_start_values(make_slave, fmi):
    slave = make_slave(fmi=fmi).start(**{"position.z": 3.0})
    fresh = slave.get(*STATES)
    slave.step(1.0)
    slave.fmu.reset()
    slave.time = 0.0
    slave.start(**{"position.z": 3.0})
    assert slave.get(*STATES) == fresh


def test_start_time_is_arbitrary_and_step_times_may_be_accumulated(make_slave):
    slave = make_slave(fmi=3)
    slave.fmu.enterInitializationMode(startTime=100.0)
    slave.fmu.exitInitializationMode()
    slave.time = 100.0
    for _ in range(20_000):  # 0.1 is no binary fraction
        slave.step(0.1)
    assert slave.time != 2100.0


def test_both_fmi_versions_give_identical_results(make_slave):
    ends = []
    for fmi in (2, 3):
        slave = make_slave("bluerov2_heavy", fmi).start(**{"velocity.p": 0.3})
        slave.set_values({"thrust[1]": 12.0})
        for _ in range(200):
            slave.step(0.013)
        ends.append(slave.get(*STATES))
    assert ends[0] == ends[1]


def test_instances_do_not_disturb_each_other():
    path = cached_fmu(load_vehicle("odin"), 3)
    slaves = [CoSimulationInstance(path).start(**{"position.z": float(i)}) for i in range(3)]
    for slave in slaves:
        slave.step(0.1)
    assert [round(slave.get("position.z")[0]) for slave in slaves] == [0, 1, 2]
    for slave in slaves:
        slave.close()


# ---- logging ----


def test_log_categories_are_enabled_on_request(make_slave, fmi):
    """Errors and warnings always; the rest when logging is on, or its category."""
    quiet, loud = make_slave(fmi=fmi), make_slave(fmi=fmi, logging_on=True)
    for slave in (quiet, loud):
        slave.start(**{"quaternion.e0": 0.5})
    warning = "quaternion of length 0.5 normalized"
    assert [text for _, text in quiet.said] == [warning]
    assert [text for _, text in loud.said] == [warning, "initialized at t = 0 s"]
    assert [status for status, _ in loud.said] == [1, 0]


def test_log_categories_are_enabled_individually(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    slave.fmu.setDebugLogging(False, [])
    slave.fmu.setDebugLogging(True, ["logEvents"])
    slave.start(**{"quaternion.e0": 0.5})
    assert [text for _, text in slave.said] == ["initialized at t = 0 s"]


def test_null_log_category_is_rejected(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    names = (ctypes.c_char_p * 2)(b"logAll", None)
    said = 'log category "NULL" is unknown'
    refused(slave, lambda: getattr(slave.fmu, f"fmi{fmi}SetDebugLogging")(slave.fmu.component, True, 2, names), said)


def test_described_categories_are_those_that_are_known(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    described = [category.name for category in slave.description.logCategories]
    assert {"logEvents", "logStatusError", "logAll"} <= set(described)
    slave.fmu.setDebugLogging(True, described)


def test_errors_are_silent_once_switched_off(make_slave, fmi):
    slave = make_slave(fmi=fmi).start()
    slave.fmu.setDebugLogging(False, [])
    with pytest.raises(FMICallException):
        slave.set_values({"mass": -1.0})
    assert slave.said == []


def test_zero_length_calls_succeed(make_slave, fmi):
    """Of types that the plant has not, too."""
    slave = make_slave(fmi=fmi).start()
    names = ["fmi2GetString", "fmi2SetString"] if fmi == 2 else ["fmi3GetFloat32", "fmi3GetClock", "fmi3SetUInt64"]
    for name in names:
        assert (
            slave.fmu.dll[name](
                ctypes.c_void_p(slave.fmu.component), None, ctypes.c_size_t(0), None, ctypes.c_size_t(0)
            )
            == 0
        )


@pytest.mark.parametrize(
    ("event_mode", "n", "said"),
    [
        (True, 0, "this FMU has no event mode in co-simulation (eventModeUsed)"),  # as it says that it has none
        (False, 1, "requiredIntermediateVariables is NULL"),
    ],
)
def test_unsupported_co_simulation_features_are_rejected_at_instantiation(make_slave, event_mode, n, said):
    slave = make_slave()
    heard = []
    callback = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)(
        lambda environment, status, category, text: heard.append(text.decode())
    )
    instantiate = slave.fmu.dll["fmi3InstantiateCoSimulation"]
    instantiate.restype = ctypes.c_void_p
    off, used, nothing = ctypes.c_bool(False), ctypes.c_bool(event_mode), ctypes.c_void_p()
    token = slave.description.guid.encode()
    made = instantiate(b"x", token, None, off, off, used, off, None, ctypes.c_size_t(n), nothing, callback, nothing)
    assert made is None
    assert heard == [said]
