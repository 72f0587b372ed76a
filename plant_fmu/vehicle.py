"""Load vehicles from TOML files, and validate their numbers."""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from plant_fmu.autopilot import Autopilot, validate_autopilot
from plant_fmu.errors import TableError, VehicleError
from plant_fmu.toml_tables import Table, decode, read_toml

Vector3 = tuple[float, float, float]
Vector6 = tuple[float, float, float, float, float, float]
Rows = tuple[tuple[float, ...], ...]
Matrix = tuple[float | tuple[float, ...], ...]  # rows, or a diagonal

MAX_NUMBER = 1e15  # bound of every number of a vehicle, so that derived numbers are finite
MAX_THRUSTERS = 100  # maximum number of thrusters of a vehicle

# a name becomes C text and a file's name: neither may be a word that C99 or Windows keep for themselves
_RESERVED = re.compile(
    "auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|register|"
    "restrict|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while|"
    "(?i:con|prn|aux|nul|com[1-9]|lpt[1-9])"
)

# key of the file for each number of a vehicle
_KEYS = {
    "mass": "rigid_body.mass",
    "inertia": "rigid_body.inertia",
    "r_G": "rigid_body.center_of_gravity",
    "weight": "rigid_body.weight",
    "r_B": "hydrostatics.center_of_buoyancy",
    "buoyancy": "hydrostatics.buoyancy",
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
    "hull_radius": "hull.radius",
}


class RigidBody(Table, frozen=True):
    """Mass, inertia about the body origin, center of gravity and weight."""

    mass: float  # kg
    inertia: Matrix  # kg m2, 3 by 3 about the body origin, or its diagonal
    center_of_gravity: Vector3  # m, body frame
    weight: float  # N


class Hydrostatics(Table, frozen=True):
    """Buoyancy and its center."""

    buoyancy: float  # N
    center_of_buoyancy: Vector3  # m, body frame


class Hydrodynamics(Table, frozen=True):
    """Added mass and damping, positive in the equation of motion."""

    added_mass: Matrix  # kg, kg m, kg m2: 6 by 6, or its diagonal
    linear_damping: Vector6  # N s/m, N m s/rad
    quadratic_damping: Vector6  # N s2/m2, N m s2/rad2


class Thrusters(Table, frozen=True):
    """Wrench, limits and dynamics of each thruster."""

    matrix: Rows  # 6 rows (X Y Z K M N), a column for each thruster: wrench of one newton
    force_min: float | tuple[float, ...]  # N, most negative force
    force_max: float | tuple[float, ...]  # N, maximum force
    time_constant: float | tuple[float, ...] = 0.0  # s, time constant of the lag
    rate_limit: float | tuple[float, ...] = 0.0  # N/s, maximum rate of the force; 0: none
    dead_band: float | tuple[float, ...] = 0.0  # fraction of the command's range that gives no force
    curve: float | tuple[float, ...] = 0.0  # 0: force linear in the command; 1: quadratic; between: a mixture


class Hull(Table, frozen=True):
    """The sphere about the body origin that meets surface and bottom, and the shape in pictures."""

    radius: float = 0.0  # m
    shape: Literal["frame", "sphere"] = "frame"  # shape in pictures; the dynamics do not depend on it


class _File(Table, frozen=True):
    name: str
    title: str
    source: str
    rigid_body: RigidBody
    hydrostatics: Hydrostatics
    hydrodynamics: Hydrodynamics
    thrusters: Thrusters
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
    hull_radius: float  # m, radius of the sphere that meets surface and bottom
    autopilot: Autopilot | None = None  # map from servo outputs to thrusters; a channel and a sign for each
    hull_shape: Literal["frame", "sphere"] = "frame"  # shape in pictures

    @property
    def n_thrusters(self) -> int:
        """Number of thrusters."""
        return int(self.thruster_matrix.shape[1])

    @property
    def mass_matrix(self) -> NDArray[np.float64]:
        """M of (11), shape (6, 6) [kg, kg m, kg m2]: rigid body plus added mass, about the body origin."""
        S = np.cross(np.eye(3), self.r_G)  # S(r_G), (4)
        rigid = np.block([[self.mass * np.eye(3), -self.mass * S], [self.mass * S, self.inertia]])
        return np.asarray(rigid + self.added_mass)


def shipped_vehicles() -> list[str]:
    """Return the names of the vehicles that come with the package.

    Examples
    --------
    >>> from plant_fmu import shipped_vehicles
    >>> shipped_vehicles()[:2]
    ['bluerov2_heavy', 'bluerov2_heavy_wu']
    """
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
        If there is no such vehicle, or a number is impossible.
    TableError
        If the file has a missing, unknown or mistyped key.

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


def _decode(path: Path, where: str) -> Vehicle:
    try:
        file: _File = decode(read_toml(path), _File)
    except TableError as error:
        raise TableError(f"{where}: {error}") from error
    return _make_vehicle(file, where)


def _folder() -> resources.abc.Traversable:
    return resources.files("plant_fmu") / "vehicles"


def _make_vehicle(file: _File, where: str) -> Vehicle:
    """Convert the file's numbers to arrays, and name the first impossible one."""

    def require(ok: bool, key: str, received: object, expected: str) -> None:
        if not ok:
            raise VehicleError(f"{where}: {key} is {received}, expected {expected}")

    def square(value: Matrix, n: int, key: str) -> NDArray[np.float64]:
        widths = {len(row) or -1 if isinstance(row, tuple) else 0 for row in value}  # 0: a number, no row
        ok = len(value) == n and widths in ({0}, {n})
        rows = f"rows of {sorted(max(width, 0) for width in widths)} " if widths != {0} else ""
        received = f"{len(value)} {rows}numbers"
        require(ok, key, received, f"a diagonal of {n}, or {n} by {n}")
        return np.diag(np.array(value)) if widths == {0} else np.array(value, dtype=float)

    body, statics, dynamics, thrusters = file.rigid_body, file.hydrostatics, file.hydrodynamics, file.thrusters
    name_ok = re.fullmatch("[A-Za-z_][A-Za-z0-9_-]{0,63}", file.name) is not None
    require(name_ok, "name", repr(file.name[:80]), "at most 64 letters, digits, _ and -, the first a letter or _")
    require(not _RESERVED.fullmatch(file.name), "name", repr(file.name), "a word that neither C nor Windows reserves")
    require(file.title.isprintable(), "title", repr(file.title), "one line of printable characters")
    unprintable = next((c for c in " ".join(file.source.split()) if not c.isprintable()), "")
    require(not unprintable, "source", f"text with {unprintable!r}", "printable characters")

    widths = {len(row) for row in thrusters.matrix}
    require(
        len(thrusters.matrix) == 6 and len(widths) == 1 and 1 <= min(widths) <= MAX_THRUSTERS,
        "thrusters.matrix",
        f"{len(thrusters.matrix)} rows of {sorted(widths)} numbers",
        f"6 rows (X Y Z K M N) with one number for each of 1 to {MAX_THRUSTERS} thrusters",
    )
    (n,) = widths

    def per_thruster(value: float | tuple[float, ...], key: str) -> NDArray[np.float64]:
        if isinstance(value, tuple):
            require(len(value) == n, f"thrusters.{key}", f"{len(value)} numbers", f"one, or {n}")
        return np.broadcast_to(np.asarray(value, dtype=float), (n,)).copy()

    vehicle = Vehicle(
        name=file.name,
        title=file.title,
        source=" ".join(file.source.split()),
        mass=body.mass,
        inertia=square(body.inertia, 3, "rigid_body.inertia"),
        r_G=np.array(body.center_of_gravity),
        r_B=np.array(statics.center_of_buoyancy),
        weight=body.weight,
        buoyancy=statics.buoyancy,
        added_mass=square(dynamics.added_mass, 6, "hydrodynamics.added_mass"),
        linear_damping=np.array(dynamics.linear_damping),
        quadratic_damping=np.array(dynamics.quadratic_damping),
        thruster_matrix=np.array(thrusters.matrix, dtype=float),
        thrust_min=per_thruster(thrusters.force_min, "force_min"),
        thrust_max=per_thruster(thrusters.force_max, "force_max"),
        thrust_time_constant=per_thruster(thrusters.time_constant, "time_constant"),
        thrust_rate_limit=per_thruster(thrusters.rate_limit, "rate_limit"),
        thrust_dead_band=per_thruster(thrusters.dead_band, "dead_band"),
        thrust_curve=per_thruster(thrusters.curve, "curve"),
        hull_radius=file.hull.radius,
        autopilot=file.autopilot and validate_autopilot(file.autopilot, n, require),
        hull_shape=file.hull.shape,
    )

    for key, value in vars(vehicle).items():
        if not isinstance(value, str | Autopilot | None):
            ok = bool(np.all(np.abs(value) <= MAX_NUMBER))  # False for NaN too
            require(ok, _KEYS.get(key, key), "not finite", f"finite numbers of up to {MAX_NUMBER:g}")
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
    require(vehicle.mass > 0, "rigid_body.mass", f"{vehicle.mass} kg", "above 0")
    require(vehicle.weight >= 0, "rigid_body.weight", f"{vehicle.weight} N", "0 or above")
    require(vehicle.buoyancy >= 0, "hydrostatics.buoyancy", f"{vehicle.buoyancy} N", "0 or above")
    for key in ("linear_damping", "quadratic_damping"):
        minimum = getattr(vehicle, key).min()
        require(minimum >= 0, _KEYS[key], minimum, "0 or above (Property 3)")
    for key in ("inertia", "added_mass"):
        matrix = getattr(vehicle, key)
        symmetric = bool(np.allclose(matrix, matrix.T, rtol=1e-9, atol=1e-9))
        require(symmetric, _KEYS[key], "not symmetric", "a symmetric matrix")
    require(
        bool((vehicle.thrust_min <= vehicle.thrust_max).all()),
        "thrusters.force_min",
        "above force_max",
        "at most force_max",
    )
    for key, maximum in (
        ("thrust_time_constant", np.inf),
        ("thrust_rate_limit", np.inf),
        ("thrust_dead_band", 1.0),
        ("thrust_curve", 1.0),
        ("hull_radius", np.inf),
    ):
        values = np.atleast_1d(getattr(vehicle, key))
        require(bool((values >= 0).all()), _KEYS[key], f"negative, {values.min():g}", "0 or above")
        require(bool((values <= maximum).all()), _KEYS[key], f"{values.max():g}", f"at most {maximum:g}")
    rigid = vehicle.mass_matrix - vehicle.added_mass
    for key, matrix in (("rigid-body mass matrix", rigid), ("mass matrix with added mass", vehicle.mass_matrix)):
        min_eigenvalue = float(np.linalg.eigvalsh(matrix)[0])
        require(
            min_eigenvalue > 0,
            key,
            f"not positive definite (smallest eigenvalue {min_eigenvalue:.4g})",
            "positive definite (Property 1)",
        )
    return vehicle
