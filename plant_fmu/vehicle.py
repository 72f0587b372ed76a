"""Load vehicles from TOML files, and validate their numbers."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from plant_fmu.autopilot import Autopilot
from plant_fmu.errors import TableError, VehicleError
from plant_fmu.toml_tables import Table, decode, key, read_toml, require

MAX_NUMBER = 1e15  # bound of every number of a vehicle, so that derived numbers are finite
MAX_THRUSTERS = 100  # maximum number of thrusters of a vehicle

Number = Annotated[float, Meta(ge=-MAX_NUMBER, le=MAX_NUMBER)]
Amount = Annotated[float, Meta(ge=0.0, le=MAX_NUMBER)]
Fraction = Annotated[float, Meta(ge=0.0, le=1.0)]
Vector3 = tuple[Number, Number, Number]
Wrench = tuple[Number, Number, Number, Number, Number, Number]  # X Y Z K M N
Damping = tuple[Amount, Amount, Amount, Amount, Amount, Amount]  # of u v w p q r (Property 3)
Sensor = Literal["depth_sensor", "dvl", "imu", "compass", "usbl"]
Rows = tuple[tuple[Number, ...], ...]
Matrix = tuple[Number | tuple[Number, ...], ...]  # rows, or a diagonal

# a name becomes C text and a file's name: neither may be a word that C99 or Windows keep for themselves
_RESERVED = (
    "auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|register|"
    "restrict|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while|"
    "(?i:con|prn|aux|nul|com[1-9]|lpt[1-9])"
)
_NAME = "at most 64 letters, digits, _ and -, the first a letter or _, and no word that C or Windows reserves"

# key of the file for each number of a vehicle
_KEYS = {
    "mass": "rigid_body.mass",
    "inertia": "rigid_body.inertia",
    "r_G": "rigid_body.center_of_gravity",
    "weight": "rigid_body.weight",
    "r_B": "hydrostatics.center_of_buoyancy",
    "buoyancy": "hydrostatics.buoyancy",
    "trim": "hydrostatics.trim",
    "added_mass": "hydrodynamics.added_mass",
    "linear_damping": "hydrodynamics.linear_damping",
    "quadratic_damping": "hydrodynamics.quadratic_damping",
    "thruster_matrix": "thrusters.matrix",
    "thrust_min": "thrusters.force_min",
    "thrust_max": "thrusters.force_max",
    "thrust_time_constant": "thrusters.time_constant",
    "thrust_rate_limit": "thrusters.rate_limit",
    "thrust_dead_band": "thrusters.dead_band",
    "thrust_curve": "thrusters.curve",
    "command_delay": "thrusters.delay",
    "dvl_position": "sensors.dvl_position",
    "hull_radius": "hull.radius",
}
_ORDERS = {"inertia": 3, "added_mass": 6}  # symmetric matrices
# estimates from mass and size, for what a file lacks
_GRAVITY, _WATER = 9.81, 1000.0  # m/s2, kg/m3
_DRAG = 1.0  # drag coefficient of a bluff body
_SPEED = 0.3  # m/s, at which linear damping is as large as quadratic damping
_ADDED = (0.5, 1.0, 1.2)  # added mass along the axes, by the vehicle's mass
_CENTER = 0.05  # of the height, by which the center of buoyancy is above that of gravity


class RigidBody(Table, frozen=True):
    """Mass, inertia about the body origin, center of gravity and weight."""

    mass: Annotated[float, key("mass", "kg", gt=0.0, le=MAX_NUMBER)]
    inertia: Matrix  # kg m2, 3 by 3 about the body origin, or its diagonal
    center_of_gravity: Vector3  # m, body frame
    weight: Annotated[float, key("weight in air", "N", ge=0.0, le=MAX_NUMBER)]


class Hydrostatics(Table, frozen=True):
    """Buoyancy, its center, and a constant wrench."""

    buoyancy: Annotated[float, key("buoyancy of the submerged vehicle", "N", ge=0.0, le=MAX_NUMBER)]
    center_of_buoyancy: Vector3  # m, body frame
    trim: Wrench = (0.0,) * 6  # N, N m: constant wrench on the body, as of a mounted tether


class Hydrodynamics(Table, frozen=True):
    """Added mass and damping, positive in the equation of motion."""

    added_mass: Matrix  # kg, kg m, kg m2: 6 by 6, or its diagonal
    linear_damping: Damping  # N s/m, N m s/rad
    quadratic_damping: Damping  # N s2/m2, N m s2/rad2


class Thrusters(Table, frozen=True):
    """Wrench, limits and dynamics of each thruster."""

    # lists stay of any length: beside one of a fixed length a number with a range makes msgspec read foreign memory

    matrix: Rows  # 6 rows (X Y Z K M N), a column for each thruster: wrench of one newton
    force_min: Number | tuple[Number, ...]  # N, most negative force
    force_max: Number | tuple[Number, ...]  # N, maximum force
    time_constant: Amount | tuple[Amount, ...] = 0.0  # s, time constant of the lag
    delay: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.0  # s, before the lag; also of a commanded wrench
    rate_limit: Amount | tuple[Amount, ...] = 0.0  # N/s, maximum rate of the force; 0: none
    dead_band: Fraction | tuple[Fraction, ...] = 0.0  # fraction of the command's range that gives no force
    curve: Fraction | tuple[Fraction, ...] = 0.0  # 0: force linear in the command; 1: quadratic; between: a mixture


class Sensors(Table, frozen=True):
    """Where and how late sensors measure."""

    dvl_position: Vector3 = (0.0,) * 3  # m, body frame
    delay: dict[Sensor, Annotated[float, Meta(ge=0.0, le=10.0)]] = msgspec.field(
        default_factory=dict
    )  # s, from a sample to its delivery


class Hull(Table, frozen=True):
    """The sphere about the body origin that meets surface and bottom, and the shape in pictures."""

    radius: Amount = 0.0  # m
    size: tuple[Amount, Amount, Amount] | None = None  # m: length, width, height; estimates what the file lacks
    shape: Literal["frame", "sphere"] = "frame"  # shape in pictures; the dynamics do not depend on it


class _File(Table, frozen=True):
    name: Annotated[
        str,
        key(
            "name of files and C functions",
            pattern=f"^(?!({_RESERVED})$)[A-Za-z_][A-Za-z0-9_-]{{0,63}}\\Z",
            expected=_NAME,
        ),
    ]
    title: str
    source: str
    rigid_body: RigidBody
    hydrostatics: Hydrostatics
    hydrodynamics: Hydrodynamics
    thrusters: Thrusters
    sensors: Sensors = Sensors()
    hull: Hull = Hull()
    autopilot: Autopilot | None = None


@dataclass(frozen=True, eq=False)
class Vehicle:
    """A checked vehicle in SI units; body frame x forward, y right, z down.

    Examples
    --------
    >>> from plant_fmu import load_vehicle
    >>> odin = load_vehicle("odin")
    >>> odin.n_thrusters, odin.mass
    (8, 125.0)
    """

    name: str  # a C identifier, once its hyphens are underscores
    title: str  # one line for people
    source: str  # origin of the numbers
    mass: float  # kg
    inertia: NDArray[np.float64]  # (3, 3) kg m2, about the body origin
    r_G: NDArray[np.float64]  # (3,) m, body frame: center of gravity
    r_B: NDArray[np.float64]  # (3,) m, body frame: center of buoyancy
    weight: float  # N
    buoyancy: float  # N
    trim: NDArray[np.float64]  # (6,) N, N m: constant wrench on the body
    added_mass: NDArray[np.float64]  # (6, 6) kg, kg m, kg m2
    linear_damping: NDArray[np.float64]  # (6,) N s/m, N m s/rad
    quadratic_damping: NDArray[np.float64]  # (6,) N s2/m2, N m s2/rad2
    thruster_matrix: NDArray[np.float64]  # (6, n) body wrench of one newton of each thruster
    thrust_min: NDArray[np.float64]  # (n,) N, most negative force of each thruster
    thrust_max: NDArray[np.float64]  # (n,) N, maximum force of each thruster
    thrust_time_constant: NDArray[np.float64]  # (n,) s, time constant of the lag
    thrust_rate_limit: NDArray[np.float64]  # (n,) N/s, maximum rate of the force; 0 for none
    thrust_dead_band: NDArray[np.float64]  # (n,) [-] fraction of the command's range that gives no force
    thrust_curve: NDArray[np.float64]  # (n,) [-] 0: force linear in the command; 1: quadratic
    command_delay: float  # s, from a command to the start of its force; runs apply it, the FMU does not
    dvl_position: NDArray[np.float64]  # (3,) m, body frame
    hull_radius: float  # m, radius of the sphere that meets surface and bottom
    autopilot: Autopilot | None = None  # map from servo outputs to thrusters; a channel and a sign for each
    hull_shape: Literal["frame", "sphere"] = "frame"  # shape in pictures
    sensor_delay: Mapping[str, float] = field(default_factory=dict)  # s, in place of a data sheet's, by sensor

    @property
    def n_thrusters(self) -> int:
        """Number of thrusters."""
        return int(self.thruster_matrix.shape[1])

    @property
    def righting_moment(self) -> float:
        """z_G W - z_B B [N m], about roll and pitch of a level vehicle per radian of tilt."""
        return float(self.weight * self.r_G[2] - self.buoyancy * self.r_B[2])

    @property
    def mass_matrix(self) -> NDArray[np.float64]:
        """M of (11), shape (6, 6) [kg, kg m, kg m2]: rigid body plus added mass, about the body origin."""
        S = np.cross(np.eye(3), self.r_G)  # S(r_G), (4)
        rigid = np.block([[self.mass * np.eye(3), -self.mass * S], [self.mass * S, self.inertia]])
        return np.asarray(rigid + self.added_mass)


def shipped_vehicles() -> list[str]:
    """Return the names of the vehicles that come with the package."""
    return sorted(f.name.removesuffix(".toml") for f in _folder().iterdir() if f.name.endswith(".toml"))


def load_vehicle(name_or_file: str | Path) -> Vehicle:
    """Load a shipped vehicle by name, or any vehicle by its file.

    Parameters
    ----------
    name_or_file : str or Path
        Name or file, such as ``"odin"`` or ``"boats/mine.toml"``.

    Returns
    -------
    Vehicle
        The validated vehicle.

    Raises
    ------
    VehicleError
        If there is no such vehicle, a key of its file is missing, unknown or invalid, or its numbers contradict each
        other. It is a `TableError`.

    Examples
    --------
    >>> from plant_fmu import load_vehicle
    >>> load_vehicle("bluerov2_heavy").title
    'BlueROV2 Heavy, after von Benzon et al. 2022'
    """
    text = str(name_or_file)
    path = Path(text)
    if path.suffix == ".toml":
        return _decode(path, text)
    if text not in shipped_vehicles():
        known = ", ".join(shipped_vehicles())
        raise VehicleError(f"vehicle {text!r} is unknown; expected one of {known}, or a file ending in .toml")
    return _shipped(text)


@functools.cache
def _shipped(name: str) -> Vehicle:
    """Return a shipped vehicle from the cache; its arrays cannot be written."""
    with resources.as_file(_folder() / f"{name}.toml") as file:
        return _decode(file, name)


def complete_tables(tables: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of a vehicle's file, with those that are missing estimated from mass and ``hull.size``."""
    hull, body = tables.get("hull"), tables.get("rigid_body")
    if not isinstance(hull, dict) or not isinstance(body, dict) or "size" not in hull or "mass" not in body:
        return tables
    mass = body["mass"]
    if not isinstance(mass, int | float) or not mass > 0.0:
        return tables  # which the check of types refuses by name
    sides = (
        [x for x in hull["size"] if isinstance(x, int | float) and x > 0.0] if isinstance(hull["size"], list) else []
    )
    is_valid = len(sides) == 3 == len(hull["size"])
    require(is_valid, "hull.size", str(hull["size"]), "length, width and height above 0")
    size = np.array(sides, float)
    length, width, height = size.tolist()
    squares = np.square(size)
    inertia = mass / 12.0 * (squares.sum() - squares)
    quadratic = 0.5 * _WATER * _DRAG * np.array([width * height, length * height, length * width])
    turning = quadratic[[1, 2, 1]] * np.array([height, length, length]) ** 3 / 32.0
    damping = np.concatenate([quadratic, turning])
    weight = _GRAVITY * mass
    estimates: dict[str, dict[str, Any]] = {
        "rigid_body": {"inertia": inertia.tolist(), "center_of_gravity": [0.0] * 3, "weight": weight},
        "hydrostatics": {"buoyancy": weight, "center_of_buoyancy": [0.0, 0.0, -_CENTER * height]},
        "hydrodynamics": {
            "added_mass": [*(mass * np.array(_ADDED)).tolist(), *(0.5 * inertia).tolist()],
            "linear_damping": (_SPEED * damping).tolist(), "quadratic_damping": damping.tolist(),
        },
        "hull": {"radius": 0.5 * height},
    }  # fmt: skip
    if "thrusters" not in tables:  # what moves it is a wrench
        estimates["thrusters"] = {"matrix": [[0.0]] * 6, "force_min": 0.0, "force_max": 0.0}
    name = str(tables.get("name", ""))
    texts = {"title": name, "source": "Estimated from mass and size, where the file says nothing else."}
    return texts | tables | {
        key: estimate | table
        for key, estimate in estimates.items() if isinstance(table := tables.get(key, {}), dict)
    }  # fmt: skip


def _decode(path: Path, where: str) -> Vehicle:
    try:
        return _make_vehicle(decode(complete_tables(read_toml(path)), _File))
    except (TableError, ValueError) as error:
        raise VehicleError(f"{where}: {error}") from error


def _folder() -> resources.abc.Traversable:
    return resources.files("plant_fmu") / "vehicles"


def _make_vehicle(file: _File) -> Vehicle:
    """Convert the file's numbers to arrays, and refuse those that contradict each other."""
    source = " ".join(file.source.split())
    for entry, text in (("title", file.title), ("source", source)):
        unprintable = next((c for c in text if not c.isprintable()), "")
        require(not unprintable, entry, f"text with {unprintable!r}", "printable characters")
    matrix = file.thrusters.matrix
    widths = {len(row) for row in matrix}
    require(
        len(matrix) == 6 and len(widths) == 1 and 1 <= min(widths) <= MAX_THRUSTERS,
        "thrusters.matrix", f"{len(matrix)} rows of {sorted(widths)} numbers",
        f"6 rows (X Y Z K M N) with one number for each of 1 to {MAX_THRUSTERS} thrusters",
    )  # fmt: skip
    (n,) = widths

    arrays = {name: _array(file, name, n) for name in _KEYS}
    vehicle = Vehicle(
        name=file.name, title=file.title, source=source, hull_shape=file.hull.shape,
        sensor_delay={str(sensor): late for sensor, late in file.sensors.delay.items()},
        autopilot=file.autopilot and file.autopilot.for_thrusters(n), **arrays,
    )  # fmt: skip
    above = bool((vehicle.thrust_min > vehicle.thrust_max).any())
    require(not above, "thrusters.force_min", "above force_max", "at most force_max")
    rigid = vehicle.mass_matrix - vehicle.added_mass
    for what, mass in (("rigid-body mass matrix", rigid), ("mass matrix with added mass", vehicle.mass_matrix)):
        smallest = float(np.linalg.eigvalsh(mass)[0])
        received = f"not positive definite (smallest eigenvalue {smallest:.4g})"
        require(smallest > 0.0, what, received, "positive definite (Property 1)")
    return vehicle


def _array(file: _File, field: str, n: int) -> Any:
    """Return a number of the vehicle with n thrusters, or an array that cannot be written."""
    section, name = _KEYS[field].split(".")
    value = getattr(getattr(file, section), name)
    if order := _ORDERS.get(field):
        value = _symmetric(value, order, _KEYS[field])
    elif field.startswith("thrust_"):
        received = len(value) if isinstance(value, tuple) else n
        require(received == n, _KEYS[field], f"{received} numbers", f"one, or {n}")
        value = np.broadcast_to(np.asarray(value, dtype=float), (n,)).copy()
    if isinstance(value, float):
        return value
    array = np.array(value, dtype=float)
    array.setflags(write=False)
    return array


def _symmetric(value: Matrix, n: int, key: str) -> NDArray[np.float64]:
    """Return a symmetric matrix, of which a file may give the diagonal alone."""
    widths = {len(row) or -1 if isinstance(row, tuple) else 0 for row in value}  # 0: a number, no row
    rows = f"rows of {sorted(max(width, 0) for width in widths)} " if widths != {0} else ""
    ok = len(value) == n and widths in ({0}, {n})
    require(ok, key, f"{len(value)} {rows}numbers", f"a diagonal of {n}, or {n} by {n}")
    matrix = np.diag(np.array(value)) if widths == {0} else np.array(value, dtype=float)
    require(bool(np.allclose(matrix, matrix.T, rtol=1e-9, atol=1e-9)), key, "not symmetric", "a symmetric matrix")
    return matrix
