"""Kinds and features of scenes, on which outcomes may depend."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cosim.campaigns.scenes.scenario_scene import AnyScene, ScenarioScene
from cosim.campaigns.scenes.scene_file import decode_scene
from cosim.campaigns.store.results import Results
from cosim.errors import RunError, ScenarioError
from cosim.simulation.signals import Array

PLAIN = "plain"

FEATURES = {  # units of the features
    "obstacles": "",
    "current": "m/s",
    "weight less buoyancy": "N",
    "righting moment": "N m",
    "way to the goal": "m",
}


@dataclass(frozen=True)
class SceneKinds:
    """Kinds and features of a campaign's scenes."""

    kinds: NDArray[np.str_]  # (scenes,) kind of each scene, such as "drift, noise, failure"
    features: dict[str, Array]  # (scenes,) values of each feature, by the keys of FEATURES

    def groups(self) -> Iterator[tuple[str, NDArray[np.bool_]]]:
        """Yield each kind with the mask of its scenes; nothing if all are of one kind."""
        names = sorted(set(self.kinds.tolist()), key=lambda name: (name != PLAIN, name))
        if len(names) > 1:
            for name in names:
                yield name, self.kinds == name


def scene_kinds(results: Results) -> SceneKinds:
    """Return kinds and features of a campaign's scenes."""
    kinds, numbers = [], []
    for line in results.values("scene"):
        try:
            scene = decode_scene(line.encode())
        except ScenarioError as error:
            raise RunError(f"{results.path}: scene: {error}") from error
        kinds.append(kind_of(scene))
        numbers.append(_numbers(scene))
    columns = np.array(numbers, dtype=float).reshape(-1, len(FEATURES)).T
    return SceneKinds(np.array(kinds, dtype=str), dict(zip(FEATURES, columns, strict=True)))


def kind_of(scene: AnyScene) -> str:
    """Return the kind of a scene: words for drift of obstacles, noise, and a failing thruster, or ``plain``."""
    if isinstance(scene, ScenarioScene):
        return scene.kind
    present = {
        "drift": any(any(obstacle.velocity) for obstacle in scene.obstacles),
        "noise": bool(scene.noise.position or scene.noise.velocity),
        "failure": scene.failed_thruster is not None,
    }
    return ", ".join(name for name, there in present.items() if there) or PLAIN


def _numbers(scene: AnyScene) -> tuple[float, ...]:
    if isinstance(scene, ScenarioScene):  # their features are not comparable
        return (math.nan,) * len(FEATURES)
    return (
        len(scene.obstacles),
        math.hypot(*scene.current),
        scene.weight_minus_buoyancy,
        scene.righting_moment,
        math.dist(scene.start, scene.goal.centre),
    )
