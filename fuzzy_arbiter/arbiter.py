"""The arbiter: inputs in, values of the outputs out, by a chosen engine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike

from fuzzy_arbiter.checks import shown
from fuzzy_arbiter.definition import Normalization, Output, Outside, System, variable_names
from fuzzy_arbiter.engines import choose
from fuzzy_arbiter.errors import DefinitionError, InputError
from fuzzy_arbiter.hierarchy import SECTION_VI, WEIGHT, Criterion, Form, prioritized
from fuzzy_arbiter.result import Result, result_class
from fuzzy_arbiter.samples import Columns, Sample, Samples
from fuzzy_arbiter.shapes import Array

if TYPE_CHECKING:
    from fuzzy_arbiter.explanation import Explanation
    from fuzzy_arbiter.verification import Verification


class Arbiter:
    """Evaluate a fuzzy system.

    No result depends on those before it; threads may share it.

    Parameters
    ----------
    system : System or sequence of Criterion
        A fuzzy system; or criteria by descending priority, of which `fuzzy_arbiter.criteria.prioritized` makes one, by
        default obstacle, shape, depth of the paper's section VI.
    criteria : sequence of Criterion, optional
        Criteria in place of `system`.
    form, weight, normalization, outside, points
        Form of the system of criteria, as for `prioritized`.
    engine : {"auto", "closed", "exact", "grid", "skfuzzy"}
        ``closed`` is the exact centroid in closed form, for outputs of two complementary terms; ``exact`` the exact
        centroid of any system; ``grid`` sums over samples, as MATLAB does; ``skfuzzy`` is scikit-fuzzy. ``auto`` takes
        ``closed`` where that is possible, else ``exact``.

    Raises
    ------
    DefinitionError
        If the definition is invalid, or the engine cannot evaluate it.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter, Output, System, Variable, auto_terms
    >>> food, tip = Variable("food", (0, 10), auto_terms(3)), Output("tip", (0, 25), auto_terms(3))
    >>> tipping = Arbiter(System([food], [tip], [f"if food is {term} then tip is {term}" for term in food.term_names]))
    >>> tipping(food=5)
    Result(tip=12.5)
    """

    def __init__(
        self,
        system: System | Sequence[Criterion] = SECTION_VI,
        *,
        criteria: Sequence[Criterion] | None = None,
        form: Form = "hierarchical",
        weight: Output = WEIGHT,
        normalization: Normalization = "range",
        outside: Outside = "refuse",
        points: int = 101,
        engine: str = "auto",
    ) -> None:
        if criteria is not None:
            if system is not SECTION_VI:
                raise DefinitionError("got a system and criteria, expected one of the two")
            system = criteria
        if not isinstance(system, System):
            if not isinstance(system, Iterable):
                raise DefinitionError(f"system is {shown(system)}, expected a System")
            system = prioritized(system, form, weight, normalization, outside, points)
        elif (form, weight, normalization, outside, points) != _DEFAULTS:
            raise DefinitionError("got a System with form, weight, normalization, outside or points, expected it alone")
        self._system = system
        self._engine, self._why = choose(system, engine)
        self._shortcut = self._engine.shortcut()
        self._samples = Samples(system)
        self._result = result_class(system.result_names)

    @property
    def system(self) -> System:
        """The system that the arbiter evaluates."""
        return self._system

    @property
    def engine(self) -> str:
        """Name of the engine that evaluates it."""
        return self._engine.name

    @property
    def engine_reason(self) -> str:
        """Reason for the choice of the engine."""
        return self._why

    @property
    def samples(self) -> Samples:
        """Validator of the inputs."""
        return self._samples

    def __call__(self, inputs: Sample | None = None, /, *others: object, **named: float) -> Result[float]:
        """Return the value of each output for one sample; inputs (inputs,); `others` are refused."""
        if named or others:
            inputs = _one_of(inputs, others, named)
        if self._shortcut is not None:
            kind = type(inputs)
            plain = inputs if kind is list or kind is tuple else self._samples.plain(inputs)
            if plain is not None and (weights := self._shortcut(plain)) is not None:  # type: ignore[arg-type]  # which checks it
                return tuple.__new__(self._result, weights)
        return tuple.__new__(self._result, self._engine.weights(self._samples.one(inputs)))  # type: ignore[arg-type]

    @overload
    def batch(self, inputs: Columns, /, *, nan_policy: str = "raise") -> Result[Array]: ...
    @overload
    def batch(self, inputs: ArrayLike, /, *, nan_policy: str = "raise") -> Array: ...
    @overload
    def batch(self, /, *, nan_policy: str = "raise", **columns: ArrayLike) -> Result[Array]: ...
    def batch(self, inputs: Any = None, /, *others: object, nan_policy: str = "raise", **columns: Any) -> Any:
        """Return the value of each output for many samples.

        Parameters
        ----------
        inputs : array_like, shape (n, inputs); or mapping, data frame, or array of named fields
            One sample in each row; or a column for each input, by name. Other columns of a data frame are passed over.
        *others
            Refused.
        nan_policy : {"raise", "propagate"}
            Treatment of rows with NaN: refused, or NaN for all outputs.
        **columns : array_like, shape (n,), or float
            Columns by keywords, in place of `inputs`; a single value counts for all rows.

        Returns
        -------
        ndarray, shape (n, outputs), or Result of ndarray, shape (n,)
            Rows for rows, columns by name for columns: what the arbiter gives for each sample alone, to rounding. What
            comes in masked arrays is masked where an input is.

        Raises
        ------
        InputError
            If the shape is another, a column is missing, or a value is not a number or outside its universe; the first
            such row is named.

        Examples
        --------
        >>> from fuzzy_arbiter import Arbiter
        >>> Arbiter().batch(obstacle=[0.0, 1.0], shape=1.0, depth=0.5)["obstacle"].tolist()
        [0.0, 1.0]
        """
        inputs = _one_of(inputs, others, columns, "rows, such as [[1, 2], [3, 4]]")
        by_name = is_table(inputs)
        table = self._samples.columns(inputs) if by_name else inputs
        values, missing = self._samples.rows(table, nan_policy)
        if missing.any():
            result = np.full((len(values), len(self._system.outputs)), np.nan)
            result[~missing] = self._engine.weights_of_many(values[~missing])
        else:
            result = self._engine.weights_of_many(values)
        if isinstance(table, np.ma.MaskedArray):
            result = np.ma.MaskedArray(result, np.broadcast_to(missing[:, None], result.shape))
        return tuple.__new__(self._result, result.T) if by_name else result

    def centroids(self, inputs: Sample | None = None, /, *others: object, **named: float) -> Result[float]:
        """Return the raw value of each output, before normalization: the default, or NaN, where no rule fires.

        `inputs`, or `named` ones, are those of a call; `others` are refused.
        """
        return tuple.__new__(self._result, self._engine.centroids(self._samples.one(_one_of(inputs, others, named))))

    def explain(self, inputs: Sample | None = None, /, *others: object, **named: float) -> Explanation:
        """Explain the outputs for a sample: each rule's strength, and the rules that decided.

        `inputs`, or `named` ones, are those of a call; `others` are refused.
        """
        from fuzzy_arbiter.explanation import explain

        return explain(self._engine, self._samples.one(_one_of(inputs, others, named)))

    def verify(self, as_criteria: bool | None = None) -> Verification:
        """Check that the rules are complete and the terms have no gaps; `as_criteria` as for `verification.verify`."""
        from fuzzy_arbiter.verification import verify

        return verify(self._system, as_criteria=as_criteria)

    @classmethod
    def load(
        cls,
        path: str | Path,
        engine: str = "auto",
        *,
        outside: Outside | None = None,
        default: float | str | Mapping[str, float | str] | None = None,
        block: str | None = None,
    ) -> Arbiter:
        """Return the arbiter that a file defines.

        Parameters
        ----------
        path, block
            File and function block, as for `fuzzy_arbiter.formats.load`.
        engine : str
            Name of the engine, as for `Arbiter`.
        outside : {"refuse", "clip"}, optional
            Treatment of an input outside its universe, in place of the file's.
        default : float, "mid-range", or mapping from output's name to these, optional
            Value of all outputs, or of the named ones, where no rule fires, in place of the file's; MATLAB takes the
            middle of the universe.

        Raises
        ------
        FormatError, DefinitionError
            If the file or its definition is invalid, as for `fuzzy_arbiter.formats.load`.
        """
        from fuzzy_arbiter.formats import load

        system = load(path, block)
        try:
            system = replace(system, outside=system.outside if outside is None else outside)
            system = _with_defaults(system, default)
        except DefinitionError as error:
            raise DefinitionError(f"{path}: {error}") from None
        return cls(system, engine=engine)

    def save(self, path: str | Path) -> None:
        """Write the definition to the file `path`, as `fuzzy_arbiter.formats.save` does."""
        from fuzzy_arbiter.formats import save

        save(self._system, path)

    def compiled(self) -> Any:
        """Return ``evaluate(inputs, outputs) -> int``, which compiled loops can call; it needs Numba.

        It fills an array of float64 with what a call gives, and returns 0; or -i if the i-th input is not in its
        universe, or k if no rule fires for the k-th output and that has no default; the outputs are then as they were.
        """
        from fuzzy_arbiter.export.python import compiled

        return compiled(self._system)

    def with_engine(self, engine: str) -> Arbiter:
        """Return an arbiter of the same system with another `engine`, as for `Arbiter`."""
        return Arbiter(self._system, engine=engine)

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (self._system, self.engine)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Arbiter) and (self._system, self.engine) == (other.system, other.engine)

    def __hash__(self) -> int:
        return hash((self._system, self.engine))

    def __repr__(self) -> str:
        return f"Arbiter({self._system!r}, engine={self.engine!r})"

    def __str__(self) -> str:
        return str(self._system)

    def _repr_html_(self) -> str:
        return self._system._repr_html_()


def _one_of(
    inputs: Any, others: Sequence[object], named: Mapping[str, Any], expected: str = "one sample, such as [1, 2]"
) -> Any:
    """Return the inputs that were given by position or by keyword; refuse both at once, and several by position."""
    if others:
        raise InputError(f"got {1 + len(others)} values by position, expected {expected}, or names")
    if not named:
        return inputs
    if inputs is not None:
        raise InputError(f"got inputs by position and {', '.join(named)} by keyword, expected one of the two")
    return named


def is_table(inputs: object) -> bool:
    """Return True for columns by name: a mapping, a data frame, an array of named fields."""
    if isinstance(inputs, np.ndarray):
        return inputs.dtype.names is not None
    return isinstance(inputs, Mapping) or hasattr(inputs, "columns")


def _with_defaults(system: System, default: float | str | Mapping[str, float | str] | None) -> System:
    if default is None:
        return system
    names = variable_names(system.outputs)
    each: dict[str, Any] = dict(default if isinstance(default, Mapping) else dict.fromkeys(names, default))
    for name, value in each.items():
        if name not in names:
            raise DefinitionError(f"default: no output {name!r}, expected one of {', '.join(names)}")
        if isinstance(value, str) and value == "mid-range":
            each[name] = sum(system[name].universe) / 2.0
    return replace(system, outputs=tuple(replace(o, default=each.get(o.name, o.default)) for o in system.outputs))


def _rebuilt(system: System, engine: str) -> Arbiter:  # a name that pickles hold
    return Arbiter(system, engine=engine)


_DEFAULTS = ("hierarchical", WEIGHT, "range", "refuse", 101)
