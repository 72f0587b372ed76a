"""Scored scenes: a start, a goal region, obstacles, a depth band, and what the law is not told of the plant.

One JSON object a line. What the law is told of a scene is `KnownScene`; `plant_values` is for the plant alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from controller.regions import DepthBand, Region, Sphere, pack
from controller.regions.region_set import PackedRegions
from controller.regions.shape import GREATEST
from cosim.errors import ScenarioError
from cosim.scenario.arbiter_rules import PAPER_RULES
from cosim.scenario.criteria import PAPER
from cosim.scenario.tables import SecondaryRegion
from cosim.simulation.arbiter_inputs import PackedInputs, pack_inputs
from plant_fmu import PlantFmuError
from plant_fmu.toml_tables import decode
from plant_fmu.vehicle import Vehicle

Vector3 = tuple[float, float, float]
_LONGEST = 1_000_000  # bytes of a scene: a pipe may never end its line


@dataclass(frozen=True)
class SphereSpec:
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
    r"""One scene, as its line has it.

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
    depth_band: tuple[float, float]  # m
    current: Vector3  # m/s, NED
    weight_minus_buoyancy: float  # N
    righting_moment: float  # N m, z_G W - z_B B
    noise: Noise = Noise()
    failed_thruster: Failure | None = None


class KnownScene(NamedTuple):
    """What the law is told of a scene: no more than this, and its measurements."""

    goal: PackedRegions
    regions: PackedRegions  # obstacles, then the depth band
    criteria: NDArray[np.int64]  # (n,) place of each region's criterion among the paper's
    inputs: PackedInputs  # what the arbiter decides by


def known_scene(scene: Scene, ramp: float = 0.2) -> KnownScene:
    """Return what the law is told of a scene.

    Parameters
    ----------
    scene : Scene
        With all that the plant needs.
    ramp : float
        Width of the arbiter's memberships [m].

    Returns
    -------
    KnownScene
        Arrays of its own.
    """
    names = [criterion.name for criterion in PAPER]
    regions, criteria = zip(*scene_regions(scene), strict=True)
    return KnownScene(
        goal=pack([Region("goal", Sphere(scene.goal.centre, scene.goal.radius), "in")]),
        regions=pack(regions),
        criteria=np.array([names.index(criterion) for criterion in criteria], dtype=np.int64),
        inputs=pack_inputs(list(map(SecondaryRegion, regions, criteria)), PAPER, PAPER_RULES, ramp),
    )


def scene_regions(scene: Scene) -> list[tuple[Region, str]]:
    """Return the regions of a scene beside its goal, each with its criterion.

    Parameters
    ----------
    scene : Scene
        With all that the plant needs.

    Returns
    -------
    list of (Region, str)
        The obstacles in their order, then the depth band.
    """
    obstacles = [
        (Region(f"obstacle {i + 1}", Sphere(o.centre, o.radius), "out", o.velocity), "obstacle")
        for i, o in enumerate(scene.obstacles)
    ]
    shallow, deep = scene.depth_band
    band = Region("depth band", DepthBand((shallow + deep) / 2.0, (deep - shallow) / 2.0), "in")
    return [*obstacles, (band, "depth")]


def plant_values(scene: Scene, vehicle: Vehicle, substep: float) -> dict[str, float]:
    """Return what the plant is set to for a scene; its weight, mass and r_G stay those of the vehicle.

    Parameters
    ----------
    scene : Scene
        With all that the plant needs.
    vehicle : Vehicle
        Whose weight and centre of gravity count.
    substep : float
        Greatest integration step [s].

    Returns
    -------
    dict of str to float
        Parameters and start values of the FMU.

    Raises
    ------
    ScenarioError
        If there would be no buoyancy, or the vehicle has no such thruster.
    """
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


def decode_scene(line: bytes) -> Scene:
    """Return the scene of a line.

    Parameters
    ----------
    line : bytes
        One JSON object.

    Returns
    -------
    Scene
        Whose numbers are finite and can be.

    Raises
    ------
    ScenarioError
        If it is no scene; it names the key.
    """
    try:
        table = msgspec.json.decode(line)
        if not isinstance(table, dict):
            raise ScenarioError(f"expected one JSON object, got {type(table).__name__!r}")
        scene = decode(table, Scene)
    except (msgspec.MsgspecError, PlantFmuError, RecursionError, UnicodeDecodeError) as error:
        raise ScenarioError(str(error).removeprefix("file: ")) from error
    _check(scene)
    return scene


def _check(scene: Scene) -> None:
    """Raise an error at the first number that cannot be, whatever the vehicle."""
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
    if failure:
        _require(failure.index >= 1, "failed_thruster.index", failure.index, "a number from 1")
        _require(failure.time >= 0.0, "failed_thruster.time", failure.time, "0 s or above")


def _require(good: bool, key: str, received: object, expected: str) -> None:
    if not good:
        raise ScenarioError(f"{key} is {received}, expected {expected}")


def _require_moderate(key: str, values: tuple[float, ...]) -> None:
    _require(all(abs(x) <= GREATEST for x in values), key, values, f"numbers up to {GREATEST:g}")


def read_scenes(path: Path) -> Iterator[Scene]:
    r"""Read scenes from a file, one JSON object a line; blank lines are passed over.

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

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> _ = Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    >>> [scene.seed for scene in cosim.read_scenes(Path("scenes.jsonl"))]
    [0, 1]
    """
    try:
        with path.open("rb") as file:
            yield from scenes_in(file, str(path))
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror or error}") from error


def scenes_in(file: IO[bytes], name: str) -> Iterator[Scene]:
    """Read scenes from a file.

    Parameters
    ----------
    file : file object
        A line is one JSON object; blank ones are passed over. It may be a pipe that never ends.
    name : str
        Of where they come from, for messages.

    Yields
    ------
    Scene
        In their order.

    Raises
    ------
    ScenarioError
        At a line that is no scene; it names the line and the key.
    """
    for number, line in enumerate(iter(lambda: file.readline(_LONGEST + 1), b""), 1):
        if len(line) > _LONGEST:
            raise ScenarioError(f"{name}, line {number}: has more than {_LONGEST} bytes, expected a scene")
        if line.strip():
            try:
                yield decode_scene(line)
            except ScenarioError as error:
                raise ScenarioError(f"{name}, line {number}: {error}") from error
