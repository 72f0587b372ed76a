"""Exported code as statements, before they are written in a language."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from fuzzy_arbiter.checks import shown
from fuzzy_arbiter.definition import Output, System, variable_names
from fuzzy_arbiter.engines import choose
from fuzzy_arbiter.engines.clipped_centroid import Outline, outline
from fuzzy_arbiter.engines.clipped_centroid_batch import Centroid
from fuzzy_arbiter.engines.clipped_curves import ClippedCurves, with_crossings
from fuzzy_arbiter.engines.closed import ClosedEngine
from fuzzy_arbiter.engines.engine import Engine
from fuzzy_arbiter.engines.firing import Logic, Slot
from fuzzy_arbiter.engines.panels import halved, smooth_panels
from fuzzy_arbiter.engines.quadrature import Quadrature
from fuzzy_arbiter.errors import DefinitionError, UnsupportedError
from fuzzy_arbiter.export.code_functions import called
from fuzzy_arbiter.export.statements import (
    JOINS,
    Assign,
    Choose,
    Expressions,
    Return,
    Statement,
    Sweep,
    assign_first,
    degree_of,
    expressions,
)
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.samples import EDGE
from fuzzy_arbiter.shapes import Membership, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.expressions import Expression, code
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.values import Value

TABLES = tuple(map(str.upper, Outline._fields))  # names of an outline's tables in code


@dataclass(frozen=True, slots=True)
class Heights:
    """The joined terms of an output at a position ``x``, for ``cuts``, and the edges of panels that suit the terms."""

    statements: tuple[Statement, ...]
    edges: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Program:
    """The statements of a system, in their order."""

    system: System  # system that the program evaluates
    statements: tuple[Statement, ...]  # statements from the inputs ``x1``, ``x2``, .. to the outputs ``y1``, ``y2``,
    # outlines of the outputs, if their centroids are exact; else None; empty where there is a closed form
    outlines: tuple[Outline | None, ...]
    heights: tuple[Heights | None, ...]  # heights of the outputs that need integrals or maxima; else None
    functions: tuple[str, ...]  # names of the functions that the statements call

    @property
    def mathematical(self) -> bool:
        """True if the program needs functions beyond arithmetic."""
        plain = {"least", "greatest", "probabilistic_sum"}
        return not set(self.functions) <= plain or any(o.weighted for o in self.system.outputs) or any(self.heights)


def program(system: System) -> Program:
    """Return the program of a system: the closed form where it exists, else the sweep."""
    if not isinstance(system, System):
        raise DefinitionError(f"system is {shown(system)}, expected a System, such as arbiter.system")
    for output in system.outputs:
        if output.lock_previous:
            what = f"output {output.name!r} keeps its previous value"
            raise UnsupportedError(f"export: {what}, which a function of one sample has not")
    engine, _ = choose(system, "auto")
    statements = (*_inputs(system), *(_closed(engine) if isinstance(engine, ClosedEngine) else _swept(engine)))
    smooth = isinstance(engine, ClosedEngine) and engine.smooth
    pairs = [] if smooth else list(zip(system.outputs, engine.defuzzifiers, strict=True))
    outlines = tuple(outline(output) if isinstance(one, Centroid) else None for output, one in pairs)
    heights = tuple(
        _heights(output, slots) if isinstance(one, ClippedCurves | Quadrature) and slots else None
        for (output, one), slots in zip(pairs, engine.firing.slots, strict=False)
    )
    total = (*statements, *_shared(system))
    texts = expressions([*total, *(statement for one in heights if one for statement in one.statements)])
    return Program(system, total, outlines, heights, tuple(called(texts)))


def _heights(output: Output, slots: Sequence[Slot]) -> Heights:
    """Return the height of an output's joined terms as statements."""
    statements, logic = list[Statement](), Expressions()
    if drastic := {output.aggregation, *(slot.implication for slot in slots)} & {"drastic_sum", "drastic_product"}:
        norm = min(drastic)
        raise UnsupportedError(f"export: output {output.name!r} has the norm {norm}, expected none that is drastic")
    for j in sorted({slot.term for slot in slots}):
        statements += assign_first(
            f"d{j}", degree_of("x", output.terms[j].membership, output.universe), output.term_names[j]
        )
    implied = [logic.apply(JOINS[slot.implication], f"cuts[{i}]", f"d{slot.term}") for i, slot in enumerate(slots)]
    statements += logic.assign("height", logic.join(output.aggregation, implied), output.name)
    shapes = list(dict.fromkeys(output.terms[slot.term].membership for slot in slots))
    edges = with_crossings(smooth_panels(output.universe, shapes), shapes)
    if output.defuzzifier not in ("centroid", "bisector"):
        edges = halved(edges)
    return Heights((*statements, Return("height")), tuple(edges.tolist()))


def _inputs(system: System) -> Iterator[Statement]:
    """Check each input, or clip it."""
    for i, variable in enumerate(system.inputs):
        x, (low, high) = f"x{i + 1}", variable.universe
        edge = EDGE * (high - low)
        valid = f"{x} == {x}" if system.outside == "clip" else f"{low - edge!r} <= {x} and {x} <= {high + edge!r}"
        yield Choose(((f"not ({valid})", (Return(-i - 1),)),))  # NaN too
        yield Assign(x, f"least(greatest({x}, {low!r}), {high!r})")


class _Degrees:
    """Degrees of the inputs' terms, each worked out once."""

    def __init__(self, system: System, concluded: Callable[[Is], str] = str) -> None:
        self.concluded = concluded
        self._terms = {(v.name, t.name): (i, v, t.membership) for i, v in enumerate(system.inputs, 1) for t in v.terms}
        self._names: dict[tuple[str, str], str] = {}
        self.statements: list[Statement] = []

    def name_of(self, statement: Is) -> str:
        """Return the name of a degree."""
        key = (statement.variable, statement.term)
        if key not in self._terms:  # of an output: its degree by the rules before this one
            return self.concluded(statement)
        if key not in self._names:
            name = f"m{len(self._names) + 1}"
            i, variable, shape = self._terms[key]
            values = degree_of(f"x{i}", shape, variable.universe)
            self.statements += assign_first(name, values, str(statement))
            self._names[key] = name
        return self._names[key]


def _closed(engine: ClosedEngine) -> Iterator[Statement]:
    """Compute h of each output, and C(h)."""
    degrees, logic = _Degrees(engine.system), Expressions()
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
    for k, output in enumerate(engine.system.outputs, 1):
        (low, top), h = output.universe, f"h{k}"
        if engine.is_smoothstep:
            yield Assign(f"y{k}", f"{h} * ({h} * (3.0 + {h} * -2.0))", output.name)
            continue
        if engine.smooth:
            smooth = f"{1.0 / 3.0!r} + {h} * ({h} * (1.0 + {h} * {-2.0 / 3.0!r}))"
            yield Assign(
                f"y{k}", smooth if (low, top) == (0.0, 1.0) else f"{low!r} + {top - low!r} * ({smooth})", output.name
            )
        else:
            yield Assign(f"y{k}", "0.0", output.name)
            yield Sweep(f"y{k}", k, (f"(1.0 - {h})", h), "clipped")
        yield from _scaled(engine, k)


def _literal(literal: tuple[str, str, bool], degrees: _Degrees) -> str:
    variable, term, affirmed = literal
    degree = degrees.name_of(Is(variable, term))
    return degree if affirmed else f"(1.0 - {degree})"


def _swept(engine: Engine) -> Iterator[Statement]:
    """Compute the strength of each rule, the cut of each output's term, and the centroids."""
    system = engine.system
    logic = Expressions()
    rules: list[Statement] = []

    def concluded(statement: Is) -> str:
        strengths = [f"r{i}" for i, rule in enumerate(system.rules[: count - 1], 1) if statement in rule.conclusions]
        aggregation = next(o.aggregation for o in system.outputs if o.name == statement.variable)
        return logic.join(aggregation, strengths or ["0.0"])

    degrees = _Degrees(system, concluded)
    for count, rule in enumerate(system.rules, 1):
        norms = rule.operators or system
        operators: Logic[str] = Logic(
            partial(logic.apply, JOINS[norms.conjunction]),
            partial(logic.apply, JOINS[norms.disjunction]),
            partial(logic.apply, "(1.0 - {})"),
            lambda word, degree: logic.apply(f"{word}({{}})", degree),
            "1.0",
        )
        degree = operators.degree(rule.condition, degrees.name_of)
        weighted = degree if rule.weight == 1.0 else f"{degree} * {rule.weight!r}"
        rules += logic.assign(f"r{count}", weighted, str(rule))
    yield from degrees.statements
    yield from rules
    for k, output in enumerate(system.outputs, 1):
        cuts = []
        slots = engine.firing.slots[k - 1]
        for j, slot in enumerate(slots, 1):
            fires = [f"r{i + 1}" for i in slot.rules] or ["0.0"]
            cuts.append(f"c{k}_{j}")
            words = str(output[output.term_names[slot.term]])
            yield from logic.assign(cuts[-1], logic.join(output.aggregation, fires), words)
        default = Return(k) if output.default is None else Assign(f"y{k}", repr(output.default))
        yield Assign(f"y{k}", "0.0", output.name)
        any_fires = " or ".join(f"{cut} > 0.0" for cut in cuts)
        method: str = output.defuzzifier
        if isinstance(engine.defuzzifiers[k - 1], Centroid):
            method = "scaled" if slots[0].implication == "prod" else "clipped"
        fired = _valued(output, k, cuts, system) if output.weighted else (Sweep(f"y{k}", k, tuple(cuts), method),)
        points = [
            (repr(shape.parameters[0]), logic.apply(JOINS[slot.implication], cut, repr(shape.height)))
            for cut, slot in zip(cuts, slots, strict=True)
            if isinstance(shape := output.terms[slot.term].shape, Curve) and shape.kind == "singleton"
        ]
        if points and method in ("centroid", "bisector"):  # they count where nothing has an area
            total, weight = (" + ".join(texts) for texts in ([f"{x} * {y}" for x, y in points], [y for _, y in points]))
            mean = Assign(f"y{k}", f"quotient({total}, {weight})")
            fired = (*fired, Choose(((f"not (fabs(y{k}) < INFINITY)", (mean,)),)))
        yield Choose(((any_fires, fired), ("", (default,)))) if cuts else default
        if method not in ("clipped", "scaled"):  # the value may be NaN or infinite
            yield Choose(((f"not (fabs(y{k}) < INFINITY)", (default,)),))
        if output.lock_range:
            low, high = output.universe
            yield Assign(f"y{k}", f"least(greatest(y{k}, {low!r}), {high!r})")
        yield from _scaled(engine, k)


def _scaled(engine: Engine, k: int) -> Iterator[Statement]:
    """Scale the k-th output to its range, if that is the normalization."""
    if engine.scale:
        low, high = engine.scale[k - 1]
        yield Assign(f"y{k}", f"least(greatest((y{k} - {low!r}) / {high - low!r}, 0.0), 1.0)")


def _valued(output: Output, k: int, cuts: Sequence[str], system: System) -> tuple[Statement, ...]:
    """Compute the mean of an output's values, weighted by their strengths, or the sum."""
    inputs, outputs = variable_names(system.inputs), variable_names(system.outputs[: k - 1])
    names = {name: f"x{i}" for i, name in enumerate(inputs, 1)} | {name: f"y{i}" for i, name in enumerate(outputs, 1)}
    statements: list[Statement] = [Assign(f"w{k}", "0.0")]
    for j, (cut, term) in enumerate(zip(cuts, output.terms, strict=True), 1):
        if isinstance(term.shape, Value):
            values = [("", code(term.shape.expression(inputs, outputs).tree, names))]
        else:
            values = _position(term.shape, cut)
        added = (
            *assign_first(f"v{k}_{j}", values, ""),
            Assign(f"y{k}", f"y{k} + {cut} * v{k}_{j}"),
            Assign(f"w{k}", f"w{k} + {cut}"),
        )
        statements.append(Choose(((f"{cut} > 0.0", added),)))
    return (*statements, *((Assign(f"y{k}", f"y{k} / w{k}"),) if output.defuzzifier == "average" else ()))


def _position(shape: Membership, cut: str) -> list[tuple[str, str]]:
    """Format the position at which a term that only rises or only falls has a degree."""
    if isinstance(shape, Shape):
        (a, left), (b, right) = shape.points
        return [("", f"{a!r} + {b - a!r} * (({cut} - {left!r}) / {right - left!r})")]
    assert isinstance(shape, Curve)
    kind, degree = KINDS[shape.kind], f"({cut} / {shape.height!r})"
    assert kind.inverse is not None
    named = dict(zip(kind.parameters, shape.parameters, strict=True))
    return [
        ("" if end == math.inf else f"{degree} <= {end!r}", code(Expression(text).bound(named).tree, {"w": degree}))
        for end, text in kind.inverse(*shape.parameters)
    ]


def _shared(system: System) -> Iterator[Statement]:
    """Divide by the sum or the maximum of all weights, if that is the normalization."""
    if system.normalization not in ("sum", "max"):
        return
    ys = [f"y{k}" for k in range(1, len(system.outputs) + 1)]
    logic = Expressions()
    total = " + ".join(ys) if system.normalization == "sum" else logic.join("max", ys)
    yield from logic.assign("total", total, "")
    # if all are 0, they stay 0
    yield Choose((("total > 0.0", tuple(Assign(y, f"{y} / total") for y in ys)),))
