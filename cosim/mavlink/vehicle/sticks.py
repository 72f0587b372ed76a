"""Dead zones of an ArduSub's sticks, as parts of their way at a pilot gain of 1, and the rates beyond them."""

from __future__ import annotations

import math

YAW_DEAD_ZONE = 0.1  # 40 of 400 us
CLIMB_DEAD_ZONE = 0.2  # THR_DZ: 100 of 500


def beyond_dead_zone(deflection: float, dead_zone: float) -> float:
    """Return the part of a full rate that a stick asks for.

    Parameters
    ----------
    deflection : float
        Of the stick, times the gain that scales it, -1 to 1.
    dead_zone : float
        Part of the way that asks for nothing, below 1.

    Returns
    -------
    float
        -1 to 1; 0 within the dead zone, and straight from its end on.

    Examples
    --------
    >>> from cosim.mavlink.vehicle.sticks import beyond_dead_zone, deflection_of
    >>> beyond_dead_zone(0.1, 0.2), round(beyond_dead_zone(deflection_of(-0.3, 0.2), 0.2), 6)
    (0.0, -0.3)
    """
    beyond = abs(deflection) - dead_zone
    return math.copysign(beyond / (1.0 - dead_zone), deflection) if beyond > 0.0 else 0.0


def deflection_of(part: float, dead_zone: float) -> float:
    """Return the deflection that asks for a part of a full rate: the inverse of `beyond_dead_zone`; 0 for 0."""
    return math.copysign(dead_zone + (1.0 - dead_zone) * abs(part), part) if part else 0.0
