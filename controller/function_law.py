"""A custom law as a plain function: measured state and region values in, forces out."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from controller.errors import LawError
from controller.law import Array, Diagnostic, Output, VehicleState
from controller.regions.region_set import PackedRegions, RegionEvaluator

_REAL = "biufO"  # kinds of NumPy's types of real numbers; O holds whole numbers too long for the others
_LONGEST = 200  # maximum number of characters of a value in a message


class RegionsSeen(NamedTuple):
    """Regions evaluated at the measured pose; row i belongs to region i, in the order of the scenario.

    Examples
    --------
    >>> from controller import FunctionLaw
    >>> def away(state, goal, regions, weights):
    ...     nearest = regions.clearances.argmin()
    ...     return [*(-100.0 * regions.gradients[nearest]), 0.0, 0.0, 0.0]
    >>> FunctionLaw(away).output
    'wrench'
    """

    values: Array  # (n,) g, above 0 where violated, in the unit of the shape
    gradients: Array  # (n, 3) dg/dp, world frame
    rotation_gradients: Array  # (n, 3) dg/dtheta [1/rad], for a small rotation about the body's axes
    clearances: Array  # (n,) distance to the surface, m (rad for shapes of attitude), below 0 where violated
    velocities: Array  # (n, 3) m/s, NED
    gains: Array  # (n,) alpha_i
    hard: NDArray[np.bool_]  # (n,) True for a hard region, which the vehicle must not violate


LawFunction = Callable[[VehicleState, RegionsSeen, RegionsSeen, Array], ArrayLike]


class FunctionLaw:
    """A law that is a custom function; it fulfils the protocol `Law`.

    Parameters
    ----------
    function : callable
        ``function(state, goal, regions, weights)``, called once every control period. `goal` has one row, `regions`
        one for each secondary region; `weights`, shape (n,), are those of the arbiter in [0, 1]. All are
        copies. It returns the forces of the coming period. It may keep a state between calls: an object
        with a method ``__call__`` will do.
    output : {"wrench", "thrusters"}
        Kind of the forces: a wrench, shape (6,) [N, N m], body frame, or the thruster forces, shape (m,) [N].

    Attributes
    ----------
    name : str
        Module and name of the function, such as ``my_laws:steer``.

    Raises
    ------
    LawError
        If `function` cannot be called, is a class, or `output` is neither of the two.

    Examples
    --------
    >>> from controller import FunctionLaw
    >>> def brake(state, goal, regions, weights):
    ...     return -30.0 * state.velocity_body
    >>> FunctionLaw(brake).output
    'wrench'
    """

    diagnostics: tuple[Diagnostic, ...] = ()

    def __init__(self, function: LawFunction, output: Output = "wrench") -> None:
        if not callable(function) or isinstance(function, type):
            raise LawError(f"law is {_shown(function)}, expected a function of state, goal, regions and weights")
        if output not in get_args(Output):
            raise LawError(f"output of a law is {output!r}, expected one of {', '.join(map(repr, get_args(Output)))}")
        self.output: Output = output
        self.name = qualified_name(function)
        self._function = function
        self._evaluators: dict[str, RegionEvaluator] = {}

    @property
    def estimate(self) -> Array:
        """Zeros, shape (4,): a function reports no estimate."""
        return np.zeros(4)

    @property
    def report(self) -> Array:
        """Empty, shape (0,): a function reports no diagnostics."""
        return np.zeros(0)

    def step(
        self, state: VehicleState, goal: PackedRegions, regions: PackedRegions, weights: Array, forces: Array
    ) -> None:
        """Call the function, and write its forces.

        Parameters
        ----------
        state, goal, regions, weights
            State, regions and weights, as for `Law.step`.
        forces : ndarray, shape (6,) or (n_thrusters,)
            Receives the forces [N, N m], as for `Law.step`.

        Raises
        ------
        LawError
            If the function returns anything but finite numbers of the right shape.
        """
        state_copy = VehicleState(*(part.copy() for part in state))
        goal_seen, regions_seen = self._seen("goal", goal, state), self._seen("regions", regions, state)
        received = self._function(state_copy, goal_seen, regions_seen, weights.copy())
        numbers = _real_numbers(received)
        if numbers.shape != forces.shape or not np.isfinite(numbers).all():
            unit = "N and N m" if self.output == "wrench" else "N"
            raise LawError(
                f"law {self.name} returned {_shown(received)}, expected {forces.size} finite numbers [{unit}]"
            )
        forces[:] = numbers

    def _seen(self, name: str, regions: PackedRegions, state: VehicleState) -> RegionsSeen:
        """Evaluate goal or regions at the measured pose."""
        evaluator = self._evaluators.get(name)
        if evaluator is None or evaluator.regions is not regions:
            evaluator = self._evaluators[name] = RegionEvaluator(regions)
        evaluation = evaluator.evaluate(state.position, state.quaternion)
        return RegionsSeen(*evaluation, regions.velocities.copy(), regions.gains.copy(), regions.hard.copy())


def _real_numbers(received: object) -> Array:
    """Return a value as an array of floats; empty where it is not an array of real numbers."""
    try:
        array = np.asarray(received)
        return array.astype(float) if array.dtype.kind in _REAL else np.empty(0)
    except (TypeError, ValueError, OverflowError):
        return np.empty(0)


def _shown(received: object) -> str:
    """Format a value as one line, cut where it is long."""
    text = " ".join(repr(received).split())
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def qualified_name(law: object) -> str:
    """Return module and name of a function, or of an object's class."""
    named = law if hasattr(law, "__qualname__") else type(law)
    module, name = str(named.__module__), str(named.__qualname__)
    script = getattr(sys.modules.get(module), "__file__", None) if module == "__main__" else None
    return f"{Path(script).name if script else module}:{name}"
