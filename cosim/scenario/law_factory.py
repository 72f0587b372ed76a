"""The built-in law of a scenario, and custom laws instead of it."""

from __future__ import annotations

from typing import get_args

import numpy as np

from controller import LAWS, CompiledLaw, FunctionLaw, Law, LawError
from controller.function_law import qualified_name
from controller.law import Output
from cosim.errors import RunError, ScenarioError
from cosim.scenario.scenario import Scenario, validate_scenario
from cosim.scenario.vehicle_model import vehicle_model


def law_of(scenario: Scenario) -> CompiledLaw:
    """Create a scenario's law, with its own memory."""
    require_builtin_law(scenario)
    return LAWS[scenario.law.name].for_vehicle(
        vehicle_model(scenario.vehicle),
        scenario.law.gains,
        np.array(scenario.law.desired_quaternion),
        scenario.time.control,
        len(scenario.regions),
    )


def require_builtin_law(scenario: Scenario) -> None:
    """Raise `RunError` if a scenario's law is a custom one, whose code is not in its file."""
    known = ", ".join(sorted(LAWS))
    if scenario.law.fmu:
        raise RunError(f"law.file is {scenario.law.name!r}, expected here no FMU but law.name, one of {known}")
    if scenario.law.is_custom:
        raise RunError(
            f"law.name is {scenario.law.name!r}, a law of one's own, which no file holds: expected a run from Python, "
            f"by run_scenario(..., law=...), or another law.name, one of {known}"
        )


def require_no_fmus(scenario: Scenario, what: str) -> None:
    """Raise `RunError` if law or plant of a scenario is of the user's, or FMUs are beside it; `what` needs its own."""
    require_builtin_law(scenario)
    if scenario.plant_fmu:
        raise RunError(f"plant.file is {scenario.plant_fmu.file.name!r}, expected none for {what}")
    if scenario.components:
        names = ", ".join(fmu.name for fmu in scenario.components)
        raise RunError(f"components are given ({names}), expected none for {what}")


def with_custom_law(law: Law, scenario: Scenario) -> Scenario:
    """Return a scenario with a custom law."""
    if getattr(law, "output", None) not in get_args(Output) or not callable(getattr(law, "step", None)):
        raise LawError(f"law is {qualified_name(law)}, expected a FunctionLaw, or what else fulfils controller.Law")
    name = law.name if isinstance(law, FunctionLaw) else qualified_name(law)
    through = scenario.actuation.through
    if law.output == "thrusters" and through != "thrusters":
        raise ScenarioError(f"actuation.through is {through!r}, expected 'thrusters': law {name} drives them")
    own = {"name": name, "desired_quaternion": list(scenario.law.desired_quaternion), "gains": {}}
    return validate_scenario(scenario.table | {"law": own}, scenario.name, scenario.vehicle)
