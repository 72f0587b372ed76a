"""The map from an autopilot's servo outputs to a vehicle's thrusters; the FMU does not contain it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

MAX_CHANNELS = 32  # greatest number of channels, those of MAVLink's longer servo packet
SHORTEST, LONGEST = 800, 2200  # us, least and greatest length of a pulse that a speed controller accepts

Curve = Callable[[float], float]  # from a servo output [us] to a part of the greatest force, -1 to 1; or the inverse


@dataclass(frozen=True)
class Autopilot:
    """The table ``autopilot`` of a vehicle's file."""

    frame: str  # the autopilot's name for the arrangement of the thrusters, such as vectored_6dof
    channels: tuple[int, ...] = ()  # servo output of each thruster, from 1; 0 for none. Default: 1, 2, 3 ...
    signs: int | tuple[int, ...] = 1  # -1 where a pulse above neutral makes a thruster's force negative
    pwm_neutral: int = 1500  # us, pulse without force
    pwm_span: int = 400  # us, distance from neutral to full force
    pwm_dead_band: int = 25  # us, distance to either side of neutral within which there is no force
    curve: Literal["linear", "quadratic"] = "quadratic"  # force over the part of the span


def validate_autopilot(
    autopilot: Autopilot, n_thrusters: int, require: Callable[[bool, str, object, str], None]
) -> Autopilot:
    """Return the table with a channel and a sign for each thruster.

    Parameters
    ----------
    autopilot : Autopilot
        Table of the vehicle's file.
    n_thrusters : int
        Number of thrusters of the vehicle.
    require : callable
        Raises unless its first argument is true; the others are the key, its value, and the expected value.

    Returns
    -------
    Autopilot
        The table, complete.
    """
    given = autopilot
    channels = given.channels or tuple(range(1, n_thrusters + 1))
    signs = given.signs if isinstance(given.signs, tuple) else (given.signs,) * n_thrusters
    require(bool(given.frame) and given.frame.isprintable(), "autopilot.frame", repr(given.frame), "a name")
    for key, values in (("channels", channels), ("signs", signs)):
        require(len(values) == n_thrusters, f"autopilot.{key}", f"{len(values)} numbers", f"{n_thrusters}")
    good = all(0 <= channel <= MAX_CHANNELS for channel in channels)
    require(good, "autopilot.channels", channels, f"1 to {MAX_CHANNELS}, or 0 for none")
    used = [channel for channel in channels if channel]
    require(len(set(used)) == len(used), "autopilot.channels", channels, "each servo output once")
    require(all(abs(sign) == 1 for sign in signs), "autopilot.signs", signs, "1 or -1")
    good = given.pwm_neutral - given.pwm_span >= SHORTEST and given.pwm_neutral + given.pwm_span <= LONGEST
    received = f"{given.pwm_neutral} and {given.pwm_span} us"
    require(
        good and given.pwm_span > 0,
        "autopilot.pwm_neutral and pwm_span",
        received,
        f"pulses of {SHORTEST} to {LONGEST} us",
    )
    good = 0 <= given.pwm_dead_band < given.pwm_span
    require(good, "autopilot.pwm_dead_band", f"{given.pwm_dead_band} us", "0 or above, and less than pwm_span")
    return Autopilot(given.frame, channels, signs, given.pwm_neutral, given.pwm_span, given.pwm_dead_band, given.curve)


def effort_of_pulse(table: Autopilot, sign: int) -> Curve:
    """Return the function from a pulse [us] to a part of the greatest force.

    Parameters
    ----------
    table : Autopilot
        Neutral, span, dead band and curve.
    sign : int
        -1 where a pulse above neutral makes the force negative.

    Returns
    -------
    callable
        Function that returns u or u|u|, -1 to 1, with u the distance from neutral in spans; 0 within the dead band, and
        for an invalid pulse.
    """
    neutral, span, dead_band, quadratic = (
        table.pwm_neutral, table.pwm_span, table.pwm_dead_band, table.curve == "quadratic",
    )  # fmt: skip

    def effort(pulse: float) -> float:
        if not SHORTEST <= pulse <= LONGEST or abs(pulse - neutral) <= dead_band:
            return 0.0
        u = min(max((pulse - neutral) / span, -1.0), 1.0)
        return sign * u * abs(u) if quadratic else sign * u

    return effort


def pulse_of_effort(table: Autopilot, sign: int) -> Curve:
    """Return the function from a part of the greatest force to the pulse [us] that commands it.

    Parameters
    ----------
    table : Autopilot
        Neutral, span and curve.
    sign : int
        Sign as for `effort_of_pulse`, of which this is the inverse outside the dead band.

    Returns
    -------
    callable
        Function of a part from -1 to 1, which it clips; it returns neutral for NaN.

    Examples
    --------
    >>> from plant_fmu.autopilot import Autopilot, pulse_of_effort
    >>> pulse_of_effort(Autopilot("vectored_6dof"), -1)(0.25)
    1300.0
    """
    neutral, span, quadratic = table.pwm_neutral, table.pwm_span, table.curve == "quadratic"

    def pulse(effort: float) -> float:
        part = min(max(effort, -1.0), 1.0) if effort == effort else 0.0
        return neutral + sign * span * (math.copysign(math.sqrt(abs(part)), part) if quadratic else part)

    return pulse
