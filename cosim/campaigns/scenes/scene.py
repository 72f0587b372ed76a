"""Scored scenes: a start, a goal region, obstacles, a depth band, and parameters of the plant."""

# The law receives `scene_regions` and the goal; `plant_parameters` are for the plant alone.

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from controller.regions import DepthBand, Region, Sphere
from controller.regions.shape import GREATEST
from cosim.errors import ScenarioError
from plant_fmu.toml_tables import NonNegative, Table
from plant_fmu.vehicle import Vehicle

ODIN = "odin"  # vehicle of scenes that name none
Seed = Annotated[int, Meta(ge=0, le=2**63 - 1)]
Moderate = Annotated[float, Meta(ge=-GREATEST, le=GREATEST)]
Radius = Annotated[float, Meta(gt=0.0, le=GREATEST)]
Deviation = Annotated[float, Meta(ge=0.0, le=GREATEST)]
Vector3 = tuple[Moderate, Moderate, Moderate]


class SphereSpec(Table, frozen=True):
    """The goal region."""

    centre: Vector3  # m, NED; spelled as in files of scenes
    radius: Radius  # m


class Obstacle(Table, frozen=True):
    """A sphere to keep out of, which may drift."""

    centre: Vector3  # m, NED, at time 0
    radius: Radius  # m, the hull included
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED


class Noise(Table, frozen=True):
    """Standard deviations of the white noise of measurements at each control step."""

    position: Deviation = 0.0  # m
    velocity: Deviation = 0.0  # m/s
    seed: Seed | None = None  # seed of the noise; None: that of the scene


class Failure(Table, frozen=True):
    """A thruster that gives no force from some time on."""

    index: Annotated[int, Meta(ge=1)]  # number of the thruster, from 1
    time: NonNegative  # s, time of the failure


class Scene(Table, frozen=True):
    """One scene of a file."""

    seed: Seed
    start: Vector3  # m, NED
    goal: SphereSpec
    obstacles: tuple[Obstacle, ...]
    depth_band: tuple[Moderate, Moderate]  # m, minimum and maximum depth
    current: Vector3  # m/s, NED
    weight_minus_buoyancy: float  # N
    righting_moment: float  # N m: z_G W - z_B B
    noise: Noise = Noise()
    failed_thruster: Failure | None = None
    vehicle: str = ODIN  # shipped name, or TOML file


def scene_regions(scene: Scene) -> list[tuple[Region, str]]:
    """Return the regions of a scene beside its goal, each with its criterion."""
    obstacles = [
        (Region(f"obstacle {i + 1}", Sphere(o.centre, o.radius), "out", o.velocity), "obstacle")
        for i, o in enumerate(scene.obstacles)
    ]
    shallow, deep = scene.depth_band
    band = Region("depth band", DepthBand((shallow + deep) / 2.0, (deep - shallow) / 2.0), "in")
    return [*obstacles, (band, "depth")]


def plant_parameters(scene: Scene, vehicle: Vehicle) -> dict[str, float]:
    """Return the plant's parameters for a scene; weight, mass and r_G are the vehicle's."""
    buoyancy = vehicle.weight - scene.weight_minus_buoyancy
    if not buoyancy > 0.0:
        raise ScenarioError(
            f"weight_minus_buoyancy is {scene.weight_minus_buoyancy}, expected less than the weight of the vehicle "
            f"{vehicle.name}, {vehicle.weight:g} N"
        )
    failure, n = scene.failed_thruster, vehicle.n_thrusters
    if failure and failure.index > n:
        raise ScenarioError(f"failed_thruster.index is {failure.index}, expected one of the {n} of {vehicle.name}")
    return {
        "buoyancy": buoyancy,
        "r_B.z": float(vehicle.r_G[2] * vehicle.weight - scene.righting_moment) / buoyancy,
        **{f"thrust_time_constant[{i + 1}]": 0.0 for i in range(n)},
    }
