"""Gains of a law that were found for another vehicle."""

from __future__ import annotations

from controller import LAWS
from cosim.scenario.scenario import Scenario

FIND_GAINS = "cosim sweep, as in docs/baselines.md#gains-for-another-vehicle, and set law.gains."


def foreign_gains(scenario: Scenario) -> str:
    """Say for which vehicle a law's gains were found, if all are its defaults and the scenario's is another."""
    kind = LAWS.get(scenario.law.name)
    if kind is None or kind.gains_for in ("", scenario.vehicle.name) or scenario.law.gains != kind.gains_type():
        return ""
    return f"gains of law {scenario.law.name} were found for {kind.gains_for}, not for {scenario.vehicle.name}"
