"""Conditions of flights of scored scenes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Literal, get_args

from cosim.errors import RunError, ScenarioError
from cosim.scenario.arbiter_rules import read_rules
from cosim.scenario.tables import ArbiterSetup, Outage, RuleVariant
from fuzzy_arbiter import Arbiter, ArbiterError
from fuzzy_arbiter.formats import FORMATS, reads
from plant_fmu.toml_tables import Table


class Conditions(Table, frozen=True):
    """Conditions of flights; the defaults are those of the score."""

    # A scene that is a scenario has its own duration, periods and ramp.

    duration: float = 120.0  # s, duration of a flight
    control: float = 0.02  # s, control period
    plant_steps: int = 2  # number of plant steps per control step, each with one integration step
    settled: float = 10.0  # s, least time in the goal region at the end
    ramp: float = 0.2  # m, width of the arbiter's memberships
    report_failures: bool = False  # True: failing thrusters are reported to the law
    sensing: Literal["state", "sensors"] = "state"  # source of the law's state, as `Sensing.through`
    outages: tuple[Outage, ...] = ()  # outages of sensors
    arbiter: RuleVariant = "ordered"  # rule variant, as `ArbiterSetup.rules`
    arbiter_file: str = ""  # name of a rule file instead; its inputs are named like criteria or signals
    arbiter_text: str = ""  # content of the file
    arbiter_engine: Literal["closed", "exact"] = "closed"  # engine for these rules

    def __post_init__(self) -> None:
        for key in ("duration", "control"):
            if not 0.0 < getattr(self, key) < math.inf:
                raise RunError(f"{key} is {getattr(self, key)} s, expected a finite number above 0")
        if self.plant_steps < 1 or self.controls < 1:
            raise RunError(f"{self.controls} control steps of {self.plant_steps} plant steps, expected 1 or more")

    @classmethod
    def by_arbiter(cls, arbiter: str, **others: Any) -> Conditions:
        """Make conditions with a rule variant, or with the rules of a file."""
        if arbiter in get_args(RuleVariant):
            return cls(arbiter=arbiter, **others)  # type: ignore[arg-type]
        if Path(arbiter).suffix.lower().removeprefix(".") not in FORMATS:
            known = ", ".join(get_args(RuleVariant))
            raise ScenarioError(f"--arbiter is {arbiter!r}, expected {known}, or a file of rules")
        setup = read_rules(ArbiterSetup(file=arbiter))
        try:
            engine = Arbiter(reads(setup.text, Path(setup.file).suffix.lower().removeprefix("."))).engine
        except ArbiterError as error:
            raise ScenarioError(f"--arbiter: {arbiter}: {error}") from error
        return cls(arbiter_file=setup.file, arbiter_text=setup.text, arbiter_engine=engine, **others)  # type: ignore[arg-type]

    def arbiter_table(self, table: dict[str, Any]) -> dict[str, Any]:
        """Return the table ``arbiter`` of a scenario under these conditions."""
        if self.arbiter_file:
            rules = {"file": self.arbiter_file, "text": self.arbiter_text, "engine": self.arbiter_engine}
            return {key: value for key, value in table.items() if key != "rules"} | rules
        return table | ({"rules": self.arbiter} if self.arbiter != "ordered" else {})

    @property
    def controls(self) -> int:
        """Number of control steps of a flight."""
        return round(self.duration / self.control)

    @property
    def plant_step(self) -> float:
        """Length of a plant step [s]."""
        return self.control / self.plant_steps
