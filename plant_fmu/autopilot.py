"""The map from an autopilot's servo outputs to a vehicle's thrusters; the FMU does not contain it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

from plant_fmu.toml_tables import Table

MAX_CHANNELS = 32  # maximum number of channels, those of MAVLink's longer servo packet
MIN_PULSE, MAX_PULSE = 800, 2200  # us, minimum and maximum length of a pulse that a speed controller accepts

Curve = Callable[[float], float]  # from a servo output [us] to a fraction of the maximum force, -1 to 1; or the inverse


class Autopilot(Table, frozen=True):
    """The table ``autopilot`` of a vehicle's file."""

    frame: str  # the autopilot's name for the arrangement of the thrusters, such as vectored_6dof
    channels: tuple[int, ...] = ()  # servo output of each thruster, from 1; 0 for none. Default: 1, 2, 3 ...
    signs: int | tuple[int, ...] = 1  # -1 where a pulse above neutral makes a thruster's force negative
    pwm_neutral: int = 1500  # us, pulse without force
    pwm_span: int = 400  # us, distance from neutral to full force
    pwm_dead_band: int = 25  # us, distance to either side of neutral within which there is no force
    curve: Literal["linear", "quadratic"] = "quadratic"  # force over the part of the span

    def sign_of_each(self, n_thrusters: int) -> tuple[int, ...]:
        """Return a sign for each of n thrusters."""
        return self.signs if isinstance(self.signs, tuple) else (self.signs,) * n_thrusters


def validate_autopilot(
    autopilot: Autopilot, n_thrusters: int, require: Callable[[bool, str, object, str], None]
) -> Autopilot:
    """Return the table with a channel and a sign for each thruster."""
    table = autopilot
    channels = table.channels or tuple(range(1, n_thrusters + 1))
    signs = table.sign_of_each(n_thrusters)
    require(bool(table.frame) and table.frame.isprintable(), "autopilot.frame", repr(table.frame), "a name")
    for key, values in (("channels", channels), ("signs", signs)):
        require(len(values) == n_thrusters, f"autopilot.{key}", f"{len(values)} numbers", f"{n_thrusters}")
    ok = all(0 <= channel <= MAX_CHANNELS for channel in channels)
    require(ok, "autopilot.channels", channels, f"1 to {MAX_CHANNELS}, or 0 for none")
    used = [channel for channel in channels if channel]
    require(len(set(used)) == len(used), "autopilot.channels", channels, "each servo output once")
    require(all(abs(sign) == 1 for sign in signs), "autopilot.signs", signs, "1 or -1")
    ok = table.pwm_neutral - table.pwm_span >= MIN_PULSE and table.pwm_neutral + table.pwm_span <= MAX_PULSE
    received = f"{table.pwm_neutral} and {table.pwm_span} us"
    require(
        ok and table.pwm_span > 0,
        "autopilot.pwm_neutral and pwm_span",
        received,
        f"pulses of {MIN_PULSE} to {MAX_PULSE} us",
    )
    ok = 0 <= table.pwm_dead_band < table.pwm_span
    require(ok, "autopilot.pwm_dead_band", f"{table.pwm_dead_band} us", "0 or above, and less than pwm_span")
    return Autopilot(table.frame, channels, signs, table.pwm_neutral, table.pwm_span, table.pwm_dead_band, table.curve)


def effort_of_pulse(table: Autopilot, sign: int) -> Curve:
    """Return the function from a pulse [us] to a fraction of the maximum force."""
    neutral, span, dead_band, quadratic = (
        table.pwm_neutral, table.pwm_span, table.pwm_dead_band, table.curve == "quadratic",
    )  # fmt: skip

    def effort(pulse: float) -> float:
        if not MIN_PULSE <= pulse <= MAX_PULSE or abs(pulse - neutral) <= dead_band:
            return 0.0
        fraction = min(max((pulse - neutral) / span, -1.0), 1.0)
        return sign * fraction * abs(fraction) if quadratic else sign * fraction

    return effort


def pulse_of_effort(table: Autopilot, sign: int) -> Curve:
    """Return the function from a fraction of the maximum force to the pulse [us] that commands it."""
    neutral, span, quadratic = table.pwm_neutral, table.pwm_span, table.curve == "quadratic"

    def pulse(effort: float) -> float:
        fraction = min(max(effort, -1.0), 1.0) if effort == effort else 0.0
        return neutral + sign * span * (math.copysign(math.sqrt(abs(fraction)), fraction) if quadratic else fraction)

    return pulse
