"""Weights that do not chatter: latches on the criteria in front of an arbiter."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import System, Variable, variable_names
from fuzzy_arbiter.errors import DefinitionError, InputError
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.result import Result
from fuzzy_arbiter.samples import Sample
from fuzzy_arbiter.shapes import Array, Shape
from fuzzy_arbiter.verification.cells import stretches
from fuzzy_arbiter.verification.questions import Questions, greatest_term

Setting = float | Mapping[str, float]
EFFORT = 100_000_000  # maximum number of statements of the search for the row at rest, less than a second


class HysteresisArbiter:
    """An arbiter of prioritized criteria with a latch on each of them.

    Each criterion has a latch. It closes as soon as the criterion's degree reaches `enter`, and opens when the degree
    has come down to `release` and the latch has been closed for `dwell`. While it is closed the criterion counts as
    fully on, otherwise as fully off, so that the weights are those of a crisp row and change only when a latch does. A
    noise of the degree that is smaller than `enter` - `release` does not make them chatter.

    It has state: one for each stream of inputs, and not to be shared by threads. The arbiter inside does not change.

    Parameters
    ----------
    arbiter : Arbiter
        Arbiter of which each input has two complementary terms.
    enter : float or mapping from input's name to float
        Degree of the on-term at which the latch closes, above `release`, at most 1.
    release : float or mapping from input's name to float
        Degree of the on-term at which it may open, at least 0.
    dwell : float or mapping from input's name to float
        Least time that it stays closed [s]. It closes without delay: an obstacle must count at once.
    graded : bool
        True if a criterion whose latch is open counts with its degree, in place of fully off. Weights then rise
        smoothly before `enter`, and follow the noise there; when the latch opens they jump.
    on : mapping from input's name to str, optional
        Term of each input that asks for attention. By default the one that is not in the row at rest, which is the only
        crisp row in which no output is in its greatest term.

    Raises
    ------
    DefinitionError
        If a setting is out of its range, or the inputs are no criteria.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> from fuzzy_arbiter.criteria import HysteresisArbiter
    >>> steady = HysteresisArbiter(Arbiter(), enter=0.8, release=0.2)
    >>> [steady([degree, 0.0, 0.0], 0.1 * i)[0] for i, degree in enumerate([0.7, 0.9, 0.3, 0.1])]
    [0.0, 1.0, 1.0, 0.0]
    """

    def __init__(
        self,
        arbiter: Arbiter,
        enter: Setting,
        release: Setting,
        dwell: Setting = 0.0,
        *,
        graded: bool = False,
        on: Mapping[str, str] | None = None,
    ) -> None:
        if not isinstance(arbiter, Arbiter):
            raise DefinitionError(f"arbiter is {arbiter!r}, expected an Arbiter")
        if not isinstance(graded, bool):
            raise DefinitionError(f"graded is {graded!r}, expected True or False")
        variables = arbiter.system.inputs
        self.arbiter = arbiter
        self._names = variable_names(variables)
        received = {"enter": enter, "release": release, "dwell": dwell}
        self._enter, self._release, self._dwell = (_settings(key, x, self._names) for key, x in received.items())
        for name, upper, lower in zip(self._names, self._enter, self._release, strict=True):
            if not lower < upper:
                raise DefinitionError(f"release: got {lower:g} for {name!r}, expected less than enter, {upper:g}")
        self._graded = graded
        self._on = _on_terms(arbiter.system, on)
        shapes = {(v.name, term.name): term.straight for v in variables for term in v.terms}
        self._shapes = [shapes[pair] for pair in zip(self._names, self._on, strict=True)]
        pairs = list(zip(variables, self._shapes, strict=True))
        self._on_positions, self._off_positions = ([_position(v, shape, x) for v, shape in pairs] for x in (1.0, 0.0))
        self.reset()

    def reset(self) -> None:
        """Open all latches and clear the time, as before the first sample."""
        # time at which each latch closed [s]; None while it is open
        self._since: list[float | None] = [None] * len(self._names)
        self._time = -math.inf

    @property
    def active(self) -> dict[str, bool]:
        """True for each criterion whose latch is closed, else False; by the input's name."""
        return {name: since is not None for name, since in zip(self._names, self._since, strict=True)}

    def __call__(self, inputs: Sample, time: float | None = None) -> Result[float]:
        """Return the weights for the next sample; time [s]."""
        now = self._time if time is None and not any(self._dwell) else _validate_time(time, self._time)
        values = self.arbiter.samples.one(inputs)
        degrees = [shape(x) for shape, x in zip(self._shapes, values, strict=True)]
        since, adjusted_values = self._next(self._since, values, degrees, now)
        weights = self.arbiter(adjusted_values)
        self._since, self._time = since, now
        return weights

    def scan(self, inputs: ArrayLike, times: ArrayLike | None = None) -> Array:
        """Return the weights for a sequence of samples, shape (n, outputs); it continues the samples before.

        Parameters
        ----------
        inputs : array_like, shape (n, inputs)
            One sample in each row.
        times : array_like, shape (n,), optional
            Times of the measurements [s]; they never decrease. Only a dwell needs them.

        Raises
        ------
        InputError
            If a shape is another, a time is not finite or decreases, or a value is not a number or outside its
            universe; the first such row is named, and the state is as before.
        """
        values = self.arbiter.samples.many(inputs)
        if times is None and not any(self._dwell):
            moments = np.full(len(values), self._time)
        else:
            moments = _validate_times(times, len(values), self._time)
        degrees = np.column_stack([s.of_many(values[:, i]) for i, s in enumerate(self._shapes)])
        since = self._since
        adjusted_values = np.empty_like(values)
        for i, (row, degree, now) in enumerate(zip(values.tolist(), degrees.tolist(), moments.tolist(), strict=True)):
            since, adjusted_values[i] = self._next(since, row, degree, now)
        weights = self.arbiter.batch(adjusted_values)
        if len(moments):
            self._since, self._time = since, float(moments[-1])
        return weights

    def batch(self, inputs: ArrayLike) -> NoReturn:
        """Refuse any inputs with an `InputError`: the rows of a batch are independent; `scan` keeps their order."""
        raise InputError("batch: its rows are independent, but latches need an order; expected scan(inputs, times)")

    def _next(
        self, before: Sequence[float | None], values: Sequence[float], degrees: Sequence[float], now: float
    ) -> tuple[list[float | None], list[float]]:
        """Return the times at which the latches closed after one sample, and the inputs of the arbiter."""
        result, adjusted = list(before), list(values)
        for i, (since, degree, dwell) in enumerate(zip(before, degrees, self._dwell, strict=True)):
            if degree >= self._enter[i]:
                result[i] = now if since is None else since
            elif since is not None and degree <= self._release[i] and (not dwell or now - since >= dwell):
                result[i] = None
            if result[i] is not None:
                adjusted[i] = self._on_positions[i]
            elif not self._graded:
                adjusted[i] = self._off_positions[i]
        return result, adjusted

    def __repr__(self) -> str:
        settings = {"enter": self._enter, "release": self._release, "dwell": self._dwell}
        arguments = ", ".join(f"{key}={dict(zip(self._names, x, strict=True))!r}" for key, x in settings.items())
        on = dict(zip(self._names, self._on, strict=True))
        return f"HysteresisArbiter({self.arbiter!r}, {arguments}, graded={self._graded}, on={on!r})"


_RANGES: dict[str, tuple[str, Callable[[float], bool]]] = {
    "enter": ("a number in (0, 1]", lambda x: 0.0 < x <= 1.0),
    "release": ("a number in [0, 1)", lambda x: 0.0 <= x < 1.0),
    "dwell": ("seconds, at least 0", lambda x: 0.0 <= x < math.inf),
}


def _settings(key: str, received: Setting, names: Sequence[str]) -> list[float]:
    """Return one setting for each input, from one for all or from a mapping."""
    expected, is_valid = _RANGES[key]
    by_name = received if isinstance(received, Mapping) else dict.fromkeys(names, received)
    _require_names(key, by_name, names)
    for name, x in by_name.items():
        if not isinstance(x, Real) or isinstance(x, bool) or not is_valid(float(x)):
            where = f" for {name!r}" if by_name is received else ""
            raise DefinitionError(f"{key}: got {x!r}{where}, expected {expected}")
    return [float(by_name[name]) for name in names]


def _require_names(key: str, received: Mapping[str, object], names: Sequence[str]) -> None:
    for name in received:
        if name not in names:
            raise DefinitionError(f"{key}: {name!r} is no input, expected {', '.join(names)}")
    for name in names:
        if name not in received:
            raise DefinitionError(f"{key}: got nothing for {name!r}, expected {', '.join(names)}")


def _on_terms(system: System, on: Mapping[str, str] | None) -> list[str]:
    """Return the term of each input that asks for attention."""
    names = variable_names(system.inputs)
    for v in system.inputs:
        if len(v.terms) != 2 or stretches(v):
            what = "its terms are no criterion, expected two that sum to 1 everywhere"
            raise DefinitionError(f"input {v.name!r}: {what}")
    if on is not None:
        if not isinstance(on, Mapping):
            raise DefinitionError(f"on is {on!r}, expected a term for each of {', '.join(names)}")
        _require_names("on", on, names)
        for v in system.inputs:
            if on[v.name] not in v.term_names:
                expected = " or ".join(v.term_names)
                raise DefinitionError(f"on: got {on[v.name]!r} for {v.name!r}, expected {expected}")
        return [on[v.name] for v in system.inputs]
    # at rest no output is in its greatest term; if there is one such row, the criteria are on in the other terms
    ask = Questions.of_rows(system, EFFORT)
    (answer,) = ask.ask([ask.none_of([Is(v.name, greatest_term(v)) for v in system.outputs], 0.5)], 2)
    if len(answer.boxes) != 1 or not answer.is_complete or len(answer.boxes[0]) < len(system.inputs):
        raise DefinitionError(
            "on: the rules do not determine which terms ask for attention, as there is not one single row in which no "
            "output is high; expected a term for each input"
        )
    resting_row = ask.places(answer.boxes[0])
    return [next(term for term in v.term_names if term != resting_row[v.name]) for v in system.inputs]


def _position(variable: Variable, shape: Shape, degree: float) -> float:
    """Return a position in the universe where a shape has a degree."""
    low, high = variable.universe
    for x in (low, *(x for x, _ in shape.points if low < x < high), high):
        if shape(x) == degree:
            return x
    what = "fully on" if degree else "fully off"
    raise DefinitionError(f"input {variable.name!r}: it is {what} nowhere in [{low:g}, {high:g}]")


def _validate_time(time: float | None, last: float) -> float:
    if time is None:
        raise InputError("time is missing, expected seconds, as there is a dwell")
    if not isinstance(time, Real) or isinstance(time, bool) or not math.isfinite(time):
        raise InputError(f"time is {time!r}, expected a finite number of seconds")
    if time < last:
        raise InputError(f"time is {time:g} after {last:g}, expected one that never decreases; reset() begins anew")
    return float(time)


def _validate_times(times: ArrayLike | None, rows: int, last: float) -> Array:
    if times is None:
        raise InputError("times are missing, expected seconds for each row, as there is a dwell")
    try:
        moments = np.asarray(times, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"times: {error}, expected numbers") from None
    if moments.shape != (rows,):
        raise InputError(f"times have the shape {moments.shape}, expected ({rows},), one for each row of the inputs")
    for row, (before, now) in enumerate(itertools.pairwise([last, *moments.tolist()])):
        try:
            _validate_time(now, before)
        except InputError as error:
            raise InputError(f"row {row}: {error}") from None
    return moments
