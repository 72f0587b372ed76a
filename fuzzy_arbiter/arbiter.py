"""The arbiter: inputs in, weights out, by the engine of one's choice."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from fuzzy_arbiter.definition import Normalization, Output, Outside, System
from fuzzy_arbiter.engines import choose
from fuzzy_arbiter.engines.firing import Array
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.hierarchy import SECTION_VI, WEIGHT, Criterion, Form, prioritised
from fuzzy_arbiter.samples import Sample, Samples

if TYPE_CHECKING:
    from fuzzy_arbiter.explanation import Explanation
    from fuzzy_arbiter.verification import Verification


class Arbiter:
    """Decides to what degree each of several prioritised criteria matters now, in the manner of a human pilot.

    Nothing in it changes after it is made; threads may share it.

    Parameters
    ----------
    criteria : sequence of Criterion
        In order of priority, the highest first; default: obstacle, shape, depth of the paper's section VI.
    form, weight, normalization, outside, points
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
    >>> from fuzzy_arbiter import Arbiter
    >>> Arbiter()([1.0, 1.0, 0.0])
    (1.0, 0.0, 0.0)
    """

    def __init__(
        self,
        criteria: Sequence[Criterion] = SECTION_VI,
        *,
        form: Form = "hierarchical",
        weight: Output = WEIGHT,
        normalization: Normalization = "range",
        outside: Outside = "refuse",
        points: int = 101,
        system: System | None = None,
        engine: str = "auto",
    ) -> None:
        if isinstance(criteria, System):
            raise DefinitionError("criteria: a System came, expected Arbiter(system=...)")
        if system is None:
            system = prioritised(criteria, form, weight, normalization, outside, points)
        elif (criteria, form, weight, normalization, outside, points) != (*_DEFAULTS,):
            raise DefinitionError(
                "system: came with criteria, form, weight, normalization, outside or points, which it has"
            )
        self._system = system
        self._engine, self._why = choose(system, engine)
        self._shortcut = self._engine.shortcut()
        self._samples = Samples(system)

    @property
    def system(self) -> System:
        """What is evaluated."""
        return self._system

    @property
    def engine(self) -> str:
        """Name of the engine that evaluates it."""
        return self._engine.name

    @property
    def engine_reason(self) -> str:
        """Why it is this engine."""
        return self._why

    @property
    def samples(self) -> Samples:
        """What checks the inputs."""
        return self._samples

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
        return self._engine.weights(self._samples.one(inputs))

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
        return self._engine.weights_of_many(self._samples.many(inputs))

    def centroids(self, inputs: Sample) -> tuple[float, ...]:
        """Return the raw value of each output for one sample, before normalization.

        Parameters
        ----------
        inputs : sequence of float, or mapping from input's name to float
            As for a call.

        Returns
        -------
        tuple of float
            Centroids in the outputs' universes, or the defaults where no rule fires.

        Raises
        ------
        InputError, UndefinedOutputError
            As for a call.
        """
        return tuple(self._engine.centroids(self._samples.one(inputs)))

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

        return explain(self._engine, self._samples.one(inputs))

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
