"""Scored scenes: a start, a goal region, obstacles, a depth band, and parameters of the plant."""

# The law receives `scene_regions` and the goal; `plant_values` are for the plant alone.

from __future__ import annotations

from controller.regions import DepthBand, Region, Sphere
from controller.regions.shape import GREATEST
from cosim.errors import ScenarioError
from plant_fmu.toml_tables import Table
from plant_fmu.vehicle import Vehicle

Vector3 = tuple[float, float, float]


class SphereSpec(Table, frozen=True):
    """The goal region."""

    centre: Vector3  # m, NED
    radius: float  # m


class Obstacle(Table, frozen=True):
    """A sphere to keep out of, which may drift."""

    centre: Vector3  # m, NED, at time 0
    radius: float  # m, the hull included
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED


class Noise(Table, frozen=True):
    """Standard deviations of the white noise of measurements at each control step."""

    position: float = 0.0  # m
    velocity: float = 0.0  # m/s
    seed: int | None = None  # seed of the noise; None: that of the scene


class Failure(Table, frozen=True):
    """A thruster that gives no force from some time on."""

    index: int  # number of the thruster, from 1
    time: float  # s, time of the failure


class Scene(Table, frozen=True):
    r"""One scene of a file.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> _ = Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    >>> scene = next(cosim.read_scenes(Path("scenes.jsonl")))
    >>> scene.seed, scene.goal.radius
    (0, 0.5)
    """

    seed: int
    start: Vector3  # m, NED
    goal: SphereSpec
    obstacles: tuple[Obstacle, ...]
    depth_band: tuple[float, float]  # m, least and greatest depth
    current: Vector3  # m/s, NED
    weight_minus_buoyancy: float  # N
    righting_moment: float  # N m: z_G W - z_B B
    noise: Noise = Noise()
    failed_thruster: Failure | None = None


def scene_regions(scene: Scene) -> list[tuple[Region, str]]:
    """Return the regions of a scene beside its goal, each with its criterion."""
    obstacles = [
        (Region(f"obstacle {i + 1}", Sphere(o.centre, o.radius), "out", o.velocity), "obstacle")
        for i, o in enumerate(scene.obstacles)
    ]
    shallow, deep = scene.depth_band
    band = Region("depth band", DepthBand((shallow + deep) / 2.0, (deep - shallow) / 2.0), "in")
    return [*obstacles, (band, "depth")]


def plant_values(scene: Scene, vehicle: Vehicle, substep: float) -> dict[str, float]:
    """Return the plant's parameters and start values for a scene; weight, mass and r_G are the vehicle's."""
    # with substep [s]
    buoyancy = vehicle.weight - scene.weight_minus_buoyancy
    if not buoyancy > 0.0:
        raise ScenarioError(
            f"weight_minus_buoyancy is {scene.weight_minus_buoyancy}, expected less than the weight of the vehicle "
            f"{vehicle.name}, {vehicle.weight:g} N"
        )
    failure, n = scene.failed_thruster, vehicle.n_thrusters
    if failure and failure.index > n:
        raise ScenarioError(f"failed_thruster.index is {failure.index}, expected one of the {n} of {vehicle.name}")
    values = {
        "substep": substep,
        "buoyancy": buoyancy,
        "r_B.z": (vehicle.r_G[2] * vehicle.weight - scene.righting_moment) / buoyancy,
    }
    values |= {f"thrust_time_constant[{i + 1}]": 0.0 for i in range(vehicle.n_thrusters)}
    values |= {f"current.{axis}": v for axis, v in zip("xyz", scene.current, strict=True)}
    return values | {f"position.{axis}": v for axis, v in zip("xyz", scene.start, strict=True)}


def check_scene(scene: Scene) -> None:
    """Raise an error at the first number that is out of range, for any vehicle."""
    failure, noise, (shallow, deep) = scene.failed_thruster, scene.noise, scene.depth_band
    _require(0 <= scene.seed < 2**63, "seed", scene.seed, "a whole number from 0 to 2^63 - 1")
    for key in ("start", "current", "depth_band"):
        _require_moderate(key, getattr(scene, key))
    _require(shallow < deep, "depth_band", scene.depth_band, "two depths, the shallow one first")
    balls: dict[str, SphereSpec | Obstacle] = {"goal": scene.goal}
    for key, ball in (balls | {f"obstacles.{i}": o for i, o in enumerate(scene.obstacles)}).items():
        _require_moderate(f"{key}.centre", ball.centre)
        _require(0.0 < ball.radius <= GREATEST, f"{key}.radius", ball.radius, "above 0 m")
    for i, obstacle in enumerate(scene.obstacles):
        _require_moderate(f"obstacles.{i}.velocity", obstacle.velocity)
    for key in ("position", "velocity"):
        _require(0.0 <= getattr(noise, key) <= GREATEST, f"noise.{key}", getattr(noise, key), "0 or above")
    _require(
        noise.seed is None or 0 <= noise.seed < 2**63, "noise.seed", noise.seed, "a whole number from 0 to 2^63 - 1"
    )
    if failure:
        _require(failure.index >= 1, "failed_thruster.index", failure.index, "a number from 1")
        _require(failure.time >= 0.0, "failed_thruster.time", failure.time, "0 s or above")


def _require(good: bool, key: str, received: object, expected: str) -> None:
    if not good:
        raise ScenarioError(f"{key} is {received}, expected {expected}")


def _require_moderate(key: str, values: tuple[float, ...]) -> None:
    _require(all(abs(x) <= GREATEST for x in values), key, values, f"numbers up to {GREATEST:g}")
