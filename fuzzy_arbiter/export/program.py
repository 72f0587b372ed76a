"""Exported code as statements, before they are written in a language; C and Python share the expressions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from itertools import accumulate

from fuzzy_arbiter.checks import shown
from fuzzy_arbiter.definition import Output, System, variable_names
from fuzzy_arbiter.engines import choose
from fuzzy_arbiter.engines.clipped_centroid import Outline, outline
from fuzzy_arbiter.engines.clipped_curves import ClippedCurves
from fuzzy_arbiter.engines.closed import ClosedEngine
from fuzzy_arbiter.engines.engine import Engine
from fuzzy_arbiter.engines.firing import Logic
from fuzzy_arbiter.engines.quadrature import Quadrature
from fuzzy_arbiter.engines.rational_pieces import Piece
from fuzzy_arbiter.errors import DefinitionError, UnsupportedError
from fuzzy_arbiter.export.code_functions import called
from fuzzy_arbiter.hierarchy import DEGREE
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.shapes import Membership, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.expressions import code
from fuzzy_arbiter.terms.norms import AGGREGATIONS, T_NORMS
from fuzzy_arbiter.terms.values import Formula, Value

_JOINS = {name: f"{norm.function}({{}}, {{}})" for name, norm in {**T_NORMS, **AGGREGATIONS}.items()}
_JOINS |= {"prod": "({} * {})", "sum": "({} + {})"}
_DEEPEST = 20  # maximum number of nested parentheses; parsers accept some hundred
TABLES = tuple(map(str.upper, Outline._fields))  # names of an outline's tables in code
_LONGEST = 16  # maximum number of branches of one choice; parsers accept some hundred


@dataclass(frozen=True, slots=True)
class Assign:
    """Assign an expression to a name; `words` is its comment."""

    name: str
    expression: str
    words: str = ""


@dataclass(frozen=True, slots=True)
class Choose:
    """Run the first branch whose condition holds; an empty condition always holds."""

    branches: tuple[tuple[str, tuple[Statement, ...]], ...]


@dataclass(frozen=True, slots=True)
class Sweep:
    """Assign the centroid of the k-th output, whose terms are cut at these numbers."""

    name: str
    k: int
    cuts: tuple[str, ...]
    scales: bool  # True if a cut scales its term, False if it clips it


@dataclass(frozen=True, slots=True)
class Return:
    """Return a status."""

    status: int


Statement = Assign | Choose | Sweep | Return


def formatted(
    statements: Iterable[Statement],
    simple: Callable[[Statement], Iterable[str]],
    branch: Callable[[int, str], str],
    end: str,
    indent: str = "    ",
) -> Iterator[str]:
    """Format statements: `simple` one without branches, `branch` the head of the i-th branch, `end` those of all."""
    for statement in statements:
        if isinstance(statement, Choose):
            for i, (condition, inner) in enumerate(statement.branches):
                yield indent + branch(i, condition)
                yield from formatted(inner, simple, branch, end, indent + "    ")
            if end:
                yield indent + end
        else:
            yield from (indent + line for line in simple(statement))


@dataclass(frozen=True, slots=True)
class Program:
    """The statements of a system, in their order."""

    system: System  # system that the program evaluates
    statements: tuple[Statement, ...]  # statements from the inputs ``x1``, ``x2``, .. to the outputs ``y1``, ``y2``,
    # outlines of the outputs, if they are swept; None for one of values; empty where there is a closed form
    outlines: tuple[Outline | None, ...]
    functions: tuple[str, ...]  # names of the functions that the statements call

    @property
    def mathematical(self) -> bool:
        """True if the program needs functions beyond arithmetic."""
        plain = {"least", "greatest", "probabilistic_sum"}
        return not set(self.functions) <= plain or any(o.weighted for o in self.system.outputs)


def program(system: System) -> Program:
    """Return the program of a system: the closed form where it exists, else the sweep."""
    if not isinstance(system, System):
        raise DefinitionError(f"system is {shown(system)}, expected a System, such as arbiter.system")
    engine, _ = choose(system, "auto")
    _require_sayable(system, engine)
    closed = isinstance(engine, ClosedEngine)
    statements = (*_inputs(system), *(_closed(engine) if isinstance(engine, ClosedEngine) else _swept(engine)))
    outlines = () if closed else tuple(None if o.weighted else outline(o) for o in system.outputs)
    total = (*statements, *_shared(system))
    return Program(system, total, outlines, tuple(called(_texts(total))))


def _texts(statements: Sequence[Statement]) -> Iterator[str]:
    """Yield all expressions."""
    for statement in statements:
        if isinstance(statement, Assign):
            yield statement.expression
        elif isinstance(statement, Choose):
            for condition, inner in statement.branches:
                yield condition
                yield from _texts(inner)


def _require_sayable(system: System, engine: Engine) -> None:
    """Require that the exported code supports a system."""
    for output, slots, defuzzifier in zip(system.outputs, engine.firing.slots, engine.defuzzifiers, strict=True):
        what = f"export: output {output.name!r}"
        if output.lock_previous:
            raise UnsupportedError(f"{what} keeps its previous value, which a function of one sample has not")
        if isinstance(defuzzifier, ClippedCurves | Quadrature):
            raise UnsupportedError(
                f"{what} has no exact sum over pieces; expected the centroid of piecewise-linear terms under min or "
                "prod, joined by max, or values"
            )
        for term in output.terms if output.weighted else ():
            if not isinstance(term.shape, Value):
                raise UnsupportedError(f"{what}: term {term.name!r} is {term.kind}, expected a value")
            names = term.shape.expression(variable_names(system.inputs), variable_names(system.outputs)).names
            if names & set(variable_names(system.outputs)):
                raise UnsupportedError(f"{what}: term {term.name!r} asks for another output, expected inputs alone")
        if len({slot.implication for slot in slots}) > 1:
            raise UnsupportedError(f"{what} has rules of several implications, expected one")
    outputs = set(variable_names(system.outputs))
    for i, rule in enumerate(system.rules, 1):
        if any(s.variable in outputs for s in rule.condition.terms()):
            raise UnsupportedError(f"export: R{i} asks for an output, expected conditions on inputs")


def _inputs(system: System) -> Iterator[Statement]:
    """Check each input, or clip it."""
    for i, variable in enumerate(system.inputs):
        x, (low, high) = f"x{i + 1}", variable.universe
        valid = f"{x} == {x}" if system.outside == "clip" else f"{low!r} <= {x} and {x} <= {high!r}"
        yield Choose(((f"not ({valid})", (Return(-i - 1),)),))  # NaN too
        if system.outside == "clip":
            yield Assign(x, f"least(greatest({x}, {low!r}), {high!r})")


class _Degrees:
    """Degrees of the inputs' terms, each worked out once."""

    def __init__(self, system: System) -> None:
        self._terms = {(v.name, t.name): (i, v, t.membership) for i, v in enumerate(system.inputs, 1) for t in v.terms}
        self._names: dict[tuple[str, str], str] = {}
        self.statements: list[Statement] = []

    def name_of(self, statement: Is) -> str:
        """Return the name of a degree."""
        key = (statement.variable, statement.term)
        if key not in self._names:
            name = f"m{len(self._names) + 1}"
            i, variable, shape = self._terms[key]
            values = _degree(f"x{i}", shape, variable.universe)
            self.statements += _chosen(name, values, str(statement))
            self._names[key] = name
        return self._names[key]


class _Expressions:
    """Format operators on degrees; a deep expression is assigned to a name before the statement that uses it."""

    def __init__(self) -> None:
        self._names = 0
        self._waiting: list[Statement] = []

    def apply(self, template: str, *degrees: str) -> str:
        """Return the expression of an operator's value."""
        text = template.format(*degrees)
        depth = max(accumulate((sign == "(") - (sign == ")") for sign in text))
        if depth <= _DEEPEST:
            return text
        self._names += 1
        self._waiting.append(Assign(f"t{self._names}", text))
        return f"t{self._names}"

    def join(self, kind: str, degrees: Iterable[str]) -> str:
        """Return the expression that joins several degrees, from left to right."""
        return reduce(partial(self.apply, _JOINS[kind]), degrees)

    def assign(self, name: str, expression: str, words: str) -> Iterator[Statement]:
        """Assign a value to a name, after the assignments that it needs."""
        yield from self._waiting
        self._waiting.clear()
        yield Assign(name, expression, words)


def _chosen(name: str, values: Sequence[tuple[str, str]], words: str) -> Iterator[Statement]:
    """Give a name to the first value of which the condition holds."""
    if len(values) == 1:
        yield Assign(name, values[0][1], words)
    else:
        yield Assign(name, "0.0", words)
        yield _first(name, values)


def _first(name: str, values: Sequence[tuple[str, str]]) -> Choose:
    """Give a name to the first value of which the condition holds, by halves where there are many."""
    if len(values) <= _LONGEST:
        return Choose(tuple((condition, (Assign(name, value),)) for condition, value in values))
    half = next(i for i in range(len(values) // 2, len(values)) if " < " in values[i][0])  # rises from one to the next
    condition, value = values[half]
    below, above = (*values[:half], ("", value)), values[half + 1 :]
    return Choose(((condition, (_first(name, below),)), ("", (_first(name, above),))))


def _degree(x: str, shape: Membership, universe: tuple[float, float]) -> list[tuple[str, str]]:
    """Format a membership function in its universe with the operations of the shape itself."""
    if isinstance(shape, Curve):
        return [
            ("" if end == math.inf else f"{x} < {end!r}", f"least(greatest({code(tree, {'x': x})}, 0.0), 1.0)")
            for end, tree in zip(shape.ends, shape.trees, strict=True)
        ]
    if isinstance(shape, Formula):
        return [("", f"least(greatest({code(shape.expression(['x']).tree, {'x': x})}, 0.0), 1.0)")]
    assert isinstance(shape, Shape)
    if shape == DEGREE and universe == (0.0, 1.0):
        return [("", x)]
    knots: list[tuple[float, float, float]] = []  # position, degree left and right of it
    for x0, degree in shape.points:
        if knots and knots[-1][0] == x0:
            knots[-1] = (x0, knots[-1][1], degree)
        else:
            knots.append((x0, degree, degree))
    x0, left, right = knots[0]
    if len(knots) == 1 and left == right:
        return [("", repr(left))]
    values = [(f"{x} < {x0!r}", repr(left)), (f"{x} == {x0!r}", repr(max(left, right)))]
    if left >= right:
        values = [(f"{x} <= {x0!r}", repr(left))]
    for (a, _, start), (x0, left, right) in zip(knots, knots[1:], strict=False):
        values.append((f"{x} < {x0!r}", _line(x, a, start, x0 - a, left - start)))
        values.append((f"{x} == {x0!r}", repr(max(left, right))))
    if values[-1][1] == repr(right):
        del values[-1]
    return [*values, ("", repr(right))]


def _line(x: str, a: float, start: float, run: float, rise: float) -> str:
    """Format start + rise * ((x - a) / run), without operations that change no bit."""
    fraction = (x if a == 0.0 else f"({x} - {a!r})") + ("" if run == 1.0 else f" / {run!r}")
    if rise == 0.0:
        return repr(start)
    climb = fraction if rise == 1.0 else f"{rise!r} * ({fraction})" if " " in fraction else f"{rise!r} * {fraction}"
    return climb if start == 0.0 else f"{start!r} + {climb}"


def _closed(engine: ClosedEngine) -> Iterator[Statement]:
    """Compute h of each output, and C(h)."""
    degrees, logic = _Degrees(engine.system), _Expressions()
    values: list[Statement] = []
    unclaimed = ""
    for k, (output, clauses) in enumerate(zip(engine.system.outputs, engine.clauses, strict=True), 1):
        if engine.ladder is not None:  # the running minimum of prioritized criteria
            m = _literal(engine.ladder[k - 1], degrees)
            high = f"least({m}, {unclaimed})" if unclaimed else m
            free = f"least({unclaimed}, 1.0 - {m})" if unclaimed else f"1.0 - {m}"
            unclaimed = f"u{k}"
        else:
            high = logic.join("max", [logic.join("min", [_literal(x, degrees) for x in sorted(c)]) for c in clauses])
        values += logic.assign(f"h{k}", high, str(Is(output.name, output.term_names[1])))
        if engine.ladder is not None and k < len(engine.clauses):
            values.append(Assign(unclaimed, free, "no criterion so far asks"))
    yield from degrees.statements
    yield from values
    for k, (output, forms) in enumerate(zip(engine.system.outputs, engine.scaled, strict=True), 1):
        ends = [*(f"h{k} < {piece.start!r}" for piece in forms[1:]), ""]
        values_of_h = [_piece(piece, f"h{k}") for piece in forms]
        yield from _chosen(f"y{k}", list(zip(ends, values_of_h, strict=True)), output.name)
        if engine.clips:
            yield Assign(f"y{k}", f"least(greatest(y{k}, 0.0), 1.0)")


def _literal(literal: tuple[str, str, bool], degrees: _Degrees) -> str:
    variable, term, affirmed = literal
    degree = degrees.name_of(Is(variable, term))
    return degree if affirmed else f"(1.0 - {degree})"


def _piece(piece: Piece, h: str) -> str:
    t = h if piece.start == 0.0 else f"({h} - {piece.start!r})"
    above = _horner(piece.numerator, t)
    return above if piece.denominator == (1.0, 0.0, 0.0) else f"({above}) / ({_horner(piece.denominator, t)})"


def _horner(coefficients: Sequence[float], t: str) -> str:
    result = ""
    for c in reversed(coefficients):
        product = f"{t} * ({result})" if " + " in result else f"{t} * {result}" if result else ""
        result = (f"{c!r} + {product}" if c else product) if product else repr(c) if c else ""
    return result or "0.0"


def _swept(engine: Engine) -> Iterator[Statement]:
    """Compute the strength of each rule, the cut of each output's term, and the centroids."""
    system = engine.system
    degrees, logic = _Degrees(system), _Expressions()
    rules: list[Statement] = []
    for i, rule in enumerate(system.rules, 1):
        norms = rule.operators or system
        operators: Logic[str] = Logic(
            partial(logic.apply, _JOINS[norms.conjunction]),
            partial(logic.apply, _JOINS[norms.disjunction]),
            partial(logic.apply, "(1.0 - {})"),
            lambda word, degree: logic.apply(f"{word}({{}})", degree),
            "1.0",
        )
        degree = operators.degree(rule.condition, degrees.name_of)
        weighted = degree if rule.weight == 1.0 else f"{degree} * {rule.weight!r}"
        rules += logic.assign(f"r{i}", weighted, str(rule))
    yield from degrees.statements
    yield from rules
    for k, output in enumerate(system.outputs, 1):
        cuts = []
        for j, term in enumerate(output.term_names, 1):
            fires = [f"r{i}" for i, rule in enumerate(system.rules, 1) if output[term] in rule.conclusions]
            cuts.append(f"c{k}_{j}")
            yield from logic.assign(cuts[-1], logic.join(output.aggregation, fires or ["0.0"]), str(output[term]))
        default = Return(k) if output.default is None else Assign(f"y{k}", repr(output.default))
        yield Assign(f"y{k}", "0.0", output.name)
        any_fires = " or ".join(f"{cut} > 0.0" for cut in cuts)
        scales = any(slot.implication == "prod" for slot in engine.firing.slots[k - 1])
        fired = _valued(output, k, cuts, system) if output.weighted else (Sweep(f"y{k}", k, tuple(cuts), scales),)
        yield Choose(((any_fires, fired), ("", (default,))))
        if output.weighted:  # the value may be NaN or infinite
            yield Choose(((f"not (fabs(y{k}) < INFINITY)", (default,)),))
        if output.lock_range:
            low, high = output.universe
            yield Assign(f"y{k}", f"least(greatest(y{k}, {low!r}), {high!r})")
        if engine.scale:
            low, high = engine.scale[k - 1]
            scaled = f"(y{k} - {low!r}) / {high - low!r}"
            yield Assign(f"y{k}", f"least(greatest({scaled}, 0.0), 1.0)")


def _valued(output: Output, k: int, cuts: Sequence[str], system: System) -> tuple[Statement, ...]:
    """Compute the mean of an output's values, weighted by their strengths, or the sum."""
    names = {v.name: f"x{i}" for i, v in enumerate(system.inputs, 1)}
    statements: list[Statement] = [Assign(f"w{k}", "0.0")]
    for cut, term in zip(cuts, output.terms, strict=True):
        assert isinstance(term.shape, Value)
        value = code(term.shape.expression(tuple(names)).tree, names)
        added = (Assign(f"y{k}", f"y{k} + {cut} * {value}"), Assign(f"w{k}", f"w{k} + {cut}"))
        statements.append(Choose(((f"{cut} > 0.0", added),)))
    return (*statements, *((Assign(f"y{k}", f"y{k} / w{k}"),) if output.defuzzifier == "average" else ()))


def _shared(system: System) -> Iterator[Statement]:
    """Divide by the sum or the maximum of all weights, if that is the normalization."""
    if system.normalization not in ("sum", "max"):
        return
    ys = [f"y{k}" for k in range(1, len(system.outputs) + 1)]
    logic = _Expressions()
    total = " + ".join(ys) if system.normalization == "sum" else logic.join("max", ys)
    yield from logic.assign("total", total, "")
    # if all are 0, they stay 0
    yield Choose((("total > 0.0", tuple(Assign(y, f"{y} / total") for y in ys)),))
