"""The interface of every law: state, regions and weights in; a body wrench or thruster forces out."""

# A law's mathematics is one compiled function `step(state, goal, regions, weights, gains, memory, forces)`. Its state
# between steps is its `memory`, a record of numbers and arrays, so that the same function serves the readable master,
# which calls `CompiledLaw.step`, and compiled loops, which call the function itself.

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Container
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from controller.compiling.function import BoundCall, CompiledFunction
from controller.errors import LawError
from controller.regions.region_set import PackedRegions
from controller.stack_array import Columns6, Matrix6, Shape, Vector3, Vector4, Vector6
from controller.state import State

Array = NDArray[np.float64]
Nothing = Annotated[Array, Shape(0)]
Output = Literal["wrench", "thrusters"]
G = TypeVar("G", bound=tuple[float, ...])


_NO_DEVIATION = np.zeros(12)
_NO_DEVIATION.flags.writeable = False
NOTHING_EXPECTED = np.full(6, np.nan)
NOTHING_EXPECTED.flags.writeable = False


class VehicleState(NamedTuple):
    """The measured state of the vehicle.

    Examples
    --------
    >>> import numpy as np
    >>> from controller import VehicleState
    >>> state = VehicleState(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(6), np.ones(8))
    >>> state.velocity_body.shape
    (6,)
    """

    position: Vector3  # m, NED
    quaternion: Vector4  # unit quaternion from body to world, scalar first
    velocity_body: Vector6  # velocity over ground, body frame, m/s, rad/s
    thruster_health: Array  # (m,) 1 working, or not reported as failed; 0 reported to give no force
    deviation: Array = _NO_DEVIATION  # (12,) standard deviations of position [m], velocity [m/s], attitude [rad],
    # world axes, and rates [rad/s], body, of an estimate; 0: a measurement, whose noise is that of the law's gains


class VehicleModel(NamedTuple):
    """Nominal numbers of a vehicle for a law, without weight, buoyancy, their centers, and the current."""

    rigid_mass: Matrix6  # kg, kg m2, with the center of gravity taken to be the origin
    added_mass: Matrix6  # kg, kg m, kg m2
    linear_damping: Vector6  # N s/m, N m s/rad
    quadratic_damping: Vector6  # N s2/m2, N m s2/rad2
    thruster_matrix: Columns6  # body wrench of one newton of each thruster
    thrust_min: Array  # (m,) N, minimum force of each thruster, 0 or negative
    thrust_max: Array  # (m,) N, maximum force of each thruster
    thrust_time_constant: Array  # (m,) s, time constant of each thruster's lag
    trim: Vector6  # N, N m: constant wrench on the body
    righting_moment: float = 0.0  # N m, z_G W - z_B B, where a law must leave an axis to it, or may have to


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

    diagnostics: tuple[Diagnostic, ...]  # description of the numbers in `report`

    @property
    def output(self) -> Output:
        """Kind of the forces that `step` writes."""
        ...

    @property
    def estimate(self) -> Array:
        """phi-hat (12), shape (4,) [N, N m]."""
        ...

    @property
    def report(self) -> Array:
        """Diagnostics of the last step, shape (len(diagnostics),)."""
        ...

    def step(
        self, state: VehicleState, goal: PackedRegions, regions: PackedRegions, weights: Array, forces: Array
    ) -> None:
        """Write the wrench, shape (6,) [N, N m], or the thruster forces, shape (m,) [N], of the coming period.

        For `state`, `goal`, `regions`, `weights` and `forces` see `CompiledLaw.step`.
        """
        ...


class CompiledLaw:
    """A law made of a compiled function, its gains and its memory.

    Attributes
    ----------
    gains : NamedTuple
        Constant numbers of the law.
    memory : State, or NamedTuple of ndarray
        State between steps; it has at least ``estimate`` and ``report``.
    n_regions, n_forces : int
        Number of secondary regions, and of forces.

    Examples
    --------
    >>> from controller import LAWS
    >>> LAWS["deployable"].output
    'thrusters'
    >>> LAWS["pd"].gains_type()._fields[:2]
    ('k_p1', 'k_p2')
    """

    name: ClassVar[str]  # name of the law's module, set when the laws are loaded
    output: ClassVar[Output]
    function: ClassVar[Any]  # plain Python in the translator's subset, or anything that can be called
    gains_type: ClassVar[type[Any]]  # a NamedTuple of floats with defaults
    above_zero: ClassVar[tuple[str, ...]] = ()  # gains that must not be 0
    gains_for: ClassVar[str] = ""  # vehicle for which the defaults were found; "" where they hold for any
    takes_speed: ClassVar[bool] = False  # True if it keeps to `speed_limit` of its memory
    diagnostics: tuple[Diagnostic, ...] = ()
    gains: Any
    memory: Any
    n_regions: int
    n_forces: int = 6
    _state: VehicleState | None = None  # state of the last step

    @classmethod
    def for_vehicle(
        cls, vehicle: VehicleModel, gains: Any, desired_quaternion: Array, period: float, n_regions: int
    ) -> CompiledLaw:
        """Return the law for a vehicle.

        Parameters
        ----------
        vehicle : VehicleModel
            Known numbers of the vehicle.
        gains : NamedTuple
            Gains of `gains_type`.
        desired_quaternion : array_like, shape (4,)
            Attitude to be kept, from body to world.
        period : float
            Control period [s].
        n_regions : int
            Number of secondary regions.

        Returns
        -------
        CompiledLaw
            The law, with a memory of its own.

        Raises
        ------
        LawError
            If gains, attitude or period are invalid.
        """
        return cls(vehicle, gains, desired_quaternion, period, n_regions)  # type: ignore[call-arg]

    @classmethod
    def validate(cls, gains: G) -> G:
        """Validate gains, and return them.

        Parameters
        ----------
        gains : NamedTuple
            Gains of `gains_type`.

        Returns
        -------
        NamedTuple
            The same gains.

        Raises
        ------
        LawError
            If the law cannot work with them.
        """
        return validate_gains(gains, cls.above_zero)

    def set_attitude(self, quaternion: Array) -> None:
        """Set the desired attitude from the next step on.

        Parameters
        ----------
        quaternion : array_like, shape (4,)
            Desired attitude, a unit quaternion from body to world, scalar first.

        Raises
        ------
        LawError
            If the quaternion is not of length 1.
        """
        self.desired_quaternion[:] = validate_quaternion(quaternion)

    @property
    def desired_quaternion(self) -> Array:
        """Desired attitude, a unit quaternion from body to world, shape (4,)."""
        desired: Array = self.memory.desired_quaternion
        return desired

    @property
    def attitude_target(self) -> Array:
        """Attitude that a mission may write before each step, and turns steadily: shape (4,), as desired."""
        target: Array = getattr(self.memory, "desired_quaternion", np.zeros(4))  # a memory of one's own may have none
        return target

    @property
    def speed_limit(self) -> Array:
        """Greatest speed to aim at [m/s], shape (), which a mission may write before each step."""
        limit: Array = self.memory.storage("speed_limit")
        return limit

    @property
    def estimate(self) -> Array:
        """phi-hat (12), shape (4,) [N, N m]."""
        estimate: Array = self.memory.estimate
        return estimate

    @property
    def report(self) -> Array:
        """Diagnostics of the last step, shape (len(diagnostics),)."""
        report: Array = self.memory.report
        return report

    @property
    def expected(self) -> Array:
        """Position [m, NED] and velocity over ground [m/s, body] at the next step, shape (6,); NaN: not estimated."""
        return NOTHING_EXPECTED

    def step(
        self, state: VehicleState, goal: PackedRegions, regions: PackedRegions, weights: Array, forces: Array
    ) -> None:
        """Write the forces of the coming control period, and update the memory.

        Parameters
        ----------
        state : VehicleState
            Measured state.
        goal : PackedRegions
            The primary region alone.
        regions : PackedRegions
            The n secondary regions.
        weights : ndarray, shape (n,)
            Weight of each secondary region, from the arbiter, in [0, 1].
        forces : ndarray, shape (6,) or (m,)
            Receives the wrench [N, N m], body frame, or the thruster forces [N]; `output` states which.
        """
        if state is not self._state and not all(part.flags.c_contiguous for part in state):
            state = VehicleState(*(part.copy() for part in state))  # C needs contiguous arrays
        self._state = state
        self._step(state, goal, regions, weights, self.gains, self.memory, forces)

    def bound(
        self, state: VehicleState, goal: PackedRegions, regions: PackedRegions, weights: Array, forces: Array
    ) -> BoundCall:
        """Return the step with these arguments, those of `step`, as a call that C code can make."""
        return BoundCall(*self.step_call(state, goal, regions, weights, forces))

    def step_call(
        self, state: VehicleState, goal: PackedRegions, regions: PackedRegions, weights: Array, forces: Array
    ) -> tuple[Callable[..., None], tuple[Any, ...]]:
        """Return the function of `step`, and its arguments for these of `step`."""
        return type(self).function, (state, goal, regions, weights, self.gains, self.memory, forces)

    @functools.cached_property
    def _step(self) -> CompiledFunction:
        return CompiledFunction(type(self).function)


class LawMemory(State):
    """What a law remembers at least; fields of its own are those of a subclass."""

    desired_quaternion: Vector4
    period: float  # s
    speed_limit: float = math.inf  # m/s, greatest to aim at; laws with `takes_speed` keep to it
    estimate: Vector4  # phi-hat [N, N m]; zeros of a law that estimates nothing
    report: Nothing


class WrenchLaw(CompiledLaw):
    """A law that gives a wrench, and uses no numbers of the vehicle; desired_quaternion (4,), period [s]."""

    output: ClassVar[Output] = "wrench"
    memory_type: ClassVar[type[LawMemory]] = LawMemory

    @classmethod
    def for_vehicle(
        cls, vehicle: VehicleModel, gains: Any, desired_quaternion: Array, period: float, n_regions: int
    ) -> WrenchLaw:
        """Return the law, as `CompiledLaw.for_vehicle`; the vehicle is not used."""
        return cls(gains, desired_quaternion, period, n_regions)

    @classmethod
    def make_memory(cls, desired_quaternion: Array, period: Array, n_regions: int) -> Any:
        """Return the memory before the first step; `period` [s] has shape (1,)."""
        return cls.memory_type(n=n_regions, desired_quaternion=desired_quaternion, period=period)

    def __init__(self, gains: Any, desired_quaternion: Array, period: float, n_regions: int) -> None:
        self.gains, self.n_regions = self.validate(gains), n_regions
        desired, lasting = validate_quaternion(desired_quaternion), np.array([validate_period(period)])
        self.memory = self.make_memory(desired, lasting, n_regions)


def validate_period(period: float) -> float:
    """Validate a control period [s], and return it."""
    if not 0.0 < period < np.inf:
        raise LawError(f"control period is {period} s, expected a finite number above 0")
    return period


def validate_quaternion(quaternion: Array) -> Array:
    """Validate a desired attitude, and return it as an array of its own, shape (4,)."""
    desired = np.array(quaternion, dtype=float)
    if desired.shape != (4,) or not abs(np.linalg.norm(desired) - 1.0) < 1e-6:
        raise LawError(f"desired quaternion is {desired}, expected four numbers of length 1")
    return desired


def validate_gains(gains: G, above_zero: Container[str]) -> G:
    """Validate gains, and return them."""
    for name, value in zip(type(gains)._fields, gains, strict=True):  # type: ignore[attr-defined]
        positive = name in above_zero
        if not (math.isfinite(value) and (value > 0.0 if positive else value >= 0.0)):
            raise LawError(f"law.gains.{name} is {value}, expected a finite number {'above 0' if positive else '>= 0'}")
    return gains
