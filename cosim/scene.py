"""Scored scenes: a start, a goal region, obstacles, a depth band, and what the law is not told of the plant.

One JSON object a line. What the law is told of a scene is `Told`; `plant_values` is for the plant alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from controller import ControllerError
from controller.regions import DepthBand, PackedRegions, Region, Sphere, pack
from cosim.errors import ScenarioError
from cosim.scenario import CRITERIA
from plant_fmu.vehicle import Vehicle

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Ball:
    """The goal region."""

    centre: Vector3  # m, NED
    radius: float  # m


@dataclass(frozen=True)
class Obstacle:
    """A sphere to be kept out of, which may drift."""

    centre: Vector3  # m, NED, at time 0
    radius: float  # m, the hull included
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED


@dataclass(frozen=True)
class Noise:
    """Standard deviations of what is measured at each control step, white."""

    position: float = 0.0  # m
    velocity: float = 0.0  # m/s


@dataclass(frozen=True)
class Failure:
    """A thruster that gives nothing from some time on."""

    index: int  # from 1
    time: float  # s


@dataclass(frozen=True)
class Scene:
    """One scene, as its line has it."""

    seed: int
    start: Vector3  # m, NED
    goal: Ball
    obstacles: tuple[Obstacle, ...]
    depth_band: tuple[float, float]  # m
    current: Vector3  # m/s, NED
    weight_minus_buoyancy: float  # N
    righting_moment: float  # N m, z_G W - z_B B
    noise: Noise = Noise()
    failed_thruster: Failure | None = None


class Told(NamedTuple):
    """What the law is told of a scene: no more than this, and its measurements."""

    goal: PackedRegions
    regions: PackedRegions  # obstacles, then the depth band
    criteria: NDArray[np.int64]  # (n,) index into CRITERIA of each of the regions


def told(scene: Scene) -> Told:
    """Return what the law is told of a scene.

    Parameters
    ----------
    scene : Scene
        Any.

    Returns
    -------
    Told
        Arrays of its own.
    """
    shallow, deep = scene.depth_band
    regions = [
        Region(f"obstacle {i + 1}", Sphere(o.centre, o.radius), "out", o.velocity)
        for i, o in enumerate(scene.obstacles)
    ]
    band = Region("depth band", DepthBand((shallow + deep) / 2.0, (deep - shallow) / 2.0), "in")
    obstacle, depth = CRITERIA.index("obstacle"), CRITERIA.index("depth")
    return Told(
        goal=pack([Region("goal", Sphere(scene.goal.centre, scene.goal.radius), "in")]),
        regions=pack([*regions, band]),
        criteria=np.array([obstacle] * len(regions) + [depth], dtype=np.int64),
    )


def plant_values(scene: Scene, vehicle: Vehicle, substep: float) -> dict[str, float]:
    """Return what the plant is set to for a scene; its weight, mass and r_G stay those of the vehicle.

    Parameters
    ----------
    scene : Scene
        Any.
    vehicle : Vehicle
        Whose weight and centre of gravity count.
    substep : float
        Greatest integration step [s].

    Returns
    -------
    dict of str to float
        Parameters and start values of the FMU.
    """
    buoyancy = vehicle.weight - scene.weight_minus_buoyancy
    values = {
        "substep": substep,
        "buoyancy": buoyancy,
        "r_B.z": (vehicle.r_G[2] * vehicle.weight - scene.righting_moment) / buoyancy,
    }
    values |= {f"thrust_time_constant[{i + 1}]": 0.0 for i in range(vehicle.n_thrusters)}
    values |= {f"current.{axis}": v for axis, v in zip("xyz", scene.current, strict=True)}
    return values | {f"position.{axis}": v for axis, v in zip("xyz", scene.start, strict=True)}


def read_scenes(path: Path) -> Iterator[Scene]:
    """Read scenes from a file, one JSON object a line; blank lines are passed over.

    Parameters
    ----------
    path : Path
        The file.

    Yields
    ------
    Scene
        In the file's order.

    Raises
    ------
    ScenarioError
        If the file cannot be read, or a line is no scene; it names the line and the key.
    """
    decoder = msgspec.json.Decoder(Scene)
    try:
        with path.open("rb") as lines:
            for number, line in enumerate(lines, 1):
                if line.strip():
                    try:
                        scene = decoder.decode(line)
                        told(scene)
                    except (msgspec.MsgspecError, ControllerError) as error:
                        raise ScenarioError(f"{path}, line {number}: {error}") from error
                    yield scene
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror or error}") from error
