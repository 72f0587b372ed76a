"""How scored scenes are flown."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from cosim.errors import RunError
from cosim.scenario.rule_variants import RuleVariant
from cosim.scenario.tables import Outage


@dataclass(frozen=True)
class Conditions:
    """How scenes are flown; the defaults are those of the score.

    A scene that is a scenario has a duration, periods and a ramp of its own.
    """

    duration: float = 120.0  # s
    control: float = 0.02  # s
    plant_steps: int = 2  # plant steps a control step, each one integration step
    settled: float = 10.0  # s at the end inside the goal region
    ramp: float = 0.2  # m, width of the arbiter's memberships
    tell_failures: bool = False
    sensing: Literal["state", "sensors"] = "state"  # what the law is told, as `Sensing.through`
    outages: tuple[Outage, ...] = ()  # of sensors
    arbiter: RuleVariant = "ordered"  # by which criteria are weighed, as `ArbiterSetup.rules`

    def __post_init__(self) -> None:
        for key in ("duration", "control"):
            if not 0.0 < getattr(self, key) < math.inf:
                raise RunError(f"{key} is {getattr(self, key)} s, expected a finite number above 0")
        if self.plant_steps < 1 or self.controls < 1:
            raise RunError(f"{self.controls} control steps of {self.plant_steps} plant steps, expected 1 or more")

    @property
    def controls(self) -> int:
        """How many control steps a flight has."""
        return round(self.duration / self.control)

    @property
    def plant_step(self) -> float:
        """Length of a plant step [s]."""
        return self.control / self.plant_steps
