"""Memberships of the criteria, computed from their regions: for the master and the fused loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cosim.scenario.criteria import CriterionSetup
from cosim.scenario.region_tables import SecondaryRegion
from cosim.step.curves import PackedCurves, curve_degree, pack_curves
from fuzzy_arbiter import Shape
from fuzzy_arbiter.criteria import ramp

Array = NDArray[np.float64]

_APPROACH_TIME = 1


class PackedMemberships(NamedTuple):
    """Membership functions in r rows, each of one region and one reason of its criterion."""

    regions: NDArray[np.int64]  # (r,) index of the region
    criteria: NDArray[np.int64]  # (r,) index of the region's criterion
    quantities: NDArray[np.int64]  # (r,) 0 its clearance, 1 the time to contact
    ramps: Array  # (r,) m or rad, clearance where the membership reaches 0; NaN: points or a curve define it
    follows: NDArray[np.bool_]  # (r,) True if the ramp is the arbiter's
    offsets: NDArray[np.int64]  # (r + 1,) index of each row's first point, and the number of points
    places: Array  # (points,) m, rad or s: abscissae of the points, one row behind the other
    degrees: Array  # (points,) memberships at the points
    curves: PackedCurves  # curved terms, which have no points
    by_time: bool  # True if a row needs the time to contact


def pack_memberships(
    regions: Sequence[SecondaryRegion], criteria: Sequence[CriterionSetup], width: float
) -> PackedMemberships:
    """Pack the membership functions of regions into arrays; width [m or rad]."""
    names = [criterion.name for criterion in criteria]
    rows = [
        (i, names.index(region.criterion), reason)
        for i, region in enumerate(regions)
        for reason in criteria[names.index(region.criterion)].reasons
        if reason.is_of(region)
    ]
    terms = [reason.term for _, _, reason in rows]
    points = [term.points if isinstance(term, Shape) else () for term in terms]
    widths = [width if r.ramp is None else r.ramp for _, _, r in rows]
    return PackedMemberships(
        regions=np.array([i for i, _, _ in rows], np.int64),
        criteria=np.array([c for _, c, _ in rows], np.int64),
        quantities=np.array([_APPROACH_TIME * (r.quantity == "approach_time") for _, _, r in rows], np.int64),
        ramps=np.array([math.nan if r.term else w for w, (_, _, r) in zip(widths, rows, strict=True)], float),
        follows=np.array([r.term is None and r.ramp is None for _, _, r in rows], np.bool_),
        offsets=np.cumsum([0, *map(len, points)], dtype=np.int64),
        places=np.array([place for of in points for place, _ in of], float),
        degrees=np.array([degree for of in points for _, degree in of], float),
        curves=pack_curves(terms),
        by_time=any(r.quantity == "approach_time" for _, _, r in rows),
    )


def compute_memberships(
    packed: PackedMemberships, clearances: Array, approach_times: Array, memberships: Array
) -> None:
    """Compute the membership of each criterion: the greatest over its regions; clearances [m], approach_times [s]."""
    memberships[:] = 0.0
    for k in range(packed.regions.size):
        i, criterion, width = packed.regions[k], packed.criteria[k], packed.ramps[k]
        x = clearances[i] if packed.quantities[k] == 0 else approach_times[i]
        degree: float = ramp(x, width)
        if not width >= 0.0:
            curved = packed.curves.offsets[k] < packed.curves.offsets[k + 1]
            degree = curve_degree(packed.curves, k, x) if curved else _degree(packed, k, x)
        memberships[criterion] = max(memberships[criterion], degree)


def _degree(packed: PackedMemberships, k: int, x: float) -> float:
    """Return the degree of a row at `x`, as `fuzzy_arbiter.Shape` does: linear between points, constant beyond."""
    first, end = packed.offsets[k], packed.offsets[k + 1]
    degree: float = packed.degrees[end - 1] if x == x else x
    for i in range(end - 1, first, -1):
        a, b, left, right = packed.places[i - 1], packed.places[i], packed.degrees[i - 1], packed.degrees[i]
        if x == b:
            degree = right
        elif x < b:
            degree = left + (right - left) * ((x - a) / (b - a))
    if x <= packed.places[first]:
        degree = packed.degrees[first]
    return degree
