"""The arbiter: inputs in, weights out, by the engine of one's choice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from fuzzy_arbiter.definition import Normalisation, Output, Outside, System, variable_names
from fuzzy_arbiter.engines import choose
from fuzzy_arbiter.engines.firing import Array
from fuzzy_arbiter.errors import DefinitionError, InputError
from fuzzy_arbiter.hierarchy import SECTION_VI, WEIGHT, Criterion, Form, prioritised

if TYPE_CHECKING:
    from fuzzy_arbiter.explanation import Explanation
    from fuzzy_arbiter.verification import Verification

Sample = Sequence[float] | Mapping[str, float]


class Arbiter:
    """Decides to what degree each of several prioritised criteria matters now, in the manner of a human pilot.

    Nothing in it changes after it is made; threads may share it.

    Parameters
    ----------
    criteria : sequence of Criterion
        In order of priority, the highest first; default: obstacle, shape, depth of the paper's section VI.
    form, weight, normalisation, outside, points
        How the criteria become a system, as of `prioritised`.
    system : System, optional
        Any other Mamdani system, in the place of all of the above.
    engine : {"auto", "closed", "exact", "grid", "skfuzzy"}
        ``closed`` is the exact centroid in closed form, for outputs of two complementary terms; ``exact`` the exact
        centroid of any system; ``grid`` what scikit-fuzzy's sampling gives, without the sampling; ``skfuzzy`` is
        scikit-fuzzy itself. ``auto`` takes ``closed`` where that is possible, else ``exact``.

    Raises
    ------
    DefinitionError
        If the definition makes no arbiter, or the engine cannot evaluate it.

    Examples
    --------
    >>> Arbiter()([1.0, 1.0, 0.0])
    (1.0, 0.0, 0.0)
    """

    def __init__(
        self,
        criteria: Sequence[Criterion] = SECTION_VI,
        *,
        form: Form = "hierarchical",
        weight: Output = WEIGHT,
        normalisation: Normalisation = "range",
        outside: Outside = "refuse",
        points: int = 101,
        system: System | None = None,
        engine: str = "auto",
    ) -> None:
        if system is None:
            system = prioritised(criteria, form, weight, normalisation, outside, points)
        elif (criteria, form, weight, normalisation, outside, points) != (*_DEFAULTS,):
            raise DefinitionError(
                "system: came with criteria, form, weight, normalisation, outside or points, which it has"
            )
        self._system = system
        self._engine, self._why = choose(system, engine)
        self._shortcut = self._engine.shortcut()
        self._limits = tuple(v.universe for v in system.inputs)
        self._names = variable_names(system.inputs)

    @property
    def system(self) -> System:
        """What is evaluated."""
        return self._system

    @property
    def engine(self) -> str:
        """Name of the engine that evaluates it."""
        return self._engine.name

    @property
    def why(self) -> str:
        """Why it is this engine."""
        return self._why

    def __call__(self, inputs: Sample) -> tuple[float, ...]:
        """Return the weights for one sample.

        Parameters
        ----------
        inputs : sequence of float, or mapping from input's name to float
            One value for each input; for plain criteria the degree in [0, 1] to which each asks for attention.

        Returns
        -------
        tuple of float
            One weight for each output.

        Raises
        ------
        InputError
            If an input is missing, unknown, not a number, or outside its universe (unless that clips).
        UndefinedOutputError
            If no rule fires for an output without default.
        """
        if self._shortcut is not None and (type(inputs) is list or type(inputs) is tuple):
            weights = self._shortcut(inputs)
            if weights is not None:
                return weights
        return self._engine.weights(self._checked(inputs))

    def batch(self, inputs: ArrayLike) -> Array:
        """Return the weights for many samples.

        Parameters
        ----------
        inputs : array_like, shape (n, inputs)
            One sample in each row.

        Returns
        -------
        ndarray, shape (n, outputs)
            Weights, in each row those that the arbiter gives for that sample alone, to rounding.

        Raises
        ------
        InputError
            If the shape is another, or a value is not a number or outside its universe; the first such row is named.
        UndefinedOutputError
            If no rule fires for an output without default; the first such row is named.
        """
        return self._engine.weights_of_many(self._checked_many(inputs))

    def _checked(self, inputs: Sample) -> Sequence[float]:
        try:
            values = inputs if type(inputs) is list or type(inputs) is tuple else self._in_order(inputs)
            for x, (low, high) in zip(values, self._limits, strict=True):
                if not low <= x <= high:  # NaN too
                    return self._clipped(values)
        except (TypeError, ValueError):
            raise self._fault(inputs) from None
        return values

    def _clipped(self, values: Sequence[float]) -> list[float]:
        if self._system.outside != "clip" or any(x != x for x in values):
            raise self._fault(values)
        return [min(max(x, low), high) for x, (low, high) in zip(values, self._limits, strict=True)]

    def _in_order(self, inputs: Sample) -> list[float]:
        if isinstance(inputs, Mapping):
            for name in self._names:
                if name not in inputs:
                    raise InputError(f"{name}: input is missing, expected {', '.join(self._names)}")
            for name in inputs:
                if name not in self._names:
                    raise InputError(f"{name}: unknown input, expected {', '.join(self._names)}")
            return [inputs[name] for name in self._names]
        if isinstance(inputs, np.ndarray):
            return list(inputs.tolist())
        if isinstance(inputs, Sequence):
            return list(inputs)
        raise TypeError(inputs)

    def _fault(self, inputs: Sample) -> InputError:
        """Find out what is wrong with a sample that was refused."""
        try:
            values = self._in_order(inputs)
        except TypeError:
            return InputError(f"inputs are {inputs!r}, expected {len(self._names)} numbers")
        if len(values) != len(self._names):
            return InputError(f"{len(values)} inputs came, expected {len(self._names)}: {', '.join(self._names)}")
        for name, x, (low, high) in zip(self._names, values, self._limits, strict=True):
            if not isinstance(x, Real) or x != x or (self._system.outside == "refuse" and not low <= x <= high):
                return InputError(f"{name}: input is {x!r}, expected a number in [{low:g}, {high:g}]")
        return InputError(f"inputs are {inputs!r}, expected {len(self._names)} numbers")

    def _checked_many(self, inputs: ArrayLike) -> Array:
        try:
            values = np.asarray(inputs, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(f"inputs: {error}, expected numbers") from None
        if values.ndim != 2 or values.shape[1] != len(self._names):
            raise InputError(f"inputs have the shape {values.shape}, expected (n, {len(self._names)})")
        low, high = np.array(self._limits).T
        if values.size and low.max() <= values.min() and values.max() <= high.min():  # for NaN neither holds
            return values
        clip = self._system.outside == "clip"
        good = ~np.isnan(values) if clip else (low <= values) & (values <= high)
        if not good.all():
            row, i = np.argwhere(~good)[0]
            expected = f"expected a number in [{low[i]:g}, {high[i]:g}]"
            raise InputError(f"row {row}: {self._names[i]} is {float(values[row, i])!r}, {expected}")
        return np.clip(values, low, high) if clip else values

    def explain(self, inputs: Sample) -> Explanation:
        """Return which rules fired for one sample, how strongly, and which decided.

        Parameters
        ----------
        inputs : sequence of float, or mapping from input's name to float
            As for a call.

        Returns
        -------
        Explanation
            As data; its text is for people.

        Raises
        ------
        InputError, UndefinedOutputError
            As for a call.
        """
        from fuzzy_arbiter.explanation import explain

        return explain(self, self._checked(inputs))

    def verify(self) -> Verification:
        """Return whether the rules are complete, consistent and exclusive, and the terms without gaps.

        Returns
        -------
        Verification
            As data; its text is for people.
        """
        from fuzzy_arbiter.verification import verify

        return verify(self._system)

    @classmethod
    def load(cls, path: str | Path, engine: str = "auto") -> Arbiter:
        """Return the arbiter that a file defines.

        Parameters
        ----------
        path : str or Path
            Of a JSON, TOML, FCL, FIS or FLL file, told by its suffix.
        engine : str
            As of `Arbiter`.

        Returns
        -------
        Arbiter
            Of the system in the file.

        Raises
        ------
        FormatError
            If the file cannot be read, is not of its format, or says what this package does not know.
        DefinitionError
            If what it defines cannot be.
        """
        from fuzzy_arbiter.formats import load

        return cls(system=load(path), engine=engine)

    def save(self, path: str | Path) -> None:
        """Write the definition to a file.

        Parameters
        ----------
        path : str or Path
            Of a JSON, TOML, FCL, FIS or FLL file, told by its suffix.

        Raises
        ------
        UnsupportedError
            If the format cannot say all of the definition; nothing is written then.
        FormatError
            If the file cannot be written.
        """
        from fuzzy_arbiter.formats import save

        save(self._system, path)

    def compiled(self) -> Any:
        """Return the arbiter as a function that compiled loops can call; Numba is needed.

        Returns
        -------
        numba dispatcher
            ``evaluate(inputs, outputs) -> int`` on arrays of float64: fills the outputs with what a call gives, and
            returns 0, or -i if the i-th input is bad, or k if the k-th output is undefined.

        Raises
        ------
        EngineError
            If Numba is not installed.
        """
        from fuzzy_arbiter.compiled import compiled

        return compiled(self._system)

    def with_engine(self, engine: str) -> Arbiter:
        """Return an arbiter of the same system with another engine.

        Parameters
        ----------
        engine : str
            As of `Arbiter`.

        Returns
        -------
        Arbiter
            A new one.
        """
        return Arbiter(system=self._system, engine=engine)

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (self._system, self.engine)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Arbiter) and (self._system, self.engine) == (other.system, other.engine)

    def __hash__(self) -> int:
        return hash((self._system, self.engine))

    def __repr__(self) -> str:
        return f"Arbiter(system={self._system!r}, engine={self.engine!r})"

    def __str__(self) -> str:
        return str(self._system)


def _rebuilt(system: System, engine: str) -> Arbiter:
    return Arbiter(system=system, engine=engine)


_DEFAULTS = (SECTION_VI, "hierarchical", WEIGHT, "range", "refuse", 101)
