"""What every law is given and gives: state, regions and weights in; a body wrench or thruster forces out.

A law's mathematics is one compiled function ``step(state, goal, regions, weights, gains, memory, forces)``. All that it
keeps between steps stands in its `memory`, a named tuple of arrays, so that the same function serves the readable
master, which calls `CompiledLaw.step`, and compiled loops, which call the function itself.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Container
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from controller.compiling.function import BoundCall, CompiledFunction
from controller.errors import LawError
from controller.regions.region_set import PackedRegions

Array = NDArray[np.float64]
Output = Literal["wrench", "thrusters"]
G = TypeVar("G", bound=tuple[float, ...])


_AS_THE_GAINS_SAY = np.zeros(12)
_AS_THE_GAINS_SAY.flags.writeable = False
NOTHING_EXPECTED = np.full(6, np.nan)
NOTHING_EXPECTED.flags.writeable = False


class VehicleState(NamedTuple):
    """What is measured of the vehicle.

    Examples
    --------
    >>> import numpy as np
    >>> from controller import VehicleState
    >>> state = VehicleState(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(6), np.ones(8))
    >>> state.velocity_body.shape
    (6,)
    """

    position: Array  # (3,) m, NED
    quaternion: Array  # (4,) from body to world
    velocity_body: Array  # (6,) over ground, m/s, rad/s
    thruster_health: Array  # (m,) 1 working as far as one is told, 0 known to give nothing
    deviation: Array = _AS_THE_GAINS_SAY  # (12,) standard deviations of position [m], velocity [m/s], attitude [rad],
    # world axes, and rates [rad/s], body, of an estimate; 0: a measurement, whose noise is that of the law's gains


class VehicleModel(NamedTuple):
    """What a law may know of a vehicle: neither weight nor buoyancy, nor their centres, nor the current.

    Examples
    --------
    >>> from controller import VehicleModel
    >>> VehicleModel._fields[-3:]
    ('thrust_min', 'thrust_max', 'thrust_time_constant')
    """

    rigid_mass: Array  # (6, 6) kg, kg m2, with the centre of gravity taken to be the origin
    added_mass: Array  # (6, 6) kg, kg m, kg m2
    linear_damping: Array  # (6,) N s/m, N m s/rad
    quadratic_damping: Array  # (6,) N s2/m2, N m s2/rad2
    thruster_matrix: Array  # (6, m) body wrench of one newton of each thruster
    thrust_min: Array  # (m,) N
    thrust_max: Array  # (m,) N
    thrust_time_constant: Array  # (m,) s, of the thrusters' lag


@dataclass(frozen=True)
class Diagnostic:
    """One number that a law reports after each step."""

    name: str
    unit: str
    description: str


class Law(Protocol):
    """State, regions and weights in; forces out.

    Examples
    --------
    >>> from controller import FunctionLaw, Law
    >>> law: Law = FunctionLaw(lambda state, goal, regions, weights: [0.0] * 6)
    >>> law.estimate.shape
    (4,)
    """

    diagnostics: tuple[Diagnostic, ...]  # what the numbers of `report` are

    @property
    def output(self) -> Output:
        """What `step` writes."""
        ...

    @property
    def estimate(self) -> Array:
        """phi-hat (12), shape (4,) [N, N m]."""
        ...

    @property
    def report(self) -> Array:
        """What the last step has to say, shape (len(diagnostics),)."""
        ...

    def step(
        self, state: VehicleState, goal: PackedRegions, regions: PackedRegions, weights: Array, forces: Array
    ) -> None:
        """Write the wrench, shape (6,) [N, N m], or the thruster forces, shape (m,) [N], of the coming period.

        Of `state`, `goal`, `regions`, `weights` and `forces` see `CompiledLaw.step`.
        """
        ...


class CompiledLaw:
    """A law made of a compiled function, its gains and its memory.

    Attributes
    ----------
    gains : NamedTuple
        Numbers that stay.
    memory : NamedTuple of ndarray
        What it keeps between steps; has at least ``estimate`` and ``report``.
    n_regions, n_forces : int
        How many secondary regions it is made for, and how many numbers it gives.

    Examples
    --------
    >>> from controller import LAWS
    >>> LAWS["deployable"].output
    'thrusters'
    >>> LAWS["pd"].gains_type()._fields[:2]
    ('k_p1', 'k_p2')
    """

    name: ClassVar[str]  # of its module, given when the laws are loaded
    output: ClassVar[Output]
    function: ClassVar[Any]  # plain Python in the translator's subset, or anything that can be called
    gains_type: ClassVar[type[Any]]  # a NamedTuple of floats with defaults
    diagnostics: tuple[Diagnostic, ...] = ()
    gains: Any
    memory: Any
    n_regions: int
    n_forces: int = 6
    _state: VehicleState | None = None  # of the last step

    @classmethod
    def for_vehicle(
        cls, vehicle: VehicleModel, gains: Any, desired_quaternion: Array, period: float, n_regions: int
    ) -> CompiledLaw:
        """Return the law for a vehicle.

        Parameters
        ----------
        vehicle : VehicleModel
            What it may know of the vehicle.
        gains : NamedTuple
            Of `gains_type`.
        desired_quaternion : array_like, shape (4,)
            Attitude to be kept, from body to world.
        period : float
            Control period [s].
        n_regions : int
            How many secondary regions it will be given.

        Returns
        -------
        CompiledLaw
            With a memory of its own.

        Raises
        ------
        LawError
            If gains, attitude or period cannot be.
        """
        raise NotImplementedError

    @classmethod
    def validate(cls, gains: G) -> G:
        """Return gains if the law can work with them.

        Parameters
        ----------
        gains : NamedTuple
            Of `gains_type`.

        Returns
        -------
        NamedTuple
            The same.

        Raises
        ------
        LawError
            If it cannot.
        """
        raise NotImplementedError

    def set_attitude(self, quaternion: Array) -> None:
        """Keep another attitude from the next step on.

        Parameters
        ----------
        quaternion : array_like, shape (4,)
            From body to world.

        Raises
        ------
        LawError
            If it is not of length 1.
        """
        self.memory.desired_quaternion[:] = validate_quaternion(quaternion)

    @property
    def estimate(self) -> Array:
        """phi-hat (12), shape (4,) [N, N m]."""
        estimate: Array = self.memory.estimate
        return estimate

    @property
    def report(self) -> Array:
        """What the last step has to say, shape (len(diagnostics),)."""
        report: Array = self.memory.report
        return report

    @property
    def expected(self) -> Array:
        """Position [m, NED] and velocity over ground [m/s, body] at the next step, shape (6,); NaN: not estimated."""
        return NOTHING_EXPECTED

    def step(
        self, state: VehicleState, goal: PackedRegions, regions: PackedRegions, weights: Array, forces: Array
    ) -> None:
        """Write the forces of the coming control period, and carry the memory over it.

        Parameters
        ----------
        state : VehicleState
            As measured now.
        goal : PackedRegions
            The primary region alone.
        regions : PackedRegions
            The n secondary regions.
        weights : ndarray, shape (n,)
            Of each secondary region, from the arbiter, in [0, 1].
        forces : ndarray, shape (6,) or (m,)
            Receives the wrench [N, N m], body frame, or the thruster forces [N], as `output` says.
        """
        if state is not self._state and not all(part.flags.c_contiguous for part in state):
            state = VehicleState(*(part.copy() for part in state))  # the numbers in C stand side by side
        self._state = state
        self._step(state, goal, regions, weights, self.gains, self.memory, forces)

    def bound(
        self, state: VehicleState, goal: PackedRegions, regions: PackedRegions, weights: Array, forces: Array
    ) -> BoundCall:
        """Return its step with these arguments, those of `step`, to be called by whoever calls C."""
        return BoundCall(type(self).function, (state, goal, regions, weights, self.gains, self.memory, forces))

    @functools.cached_property
    def _step(self) -> CompiledFunction:
        return CompiledFunction(type(self).function)


class WrenchLaw(CompiledLaw):
    """A law that gives a wrench, and wants to know nothing of the vehicle.

    Parameters
    ----------
    gains : NamedTuple
        Of `gains_type`.
    desired_quaternion : array_like, shape (4,)
        Attitude to be kept, from body to world.
    period : float
        Control period [s].
    n_regions : int
        How many secondary regions it will be given.

    Raises
    ------
    LawError
        If gains, attitude or period cannot be.
    """

    output: ClassVar[Output] = "wrench"
    above_zero: ClassVar[tuple[str, ...]]  # gains that must not be 0
    memory_of: ClassVar[Callable[..., Any]]  # of attitude (4,), period (1,) and number of regions

    @classmethod
    def for_vehicle(
        cls, vehicle: VehicleModel, gains: Any, desired_quaternion: Array, period: float, n_regions: int
    ) -> WrenchLaw:
        """Return the law, as `CompiledLaw.for_vehicle`; of the vehicle it uses nothing."""
        return cls(gains, desired_quaternion, period, n_regions)

    @classmethod
    def validate(cls, gains: G) -> G:
        """Return gains if the law can work with them."""
        return validate_gains(gains, cls.above_zero)

    def __init__(self, gains: Any, desired_quaternion: Array, period: float, n_regions: int) -> None:
        self.gains, self.n_regions = self.validate(gains), n_regions
        desired, lasting = validate_quaternion(desired_quaternion), np.array([validate_period(period)])
        self.memory = type(self).memory_of(desired, lasting, n_regions)


def validate_period(period: float) -> float:
    """Return a control period [s] if it can be one.

    Parameters
    ----------
    period : float
        [s].

    Returns
    -------
    float
        The same [s].

    Raises
    ------
    LawError
        If it is not a finite number above 0.
    """
    if not 0.0 < period < np.inf:
        raise LawError(f"control period is {period} s, expected a finite number above 0")
    return period


def validate_quaternion(quaternion: Array) -> Array:
    """Return a desired attitude as an array of its own, shape (4,).

    Parameters
    ----------
    quaternion : array_like, shape (4,)
        From body to world.

    Returns
    -------
    ndarray, shape (4,)
        The same.

    Raises
    ------
    LawError
        If it is not of length 1.
    """
    desired = np.array(quaternion, dtype=float)
    if desired.shape != (4,) or not abs(np.linalg.norm(desired) - 1.0) < 1e-6:
        raise LawError(f"desired quaternion is {desired}, expected four numbers of length 1")
    return desired


def validate_gains(gains: G, above_zero: Container[str]) -> G:
    """Return the gains if a law can work with them.

    Parameters
    ----------
    gains : NamedTuple of float
        To be checked.
    above_zero : container of str
        Names of those that must not be 0.

    Returns
    -------
    NamedTuple of float
        The same.

    Raises
    ------
    LawError
        If one is negative or not finite, or one that divides is zero.
    """
    for name, value in zip(type(gains)._fields, gains, strict=True):  # type: ignore[attr-defined]
        positive = name in above_zero
        if not (math.isfinite(value) and (value > 0.0 if positive else value >= 0.0)):
            raise LawError(f"law.gains.{name} is {value}, expected a finite number {'above 0' if positive else '>= 0'}")
    return gains
