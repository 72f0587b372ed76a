"""The law of a scenario."""

from __future__ import annotations

import numpy as np

from controller import LAWS, CompiledLaw
from cosim.scenario import Scenario
from cosim.vehicle_model import vehicle_model


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
    """
    return LAWS[scenario.law.name].for_vehicle(
        vehicle_model(scenario.vehicle),
        scenario.law.gains,
        np.array(scenario.law.desired_quaternion),
        scenario.time.control,
        len(scenario.regions),
    )
