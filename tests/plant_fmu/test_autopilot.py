"""The autopilot table of a vehicle file: validation, and pulses of thrusters."""

import msgspec
import pytest

from plant_fmu.autopilot import MAX_PULSE, MIN_PULSE, Autopilot, effort_of_pulse, pulse_of_effort, validate_autopilot


def require(good, key, came, expected):
    if not good:
        raise ValueError(f"{key} is {came}, expected {expected}")


def checked(**change):
    return validate_autopilot(msgspec.structs.replace(Autopilot("vectored_6dof"), **change), 4, require)


def test_each_thruster_has_a_channel_and_a_sign():
    assert checked().channels == (1, 2, 3, 4)
    assert checked().signs == (1, 1, 1, 1)
    assert checked(signs=-1).signs == (-1, -1, -1, -1)
    assert checked(signs=(1, -1, 1, -1), channels=(4, 0, 2, 1)).channels == (4, 0, 2, 1)


@pytest.mark.parametrize("change", [{"signs": 2}, {"signs": 0}, {"channels": (1, 1, 2, 3)}, {"pwm_dead_band": -1}])
def test_invalid_autopilot_parameters_are_rejected(change):
    with pytest.raises(ValueError, match=next(iter(change))):
        checked(**change)


@pytest.mark.parametrize(("neutral", "span"), [(1200, 400), (1800, 400), (1500, 700)])
def test_pulse_range_matches_speed_controller_limits(neutral, span):
    low, high = neutral - span, neutral + span
    assert low == MIN_PULSE or high == MAX_PULSE
    assert checked(pwm_neutral=neutral, pwm_span=span).pwm_span == span
    for beyond in (1, 50):
        shift = -beyond if low == MIN_PULSE else beyond
        with pytest.raises(ValueError, match="pulses of 800 to 2200 us"):
            checked(pwm_neutral=neutral + shift, pwm_span=span)


@pytest.mark.parametrize("curve", ["linear", "quadratic"])
@pytest.mark.parametrize("sign", [-1, 1])
def test_pulse_and_effort_are_inverse_functions(curve, sign):
    """Outside the dead band each is the other's inverse; beyond the ends a pulse stays at them, and NaN is neutral."""
    table = Autopilot("vectored_6dof", curve=curve)
    pulse, effort = pulse_of_effort(table, sign), effort_of_pulse(table, sign)
    for part in (-1.0, -0.64, -0.25, 0.36, 0.81, 1.0):
        assert effort(pulse(part)) == pytest.approx(part, rel=1e-12)
    ends = [table.pwm_neutral - sign * table.pwm_span, table.pwm_neutral + sign * table.pwm_span]
    assert [pulse(-1.0), pulse(1.0)] == ends == [pulse(-7.0), pulse(7.0)]
    assert pulse(0.0) == pulse(float("nan")) == table.pwm_neutral
