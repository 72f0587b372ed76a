"""All evaluations of a clearance agree for each region of a shifted scene."""

import numpy as np
import pytest

from controller.errors import RegionError
from controller.regions import Region, Sphere, pack
from controller.regions.region_set import (
    RegionEvaluator,
    attitude_clearance,
    clearance_at,
    clearance_of_pose,
    position_clearance,
)
from controller.regions.shapes import ENTRIES

SCENE = [Region(name, entry.example, ("in", "out")[i % 2]) for i, (name, entry) in enumerate(ENTRIES.items())]


def test_a_pose_of_another_shape_is_rejected():
    evaluator = RegionEvaluator(pack([Region("rock", Sphere((0.0, 0.0, 2.0), 0.5), "out")]))
    level = (1.0, 0.0, 0.0, 0.0)
    for position, quaternion in ((5.0, level), ((1.0, 2.0), level), ((1.0, 2.0, 3.0), 1.0)):
        with pytest.raises(RegionError, match=r"evaluate: \w+'s shape is \(.*\), expected \([34],\)"):
            evaluator.evaluate(position, quaternion)


def test_all_region_evaluations_agree():
    rng, packed, n = np.random.default_rng(1), pack(SCENE), len(SCENE)
    packed.shifts[:] = rng.normal(size=(n, 3))
    values, gradients, rotation_gradients, clearances = np.empty(n), np.empty((n, 3)), np.empty((n, 3)), np.empty(n)
    slope, turning, asked = np.empty(3), np.empty(3), 0
    for _ in range(40):
        p, e = rng.normal(size=3) * 3.0 + 1.0, rng.normal(size=4)
        e /= np.linalg.norm(e)
        packed.evaluate(p, e, values, gradients, rotation_gradients, clearances)
        for i, region in enumerate(SCENE):
            assert clearance_of_pose(packed, i, p, e) == pytest.approx(clearances[i], rel=1e-12)
            if region.shape.unit == "rad":
                clearance = attitude_clearance(packed, i, p, e, turning)
                assert clearance == pytest.approx(clearances[i], rel=1e-12)
                assert turning == pytest.approx(-rotation_gradients[i], rel=1e-12, abs=1e-15)
                assert clearance_at(packed, i, p) == np.inf
                continue
            assert clearance_at(packed, i, p) == pytest.approx(clearances[i], rel=1e-12)
            assert position_clearance(packed, i, p, slope) == pytest.approx(clearances[i], rel=1e-12)
            size = np.linalg.norm(gradients[i])
            assert slope == pytest.approx(-gradients[i] / size if size > 0.0 else np.zeros(3), rel=1e-12, abs=1e-15)
            if region.name == "sphere":
                asked += 1
                distance = np.linalg.norm(p - packed.shifts[i] - region.shape.center) - region.shape.radius
                assert clearances[i] == pytest.approx(-distance if region.keep == "in" else distance, rel=1e-12)
    assert asked == 40
