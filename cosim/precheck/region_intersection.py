"""Intersection of regions: a common point, or the certificate that there is none."""

# Signed distances are Lipschitz with constant 1, and so is their maximum. A box holds no common point if the distance
# at its center exceeds its half diagonal. Boxes are halved until a common point is found, or no box is left.

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from controller.regions import Region
from controller.regions.region_set import RegionEvaluator, clearances_at, pack
from cosim.simulation.signals import Array

Vector3 = tuple[float, float, float]

TOLERANCE = 0.01  # m, accuracy of the common depth
_MAX_BOXES = 400_000  # maximum number of boxes in one round of halving
_LEVEL = (1.0, 0.0, 0.0, 0.0)  # the regions do not depend on attitude


@dataclass(frozen=True)
class Overlap:
    """Result of a search for a common point of regions."""

    point: Vector3  # m, NED: the point of maximum depth that was found
    depth: float  # m, minimum clearance there over the regions; negative if one is violated
    at_most: float  # m, certified upper bound of the depth in the searched box

    @property
    def found(self) -> bool:
        """Whether the point satisfies all regions."""
        return self.depth >= 0.0

    @property
    def excluded(self) -> bool:
        """Whether it is certain that no point of the box satisfies all regions."""
        return self.at_most < 0.0


def common_depth(points: Array, regions: Sequence[Region]) -> Array:
    """Return the minimum clearance over regions, shape (m,) [m]: above 0 where all are satisfied; points [m, NED]."""
    depths: Array = np.min([clearances_at(points, region) for region in regions], axis=0)
    return depths


def search(regions: Sequence[Region], low: Array, high: Array, tolerance: float = TOLERANCE) -> Overlap:
    """Find the point of a box with the maximum common depth of regions; low, high (3,) [m, NED], tolerance [m]."""
    half = 0.5 * (np.asarray(high, dtype=float) - low)
    centers = (np.asarray(low, dtype=float) + half)[None, :]
    best_point, best = centers[0], -math.inf
    bound = math.inf
    while True:
        depths = common_depth(centers, regions)
        at = int(np.argmax(depths))
        if depths[at] > best:
            best_point, best = _refine(regions, centers[at], float(depths[at]), low, high)
        reach = depths + float(np.linalg.norm(half))
        bound = max(best, min(bound, float(reach.max())))
        if bound - best <= tolerance:
            break
        open_boxes = centers[reach > best + tolerance]
        if 8 * len(open_boxes) > _MAX_BOXES:
            break
        half = 0.5 * half
        offsets = np.array(np.meshgrid(*([-1.0, 1.0],) * 3)).reshape(3, -1).T * half
        centers = (open_boxes[:, None, :] + offsets[None, :, :]).reshape(-1, 3)
    best_point, best = _refine(regions, best_point, best, low, high)
    x, y, z = (float(c) for c in best_point)
    return Overlap((x, y, z), best, bound)


def _refine(regions: Sequence[Region], point: Array, depth: float, low: Array, high: Array) -> tuple[Array, float]:
    """Improve a point by Nelder-Mead, since the minimum clearance is not smooth; return point and depth."""
    from scipy.optimize import minimize  # a slow import, which scenes do without

    evaluator = RegionEvaluator(pack(regions))
    done = minimize(
        lambda p: -float(evaluator.evaluate(p, _LEVEL)[3].min()), point, method="Nelder-Mead",
        bounds=list(zip(low, high, strict=True)), options={"xatol": 1e-5, "fatol": 1e-6, "maxiter": 300},
    )  # fmt: skip
    return (np.asarray(done.x), -float(done.fun)) if -done.fun > depth else (point, depth)


def box_about(regions: Sequence[Region], points: Sequence[Vector3], margin: float) -> tuple[Array, Array]:
    """Return the corners of a box that holds points and the finite bounds of regions, with a margin."""
    # Units of arguments: points [m, NED]; margin [m]
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    for region in regions:
        lowest, highest = np.array(region.shape.bounds())
        low = np.minimum(low, np.where(np.isfinite(lowest), lowest, np.inf))
        high = np.maximum(high, np.where(np.isfinite(highest), highest, -np.inf))
    return low - margin, high + margin


def box_within(region: Region, low: Array, high: Array) -> tuple[Array, Array]:
    """Return the intersection of a box and the bounds of a region, which must overlap."""
    lowest, highest = np.array(region.shape.bounds())
    return np.maximum(low, np.minimum(lowest, high)), np.minimum(high, np.maximum(highest, low))
