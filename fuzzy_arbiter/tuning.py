"""Tune the numbers of a system's terms and the weights of its rules to data, by SciPy's least squares."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fuzzy_arbiter.arbiter import Arbiter, is_table
from fuzzy_arbiter.checks import all_of, shown
from fuzzy_arbiter.definition import Output, System, Variable, variable_names
from fuzzy_arbiter.errors import ArbiterError, DefinitionError, EngineError, InputError
from fuzzy_arbiter.samples import Columns
from fuzzy_arbiter.shapes import Array, Membership, Shape
from fuzzy_arbiter.table import aligned
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Constant, Linear, Value

_GAP = 1e-6  # minimum distance of positions, as a fraction of the universe's width
_STEP = 1e-6  # of the finite differences, as a fraction of a parameter's scale
_MAX_ROUNDS = 200
# parameters of curves that never pass each other; those that keep their sign; those whose unit is that of 1 / x
_ORDERED = (("start", "end"), ("foot1", "top1"), ("top2", "foot2"))
_SIGNED = ("deviation", "deviation1", "deviation2", "width")
_SLOPES = ("slope", "rising", "falling")


@dataclass(frozen=True, slots=True)
class Fit:
    """A system that was tuned to data.

    Attributes
    ----------
    system : System
        Tuned system.
    cost_before, cost_after : float
        Half of the sum of the squared errors, each times its sample's weight.
    parameters : dict
        Value of each tuned parameter before and after, by its name.
    converged : bool
        False if the search ended at its maximum number of rounds.

    Examples
    --------
    >>> from fuzzy_arbiter import Constant, Output, System, Variable, auto_terms, fit
    >>> x = Variable("x", (0, 1), auto_terms(["low", "high"]))
    >>> y = Output("y", (0, 1), {"a": Constant(0), "b": Constant(0)}, defuzzifier="average")
    >>> result = fit(System([x], [y], ["if x is low then y is a", "if x is high then y is b"]), [[0], [1]], [1, 3],
    ...              free="y.*")
    >>> [round(after, 6) for before, after in result.parameters.values()]
    [1.0, 3.0]
    """

    system: System
    cost_before: float
    cost_after: float
    parameters: dict[str, tuple[float, float]]
    converged: bool

    def __str__(self) -> str:
        rows = [(name, f"{before:.6g}", f"{after:.6g}") for name, (before, after) in self.parameters.items()]
        return "\n".join([f"cost {self.cost_before:.6g}, tuned {self.cost_after:.6g}", *aligned(rows)])


class _Parameter(NamedTuple):
    """A number of a system, its bounds, and a typical change of it."""

    value: float
    low: float
    high: float
    scale: float


def fit(
    system: System,
    X: ArrayLike | Columns,
    y: ArrayLike,
    *,
    free: str | Sequence[str] = "*",
    fixed: str | Sequence[str] = (),
    sample_weight: ArrayLike | None = None,
) -> Fit:
    """Tune parameters of a system so that its outputs come close to data.

    Parameters are named ``variable.term.x1`` for the positions of a straight term in rising order, none of which passes
    another; ``variable.term.mean`` and so on for a curve; ``output.term.value`` for a constant; for a linear value
    ``output.term.input`` and ``output.term.constant``; and ``R1.weight``, within (0, 1], for a rule.

    Parameters
    ----------
    system : System
        System to start from; its outputs are defined for all samples.
    X : array_like, shape (n, inputs), or columns by name
        Samples, as for `Arbiter.batch`.
    y : array_like, shape (n,) or (n, outputs)
        Wanted values of the outputs.
    free, fixed : str or sequence of str
        Patterns of names, such as ``"tip.*"``: those of parameters to tune, and of those among them to leave alone.
    sample_weight : array_like, shape (n,), optional
        Weight of each sample's squared error; default 1.

    Returns
    -------
    Fit
        Tuned system; its cost is never above that before.

    Raises
    ------
    DefinitionError
        If a pattern names no parameter, or none is left to tune.
    EngineError
        If SciPy is not installed.
    InputError
        If `X`, `y` or `sample_weight` are not such arrays, or an output is undefined for a sample.

    Examples
    --------
    >>> from fuzzy_arbiter import Constant, Output, System, Variable, auto_terms, fit
    >>> x = Variable("x", (0, 1), auto_terms(["low", "high"]))
    >>> y = Output("y", (0, 1), {"a": Constant(0)}, defuzzifier="average")
    >>> fit(System([x], [y], ["if x is low or x is high then y is a"]), [[0], [1]], [4, 4], free="y.*").parameters
    {'y.a.value': (0.0, 4.0)}
    """
    if not isinstance(system, System):
        raise DefinitionError(f"system is {shown(system)}, expected a System, such as arbiter.system")
    try:
        from scipy.optimize import least_squares
    except ImportError:
        raise EngineError("fit: SciPy is not installed, expected the extra fuzzy-arbiter[tune]") from None
    arbiter = Arbiter(system)
    samples = arbiter.samples
    rows = samples.many(samples.columns(X) if is_table(X) else X)  # type: ignore[arg-type]
    n = len(rows)
    wanted = _numbers(y, "y", (n, len(system.outputs)))
    factors = np.sqrt(_numbers(np.ones(n) if sample_weight is None else sample_weight, "sample_weight", (n,)))
    known = _parameters(system)
    names = _chosen(list(known), free, fixed)
    values, low, high, scale = np.array([known[name] for name in names]).T

    def numbers_at(x: Array) -> dict[str, float]:
        changed = dict(zip(names, np.clip(values + (x - 1.0) * scale, low, high).tolist(), strict=True))
        return _in_order(system, {name: one.value for name, one in known.items()}, changed)

    def errors(x: Array) -> Array:
        try:
            off = Arbiter(_with(system, numbers_at(x))).batch(rows) - wanted
        except ArbiterError:  # terms that no engine evaluates
            off = np.full(wanted.shape, np.nan)
        return np.asarray(np.where(np.isnan(off), unknown, off * factors[:, None]).ravel())

    before = arbiter.batch(rows) - wanted
    for row, k in np.argwhere(np.isnan(before)):
        raise InputError(f"row {row}: no rule fires for the output {system.outputs[k].name!r}, expected a default")
    cost = 0.5 * float(((before * factors[:, None]) ** 2).sum())
    unknown = 10.0 * np.sqrt(2.0 * cost) + 1e-300  # above all errors before together, so that no step is taken there
    start = np.ones(len(names))  # not 0, about which SciPy's steps would not be relative
    bounds = 1.0 + (low - values) / scale, 1.0 + (high - values) / scale
    result = least_squares(errors, start, bounds=bounds, x_scale="jac", diff_step=_STEP, max_nfev=_MAX_ROUNDS)
    if not result.cost < cost:
        return Fit(system, cost, cost, {name: (known[name].value,) * 2 for name in names}, True)
    numbers = numbers_at(result.x)
    changes = {name: (known[name].value, numbers[name]) for name in names}
    return Fit(_with(system, numbers), cost, float(result.cost), changes, result.status > 0)


def _numbers(received: ArrayLike, what: str, shape: tuple[int, ...]) -> Array:
    try:
        numbers = np.asarray(received, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what}: {error}, expected numbers") from None
    if numbers.shape == (shape[0],) and shape[1:] == (1,):
        numbers = numbers[:, None]
    if numbers.shape != shape:
        raise InputError(f"{what} has the shape {numbers.shape}, expected {shape}")
    if not np.isfinite(numbers).all() or (what == "sample_weight" and (numbers < 0.0).any()):
        expected = "numbers that are not negative" if what == "sample_weight" else "finite numbers"
        raise InputError(f"{what}: got {numbers[~(numbers >= 0.0) | ~np.isfinite(numbers)][0]}, expected {expected}")
    return numbers


def _chosen(names: Sequence[str], free: str | Sequence[str], fixed: str | Sequence[str]) -> list[str]:
    """Return the names that a pattern of `free` matches and none of `fixed`."""
    matches: list[set[str]] = []
    for what, patterns in (("free", free), ("fixed", fixed)):
        listed = (patterns,) if isinstance(patterns, str) else all_of(str, patterns, what, "patterns of names")
        for pattern in listed:
            if not any(fnmatchcase(name, pattern) for name in names):
                raise DefinitionError(f"{what}: no parameter {pattern!r}, expected some of {', '.join(names)}")
        matches.append({name for name in names if any(fnmatchcase(name, pattern) for pattern in listed)})
    chosen = [name for name in names if name in matches[0] - matches[1]]
    if not chosen:
        raise DefinitionError("free: got no parameter that is not fixed, expected at least one")
    return chosen


def _numbers_of(shape: Membership | Value, inputs: Sequence[str]) -> dict[str, float]:
    """Return the numbers of a term, by their names; none of a formula."""
    if isinstance(shape, Shape):
        positions = dict.fromkeys(x for x, _ in shape.points)  # both points of a jump move together
        return {f"x{i}": x for i, x in enumerate(positions, 1)}
    if isinstance(shape, Curve):
        return dict(zip(KINDS[shape.kind].parameters, shape.parameters, strict=True))
    if isinstance(shape, Linear):
        if "constant" in inputs:
            raise DefinitionError("an input is named 'constant', expected another name beside linear values")
        return {**dict(zip(inputs, shape.coefficients, strict=True)), "constant": shape.constant}
    return {"value": shape.value} if isinstance(shape, Constant) else {}


def _shape_of(shape: Membership | Value, numbers: Sequence[float]) -> Membership | Value:
    """Return a term with other numbers, in the order of `_numbers_of`."""
    if isinstance(shape, Shape):
        new_positions = dict(zip(dict.fromkeys(x for x, _ in shape.points), numbers, strict=True))
        return Shape(tuple((new_positions[x], degree) for x, degree in shape.points))
    if isinstance(shape, Curve):
        return Curve(shape.kind, tuple(numbers), shape.height)
    if isinstance(shape, Linear):
        return Linear(tuple(numbers[:-1]), numbers[-1])
    return Constant(*numbers) if isinstance(shape, Constant) else shape


def _terms(system: System) -> Iterator[tuple[Variable, Term, dict[str, float]]]:
    """Yield each term with its variable, and its numbers by their full names."""
    inputs = variable_names(system.inputs)
    for variable in (*system.inputs, *system.outputs):
        for term in variable.terms:
            numbers = _numbers_of(term.shape, inputs)
            yield variable, term, {f"{variable.name}.{term.name}.{key}": x for key, x in numbers.items()}


def _parameters(system: System) -> dict[str, _Parameter]:
    """Return all parameters of a system by their names."""
    result: dict[str, _Parameter] = {}
    widths = {v.name: v.universe[1] - v.universe[0] for v in system.inputs}
    for variable, term, numbers in _terms(system):
        low, high = variable.universe
        width = high - low or 1.0
        for name, x in numbers.items():
            key = name.rpartition(".")[2]
            if isinstance(term.shape, Value) or (isinstance(variable, Output) and variable.weighted):
                unit = widths.get(key, 1.0) if isinstance(term.shape, Linear) else 1.0
                bounds, scale = (-np.inf, np.inf), max(abs(x), width / unit)
            elif key in _SIGNED:
                least = min(abs(x), _GAP * width)
                bounds, scale = (least, np.inf) if x > 0.0 else (-np.inf, -least), abs(x)
            elif key in _SLOPES:
                bounds, scale = (-np.inf, np.inf), max(abs(x), 1.0 / width)
            else:
                bounds, scale = (min(low, x), max(high, x)), width
            result[name] = _Parameter(x, *bounds, scale)
    return result | {
        f"R{i}.weight": _Parameter(rule.weight, min(_GAP, rule.weight), 1.0, 1.0)
        for i, rule in enumerate(system.rules, 1)
    }


def _in_order(system: System, numbers: dict[str, float], changed: Mapping[str, float]) -> dict[str, float]:
    """Return numbers with some of them changed, none of which passes the one before or after it."""
    result = {**numbers, **changed}
    for variable, term, own in _terms(system):
        names = list(own)
        if isinstance(term.shape, Curve):
            chains = [[n for n in names if n.rpartition(".")[2] in chain] for chain in _ORDERED]
        else:
            chains = [names] if isinstance(term.shape, Shape) else []
        for chain in chains:
            forward = not chain or numbers[chain[0]] <= numbers[chain[-1]]
            for rises in (not forward, forward):  # from the last to the first, then back
                chain.reverse()
                for name, other in itertools.pairwise(chain):
                    gap = min(_GAP * (variable.universe[1] - variable.universe[0]), abs(numbers[other] - numbers[name]))
                    if other in changed:
                        nearest = result[name] + (gap if rises else -gap)
                        result[other] = max(result[other], nearest) if rises else min(result[other], nearest)
    return result


def _with(system: System, numbers: Mapping[str, float]) -> System:
    """Return a system with other numbers."""
    terms: dict[str, list[Term]] = {}
    for variable, term, own in _terms(system):
        shape = _shape_of(term.shape, [numbers[name] for name in own])
        terms.setdefault(variable.name, []).append(Term(term.name, shape))
    inputs = tuple(replace(v, terms=tuple(terms.get(v.name, ()))) for v in system.inputs)
    outputs = tuple(replace(v, terms=tuple(terms[v.name])) for v in system.outputs)
    rules = tuple(replace(rule, weight=numbers[f"R{i}.weight"]) for i, rule in enumerate(system.rules, 1))
    return replace(system, inputs=inputs, outputs=outputs, rules=rules)
