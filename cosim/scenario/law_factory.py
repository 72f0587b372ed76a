"""The law of a scenario, and a law of one's own in its place."""

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
    """Return a scenario's law, with a memory of its own.

    Parameters
    ----------
    scenario : Scenario
        Which law, with which gains, for which vehicle.

    Returns
    -------
    CompiledLaw
        It knows the vehicle's nominal numbers: what the scenario changes in the plant is not told.

    Raises
    ------
    LawError
        If it cannot be set up.
    RunError
        If it is a law of one's own.
    """
    require_builtin_law(scenario)
    return LAWS[scenario.law.name].for_vehicle(
        vehicle_model(scenario.vehicle),
        scenario.law.gains,
        np.array(scenario.law.desired_quaternion),
        scenario.time.control,
        len(scenario.regions),
    )


def require_builtin_law(scenario: Scenario) -> None:
    """Raise `RunError` if a scenario's law is one's own, which its file names but cannot hold."""
    if scenario.law.own:
        raise RunError(
            f"law.name is {scenario.law.name!r}, a law of one's own, which no file holds: expected a run from Python, "
            f"by run_scenario(..., law=...), or another law.name, one of {', '.join(sorted(LAWS))}"
        )


def with_custom_law(law: Law, scenario: Scenario) -> Scenario:
    """Return a scenario as a law of one's own flies it.

    Parameters
    ----------
    law : Law
        In the place of the scenario's.
    scenario : Scenario
        With any law.

    Returns
    -------
    Scenario
        With the place that the law is from as ``law.name``, and no gains.

    Raises
    ------
    LawError
        If it is no law, such as a function that no `FunctionLaw` is made of.
    ScenarioError
        If the scenario asks for what goes with shipped laws alone, or for a wrench where the law drives thrusters.
    """
    if getattr(law, "output", None) not in get_args(Output) or not callable(getattr(law, "step", None)):
        raise LawError(f"law is {qualified_name(law)}, expected a FunctionLaw, or what else fulfils controller.Law")
    name = law.name if isinstance(law, FunctionLaw) else qualified_name(law)
    through = scenario.actuation.through
    if law.output == "thrusters" and through != "thrusters":
        raise ScenarioError(f"actuation.through is {through!r}, expected 'thrusters': law {name} drives them")
    own = {"name": name, "desired_quaternion": list(scenario.law.desired_quaternion), "gains": {}}
    return validate_scenario(scenario.table | {"law": own}, scenario.name, scenario.vehicle)
