"""The closed form of the hierarchical Mamdani system: exact, and thousands of times faster than sampling it.

With m the membership of a criterion's on-term and complementary terms, De Morgan makes every "low" cut one minus the
"high" cut h, with

    h_k = min(1 - m_1, ..., 1 - m_(k-1), m_k).

The output terms low = triangle (0, 0, 1) and high = triangle (0, 1, 1), clipped at 1 - h and h and joined by max, have
the area 1/2 for every h, and the centroid

    C(h) = 1/3 + h^2 - 2/3 h^3,

which runs from C(0) = 1/3 to C(1) = 2/3. Scaled to [0, 1] this is the smoothstep 3 h^2 - 2 h^3.
"""

from __future__ import annotations

from collections.abc import Sequence

CENTROID_LOW = 1.0 / 3.0  # C(0)
CENTROID_HIGH = 2.0 / 3.0  # C(1)


def weights(memberships: Sequence[float]) -> tuple[float, ...]:
    """Return the weight of each criterion, range-normalised.

    Parameters
    ----------
    memberships : sequence of float
        Degree of each criterion's on-term in [0, 1], the highest priority first.

    Returns
    -------
    tuple of float
        Weights in [0, 1].
    """
    result = []
    unclaimed = 1.0  # degree to which no criterion of higher priority is on
    for m in memberships:
        h = min(unclaimed, m)
        result.append(h * h * (3.0 - 2.0 * h))
        unclaimed = min(unclaimed, 1.0 - m)
    return tuple(result)
