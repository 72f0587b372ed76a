"""The map from an autopilot's servo outputs to a vehicle's thrusters; the FMU does not contain it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Literal

from msgspec.structs import replace

from plant_fmu.toml_tables import Table, key, require

MAX_CHANNELS = 32  # maximum number of channels, those of MAVLink's longer servo packet
MIN_PULSE, MAX_PULSE = 800, 2200  # us, minimum and maximum length of a pulse that a speed controller accepts

Curve = Callable[[float], float]  # from a servo output [us] to a fraction of the maximum force, -1 to 1; or the inverse


class Autopilot(Table, frozen=True):
    """The table ``autopilot`` of a vehicle's file."""

    frame: str  # the autopilot's name for the arrangement of the thrusters, such as vectored_6dof
    channels: tuple[int, ...] = ()  # servo output of each thruster, from 1; 0 for none. Default: 1, 2, 3 ...
    signs: int | tuple[int, ...] = 1  # -1 where a pulse above neutral makes a thruster's force negative
    pwm_neutral: int = 1500  # us, pulse without force
    pwm_span: Annotated[int, key("distance from neutral to full force", "us", gt=0)] = 400
    pwm_dead_band: Annotated[int, key("distance from neutral without force", "us", ge=0)] = 25
    curve: Literal["linear", "quadratic"] = "quadratic"  # force over the part of the span

    def __post_init__(self) -> None:
        used = [channel for channel in self.channels if channel]
        require(len(set(used)) == len(used), "channels", self.channels, "each servo output once")
        require(
            self.pwm_neutral - self.pwm_span >= MIN_PULSE and self.pwm_neutral + self.pwm_span <= MAX_PULSE,
            "pwm_neutral and pwm_span", f"{self.pwm_neutral} and {self.pwm_span} us",
            f"pulses of {MIN_PULSE} to {MAX_PULSE} us",
        )  # fmt: skip
        require(self.pwm_dead_band < self.pwm_span, "pwm_dead_band", f"{self.pwm_dead_band} us", "less than pwm_span")

    def sign_of_each(self, n_thrusters: int) -> tuple[int, ...]:
        """Return a sign for each of n thrusters."""
        return self.signs if isinstance(self.signs, tuple) else (self.signs,) * n_thrusters

    def for_thrusters(self, n_thrusters: int) -> Autopilot:
        """Return the table with a channel and a sign for each of n thrusters."""
        require(self.frame.isprintable() and self.frame != "", "autopilot.frame", repr(self.frame), "a name")
        lists = {"channels": self.channels or tuple(range(1, n_thrusters + 1)), "signs": self.sign_of_each(n_thrusters)}
        for name, values in lists.items():
            require(len(values) == n_thrusters, f"autopilot.{name}", f"{len(values)} numbers", f"{n_thrusters}")
        require(all(abs(sign) == 1 for sign in lists["signs"]), "autopilot.signs", lists["signs"], "1 or -1")
        ok = all(0 <= channel <= MAX_CHANNELS for channel in lists["channels"])
        require(ok, "autopilot.channels", lists["channels"], f"1 to {MAX_CHANNELS}, or 0 for none")
        return replace(self, **lists)


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
