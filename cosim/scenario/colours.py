"""The colours of the criteria and the goal, in every figure, page and export."""

from __future__ import annotations

# Okabe and Ito's, which colour-blind people can tell apart
CRITERION_COLOURS = {"obstacle": "#D55E00", "shape": "#E69F00", "depth": "#56B4E9"}
GOAL_COLOUR = "#009E73"


def colour_of(criterion: str | None) -> str:
    """Return the colour of the regions of a criterion, as ``#RRGGBB``.

    Parameters
    ----------
    criterion : str, optional
        None for the goal.

    Returns
    -------
    str
        Such as ``"#D55E00"``.

    Raises
    ------
    KeyError
        If there is no such criterion.
    """
    return GOAL_COLOUR if criterion is None else CRITERION_COLOURS[criterion]
