"""The task of an importer with an FMU, and its result."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from plant_fmu.errors import TaskError

Status = Literal["ok", "failed", "does not apply"]

MAX_STEPS = 100_000_000  # of a task

_ROUNDING = 1e-9  # relative tolerance of a stop time against a whole number of steps


@dataclass(frozen=True)
class Task:
    """A simulation from time 0 with constant inputs; stop_time, step [s]."""

    stop_time: float = 10.0  # end and step [s]; the stop time is a whole number of steps
    step: float = 0.01  # end and step [s]; the stop time is a whole number of steps
    # start values of parameters, inputs and states by name, in the units of the model description
    start: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, value in (("stop time", self.stop_time), ("step", self.step)):
            if not (math.isfinite(value) and value > 0.0):
                raise TaskError(f"{name} is {value:g} s, expected a positive number")
        steps = self.stop_time / self.step
        if not steps <= MAX_STEPS:
            raise TaskError(f"stop time {self.stop_time:g} s has more than {MAX_STEPS} steps of {self.step:g} s")
        if self.steps < 1 or abs(steps - self.steps) > _ROUNDING * steps:
            raise TaskError(f"stop time {self.stop_time:g} s is no whole number of steps of {self.step:g} s")

    @property
    def steps(self) -> int:
        """Number of steps to the stop time."""
        return round(self.stop_time / self.step)


@dataclass(frozen=True)
class Result:
    """The result of one importer; `note` is one line, with the reason where the status is not ``"ok"``."""

    importer: str
    version: str
    interface: str  # "CS", "ME", or "" for a validator without simulation
    status: Status
    note: str = ""
    values: dict[str, float] = field(default_factory=dict)  # real outputs at the stop time, by name
    difference: float | None = None  # maximum of an output to FMPy's, in its unit; None without a comparison
