"""Rejections of the FMU: a message that names the variable, and an unchanged state."""

import ctypes
import math

import pytest
from fmpy.fmi1 import FMICallException

from tests.plant_fmu.conftest import STATES, CoSimulationInstance, refused

OUT_OF_RANGE = {
    "mass": (-1e9, 0.0), "thrust_time_constant[1]": (-0.1,), "quadratic_damping[2]": (-1.0,), "substep": (0.0,),
    "weight": (-1.0,), "wrench_force_limit": (-1.0,), "quaternion.e0": (2.5,), "thrust[1]": (1e10,),
    "thrust_dead_band[1]": (1.0,), "thrust_curve[2]": (1.5,), "thrust_rate_limit[3]": (-1.0,),
    "thrust_effectiveness[4]": (1.1,),
}  # fmt: skip
NOT_FINITE = dict.fromkeys(["thrust[3]", "wrench.M", "mass", "position.x"], (math.nan, math.inf, -math.inf))


@pytest.mark.parametrize(("table", "words"), [(OUT_OF_RANGE, "outside ["), (NOT_FINITE, "not a finite number")])
def test_refused_values_leave_all_values_unchanged(make_slave, fmi, table, words):
    slave = make_slave(fmi=fmi)
    for name, values in table.items():
        before = slave.get(name, "buoyancy")
        for value in values:
            refused(slave, lambda: slave.set_values({"buoyancy": 1.0, name: value}), name, words)  # noqa: B023
            assert slave.get(name, "buoyancy") == before


def null_category(slave):
    names = (ctypes.c_char_p * 2)(b"logAll", None)
    getattr(slave.fmu, f"fmi{slave.fmi}SetDebugLogging")(slave.fmu.component, True, 2, names)


# start values (None: uninitialized), values set then, the call, words of its message
REFUSALS = [
    (None, {"added_mass[1,2]": 1e6}, CoSimulationInstance.start, ["positive definite"]),
    (None, {"quaternion.e0": 0.0}, CoSimulationInstance.start, ["quaternion"]),
    (None, {"dvl.velocity_noise": 0.1}, CoSimulationInstance.start, ["dvl.velocity_noise = 0.1 needs the sensor's r"]),
    (None, {"dvl.delay": 0.1}, CoSimulationInstance.start, ["dvl.delay = 0.1 needs the sensor's rate"]),
    (None, {"imu.rate": 100.0, "imu.delay": 0.1}, CoSimulationInstance.start,
     ["imu.delay = 0.1 s at 100 Hz leaves more than 8 samples undelivered"]),
    (None, {"free_surface": True, "hull_radius": 0.0}, CoSimulationInstance.start, ["free_surface needs hull_radius"]),
    (None, {}, lambda slave: slave.set(**{"attitude.roll": 0.1}), ["attitude.roll", "calculated"]),
    (None, {}, lambda slave: slave.step(0.1), ["before initialization"]),
    (None, {}, null_category, ['log category "NULL" is unknown']),
    (None, {}, lambda slave: slave.fmu.setDebugLogging(True, ["logEverything"]),
     ['log category "logEverything" is unknown']),
    ({}, {}, lambda slave: slave.set(**{"position.x": 1.0}), ["position.x", "initialization"]),
    ({}, {}, lambda slave: slave.fmu.doStep(5.0, 0.1), ["the plant is at 0"]),
    ({}, {}, lambda slave: slave.step(1e9), ["substeps"]),
    ({"substep": 1.0, "depth_sensor.rate": 9e3}, {}, lambda slave: slave.step(200.0),
     ["1.8e+06 substeps", "rates of sensors"]),
    ({}, {"thrust_min[1]": 30.0}, lambda slave: slave.step(0.1), ["thrust_min[1] = 30 is above thrust_max[1] = 27"]),
    *(({}, {}, lambda slave, h=h: slave.step(h), ["step size"]) for h in (0.0, -0.1, math.nan, math.inf)),
    ({"position.x": 999_999.0, "velocity.u": 100.0}, {}, lambda slave: slave.step(0.1),
     ["position.x becomes 10000", "outside [-1000000, 1000000]"]),
]  # fmt: skip


@pytest.mark.parametrize(("start", "values", "call", "words"), REFUSALS)
def test_calls_are_refused_with_their_reason(make_slave, fmi, start, values, call, words):
    slave = make_slave(fmi=fmi)
    if start is not None:
        slave.start(**start)
    slave.set_values(values)
    before = slave.get(*STATES)
    refused(slave, lambda: call(slave), *words)
    assert slave.get(*STATES) == before


def test_angles_of_a_zero_quaternion_are_zero(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    slave.set_values({"quaternion.e0": 0.0})
    assert slave.get("attitude.roll", "attitude.pitch", "attitude.yaw") == [0.0, 0.0, 0.0]  # and no NaN


def test_valid_start_logs_nothing(make_slave, fmi):
    said = make_slave(fmi=fmi, logging_on=True).start().said
    assert [text for status, text in said if status > 0] == []


@pytest.mark.medium
@pytest.mark.parametrize(
    "change",  # the second is finite and within range, yet wrong: the damping outruns the step
    [{"wrench.X": 9e8}, {"wrench.K": 1e5}, {"wrench.K": 2.99e6}, {"wrench.K": 1e9},
     {"linear_damping[1]": 2e5, "wrench.X": 10.0}],
)  # fmt: skip
def test_unstable_step_is_rejected_and_leaves_the_state(make_slave, fmi, change):
    slave = make_slave("bluerov2_heavy", fmi).start()
    rest = dict(zip(change, slave.get(*change), strict=True))
    slave.set_values(change)
    before = slave.get(*STATES)
    refused(slave, lambda: slave.fmu.doStep(0.0, 0.05), "not taken", "substep", status=2)
    assert slave.get(*STATES) == before
    slave.set_values(rest)
    slave.fmu.doStep(0.0, 0.05)  # and goes on


def test_no_step_beyond_the_stop_time(make_slave):
    slave = make_slave().begin(stop=0.02)
    slave.step(0.01)
    slave.step(0.01 * (1 + 1e-9))  # a master's rounding
    refused(slave, lambda: slave.step(0.01), "stop time")


@pytest.mark.parametrize(
    ("name", "experiment"),
    [
        ("start time", {"startTime": math.nan}), ("stop time", {"startTime": 1.0, "stopTime": 0.5}),
        ("stop time", {"stopTime": math.nan}), ("start time", {"startTime": -2e9}), ("tolerance", {"tolerance": -1e-6}),
    ],
)  # fmt: skip
def test_refused_experiments_block_initialization(make_slave, fmi, name, experiment):
    """Until a valid one is set, or a reset: an importer that ignores the status must not run at rejected times."""
    slave = make_slave(fmi=fmi)
    if fmi == 2:
        refused(slave, lambda: slave.fmu.setupExperiment(**experiment), name)
        state = slave.save()
        for _ in range(2):
            said = "entering initialization: the experiment was refused"
            refused(slave, slave.fmu.enterInitializationMode, said)
            slave.restore(state)  # which keeps it
        slave.free(state)
        slave.fmu.setupExperiment(startTime=1.0)
        slave.fmu.enterInitializationMode()
        slave.fmu.reset()
        refused(slave, lambda: slave.fmu.setupExperiment(**experiment))
        slave.fmu.reset()
        slave.fmu.enterInitializationMode()
    else:
        refused(slave, lambda: slave.fmu.enterInitializationMode(**experiment), name)
        refused(slave, slave.fmu.exitInitializationMode, "leaving initialization: not allowed before initialization")
        slave.fmu.enterInitializationMode(startTime=1.0)
    slave.fmu.exitInitializationMode()


def test_unknown_type_of_an_fmu_is_refused(make_slave):
    slave = make_slave(fmi=2)
    fmu, callbacks = slave.fmu, ctypes.byref(slave.fmu.callbacks)
    assert not fmu.fmi2Instantiate(b"it", 7, fmu.guid.encode(), b"", callbacks, False, False)
    assert "neither model exchange nor co-simulation" in slave.said[-1][1]


def test_rounding_beyond_a_range_is_clipped(make_slave, fmi):
    """Up to 1e-9; a message has all digits, so that the value and the end of the range do not look the same."""
    slave, name = make_slave(fmi=fmi), "thrust_effectiveness[1]"
    for value, kept in ((math.nextafter(1.0, 2.0), 1.0), (-5e-10, 0.0), (0.3, 0.3)):
        slave.set_values({name: value})
        assert slave.get(name) == [kept]
    refused(slave, lambda: slave.set_values({name: 1.00000001}), "= 1.0000000099999999 refused: outside [0, 1]")


def test_initialization_is_entered_once(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    slave.fmu.enterInitializationMode()
    said = "entering initialization: it was entered already and has not ended"
    refused(slave, slave.fmu.enterInitializationMode, said)
    slave.fmu.exitInitializationMode()  # the first counts
    said = "entering initialization: not allowed once initialization has ended"
    refused(slave, slave.fmu.enterInitializationMode, said)


def test_wrong_token_is_rejected(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    slave.fmu.guid = "{not this one}"
    with pytest.raises(Exception, match="Failed to instantiate"):
        slave.fmu.instantiate()


def test_unsupported_functions_are_logged(make_slave):
    slave = make_slave(fmi=3).start()
    refused(slave, slave.fmu.enterConfigurationMode, "fmi3EnterConfigurationMode", "not offered")


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


def test_described_categories_are_those_that_are_known(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    described = [category.name for category in slave.description.logCategories]
    assert {"logEvents", "logStatusError", "logAll"} <= set(described)
    slave.fmu.setDebugLogging(True, described)


def test_log_categories_are_switched_individually(make_slave, fmi):
    slave = make_slave(fmi=fmi)
    slave.fmu.setDebugLogging(False, [])
    with pytest.raises(FMICallException):
        slave.set_values({"mass": -1.0})
    assert slave.said == []
    slave.fmu.setDebugLogging(True, ["logEvents"])
    slave.start(**{"quaternion.e0": 0.5})
    assert [text for _, text in slave.said] == ["initialized at t = 0 s"]


def test_zero_length_calls_succeed(make_slave, fmi):
    """Of types that the plant has not, too."""
    slave = make_slave(fmi=fmi).start()
    none = None, ctypes.c_size_t(0)
    for name in {2: ["GetInteger", "GetString", "SetString"], 3: ["GetInt32", "GetFloat32", "GetClock", "SetUInt64"]}[
        fmi
    ]:
        assert slave.fmu.dll[f"fmi{fmi}{name}"](ctypes.c_void_p(slave.fmu.component), *none, *none) == 0


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
