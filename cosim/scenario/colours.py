"""The colours of regions, in every figure, page and export."""

from __future__ import annotations

from cosim.scenario.scenario import Scenario

GOAL_COLOUR = "#009E73"  # Okabe and Ito's


def colour_of(scenario: Scenario, criterion: str | None) -> str:
    """Return the colour of the regions of a criterion, as ``#RRGGBB``.

    Parameters
    ----------
    scenario : Scenario
        Whose criterion it is.
    criterion : str, optional
        None for the goal.

    Returns
    -------
    str
        Such as ``"#D55E00"``.
    """
    if criterion is None:
        return GOAL_COLOUR
    return scenario.criteria[scenario.criterion_names.index(criterion)].colour
