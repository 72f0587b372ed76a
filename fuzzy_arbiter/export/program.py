"""The program of a system: its statements and tables, before they are written in a language."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from fuzzy_arbiter.checks import shown
from fuzzy_arbiter.definition import Output, System, variable_names
from fuzzy_arbiter.engines import choose as choose_engine
from fuzzy_arbiter.engines.clipped_centroid import Centroid, Outline, outline
from fuzzy_arbiter.engines.clipped_curves import ClippedCurves
from fuzzy_arbiter.engines.closed import ClosedEngine
from fuzzy_arbiter.engines.engine import Engine
from fuzzy_arbiter.engines.firing import Logic, Slot
from fuzzy_arbiter.engines.panels import halved, smooth_panels
from fuzzy_arbiter.engines.quadrature import Quadrature
from fuzzy_arbiter.engines.term_lines import with_crossings
from fuzzy_arbiter.errors import DefinitionError, UnsupportedError
from fuzzy_arbiter.export.code_functions import called
from fuzzy_arbiter.export.statements import JOINS, Cases, Expressions, assign, assign_first, choose, degree_of
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.samples import EDGE
from fuzzy_arbiter.shapes import Membership, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.expressions import Expression, code
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.values import Value

TABLES = tuple(map(str.upper, Outline._fields))  # names of an outline's tables in code
# function of heights that computes each defuzzifier, and its last argument
_FUNCTIONS = {
    "centroid": ("center_of_area", 0), "bisector": ("center_of_area", 1),
    "som": ("position_of_maximum", -1), "mom": ("position_of_maximum", 0), "lom": ("position_of_maximum", 1),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Sweep:
    """The exact centroid of an output of straight terms, ``sweep_k(cuts)``."""

    outline: Outline
    count: int  # number of cuts
    method: str  # ``clipped`` or ``scaled``


@dataclass(frozen=True, slots=True)
class Heights:
    """The joined terms of an output at a position, ``height_k(x, cuts)``, which need integrals or maxima."""

    lines: tuple[str, ...]
    edges: tuple[float, ...]  # of panels that suit the terms


@dataclass(frozen=True, slots=True)
class Program:
    """What code that evaluates a system is made of."""

    system: System
    lines: tuple[str, ...]  # statements that fill ``outputs`` from ``inputs``, and return a status
    defuzzifiers: dict[int, Sweep | Heights]  # by the number of the output, those that are functions of cuts
    functions: tuple[str, ...]  # names of the functions that its lines call

    @property
    def mathematical(self) -> bool:
        """True if the program needs functions beyond arithmetic."""
        plain = {"least", "greatest", "probabilistic_sum"}
        integrates = any(isinstance(one, Heights) for one in self.defuzzifiers.values())
        return integrates or not set(self.functions) <= plain or any(o.weighted for o in self.system.outputs)


def program(system: System) -> Program:
    """Return the program of a system: the closed form where it exists, else rules, cuts and defuzzifiers."""
    if not isinstance(system, System):
        raise DefinitionError(f"system is {shown(system)}, expected a System, such as arbiter.system")
    for output in system.outputs:
        if output.lock_previous:
            what = f"output {output.name!r} keeps its previous value"
            raise UnsupportedError(f"export: {what}, which a function of one sample has not")
    engine, _ = choose_engine(system, "auto")
    defuzzifiers: dict[int, Sweep | Heights] = {}
    if not (isinstance(engine, ClosedEngine) and engine.smooth):
        for k, (output, one) in enumerate(zip(system.outputs, engine.defuzzifiers, strict=True), 1):
            slots = engine.firing.slots[k - 1]
            if isinstance(one, Centroid):
                scales = bool(slots) and slots[0].implication == "prod"
                defuzzifiers[k] = Sweep(outline(output), len(slots), "scaled" if scales else "clipped")
            elif isinstance(one, ClippedCurves | Quadrature) and slots:
                defuzzifiers[k] = _heights(output, slots)
    evaluated = _closed(engine) if isinstance(engine, ClosedEngine) else _inferred(engine, defuzzifiers)
    results = [f"outputs[{k}] = y{k + 1};" for k in range(len(system.outputs))]
    lines = (*_inputs(system), *evaluated, *_shared(system), *results, "return 0;")
    heights = [line for one in defuzzifiers.values() if isinstance(one, Heights) for line in one.lines]
    return Program(system, lines, defuzzifiers, tuple(called((*lines, *heights))))


def _heights(output: Output, slots: Sequence[Slot]) -> Heights:
    """Return the height of an output's joined terms."""
    lines, logic = list[str](), Expressions()
    if drastic := {output.aggregation, *(slot.implication for slot in slots)} & {"drastic_sum", "drastic_product"}:
        norm = min(drastic)
        raise UnsupportedError(f"export: output {output.name!r} has the norm {norm}, expected none that is drastic")
    for j in sorted({slot.term for slot in slots}):
        term = output.terms[j]
        lines += assign_first(f"d{j}", degree_of("x", term.membership, output.universe), term.name)
    implied = [logic.apply(JOINS[slot.implication], f"cuts[{i}]", f"d{slot.term}") for i, slot in enumerate(slots)]
    lines += logic.assign("height", logic.join(output.aggregation, implied), output.name)
    shapes = list(dict.fromkeys(output.terms[slot.term].membership for slot in slots))
    edges = with_crossings(smooth_panels(output.universe, shapes), shapes)
    if output.defuzzifier not in ("centroid", "bisector"):
        edges = halved(edges)
    return Heights((*lines, "return height;"), tuple(edges.tolist()))


def _inputs(system: System) -> Iterator[str]:
    """Check each input, or clip it."""
    yield from (assign(f"x{i}", f"inputs[{i - 1}]", v.name) for i, v in enumerate(system.inputs, 1))
    for i, variable in enumerate(system.inputs, 1):
        x, (low, high) = f"x{i}", variable.universe
        edge = EDGE * (high - low)
        valid = f"{x} == {x}" if system.outside == "clip" else f"{low - edge!r} <= {x} && {x} <= {high + edge!r}"
        yield from choose((f"!({valid})", [f"return {-i};"]))  # NaN too
        yield assign(x, f"least(greatest({x}, {low!r}), {high!r})")


class _Degrees:
    """Degrees of the inputs' terms, each worked out once."""

    def __init__(self, system: System, concluded: Callable[[Is], str] = str) -> None:
        self.concluded = concluded
        self._terms = {(v.name, t.name): (i, v, t.membership) for i, v in enumerate(system.inputs, 1) for t in v.terms}
        self._names: dict[Is, str] = {}
        self.lines: list[str] = []

    def name_of(self, statement: Is) -> str:
        """Return the name of a degree."""
        key = statement.variable, statement.term
        if key not in self._terms:  # of an output: its degree by the rules before this one
            return self.concluded(statement)
        if statement not in self._names:
            i, variable, shape = self._terms[key]
            name = self._names[statement] = f"m{len(self._names) + 1}"
            self.lines += assign_first(name, degree_of(f"x{i}", shape, variable.universe), str(statement))
        return self._names[statement]


def _closed(engine: ClosedEngine) -> Iterator[str]:
    """Compute h of each output, and C(h)."""
    degrees, logic = _Degrees(engine.system), Expressions()
    lines: list[str] = []
    unclaimed = ""

    def literal(variable: str, term: str, affirmed: bool) -> str:
        degree = degrees.name_of(Is(variable, term))
        return degree if affirmed else f"(1.0 - {degree})"

    for k, (output, clauses) in enumerate(zip(engine.system.outputs, engine.clauses, strict=True), 1):
        if engine.ladder is not None:  # the running minimum of prioritized criteria
            m = literal(*engine.ladder[k - 1])
            high = f"least({m}, {unclaimed})" if unclaimed else m
            free = f"least({unclaimed}, 1.0 - {m})" if unclaimed else f"1.0 - {m}"
            unclaimed = f"u{k}"
        else:
            high = logic.join("max", [logic.join("min", [literal(*x) for x in sorted(c)]) for c in clauses])
        lines += logic.assign(f"h{k}", high, str(Is(output.name, output.term_names[1])))
        if engine.ladder is not None and k < len(engine.clauses):
            lines.append(assign(unclaimed, free, "no criterion so far asks"))
    yield from degrees.lines
    yield from lines
    for k, output in enumerate(engine.system.outputs, 1):
        (low, top), h = output.universe, f"h{k}"
        if engine.is_smoothstep:
            yield assign(f"y{k}", f"{h} * ({h} * (3.0 + {h} * -2.0))", output.name)
            continue
        if engine.smooth:
            smooth = f"{1.0 / 3.0!r} + {h} * ({h} * (1.0 + {h} * {-2.0 / 3.0!r}))"
            whole = smooth if (low, top) == (0.0, 1.0) else f"{low!r} + {top - low!r} * ({smooth})"
            yield assign(f"y{k}", whole, output.name)
        else:
            yield f"const double cuts_{k}[] = {{(1.0 - {h}), {h}}};"
            yield assign(f"y{k}", f"sweep_{k}(cuts_{k})", output.name)
        yield from _scaled(engine, k)


def _inferred(engine: Engine, defuzzifiers: dict[int, Sweep | Heights]) -> Iterator[str]:
    """Compute the strength of each rule, the cut of each output's term, and the outputs."""
    system = engine.system
    logic = Expressions()
    rules: list[str] = []

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
    yield from degrees.lines
    yield from rules
    for k, (output, slots) in enumerate(zip(system.outputs, engine.firing.slots, strict=True), 1):
        y, one = f"y{k}", defuzzifiers.get(k)
        cuts = [f"c{k}_{j}" for j in range(1, len(slots) + 1)]
        for cut, slot in zip(cuts, slots, strict=True):
            fires = [f"r{i + 1}" for i in slot.rules] or ["0.0"]
            words = str(output[output.term_names[slot.term]])
            yield from logic.assign(cut, logic.join(output.aggregation, fires), words)
        default = f"return {k};" if output.default is None else assign(y, repr(output.default))
        yield assign(y, "0.0", output.name)
        if output.weighted:
            fired = _valued(output, k, cuts, system)
        elif isinstance(one, Heights):
            function, side = _FUNCTIONS[output.defuzzifier]
            fired = [f"{y} = {function}(height_{k}, cuts_{k}, EDGES_{k}, {len(one.edges) - 1}, {side});"]
        else:
            fired = [f"{y} = sweep_{k}(cuts_{k});"]
        if not output.weighted:
            fired = [f"const double cuts_{k}[] = {{{', '.join(cuts)}}};", *fired]
        points = [
            (repr(shape.parameters[0]), logic.apply(JOINS[slot.implication], cut, repr(shape.height)))
            for cut, slot in zip(cuts, slots, strict=True)
            if isinstance(shape := output.terms[slot.term].shape, Curve) and shape.kind == "singleton"
        ]
        if points and output.defuzzifier in ("centroid", "bisector"):  # they count where nothing has an area
            total, weight = (" + ".join(texts) for texts in ([f"{x} * {h}" for x, h in points], [h for _, h in points]))
            fired += choose((f"!(fabs({y}) < INFINITY)", [f"{y} = quotient({total}, {weight});"]))
        yield from choose((" || ".join(f"{cut} > 0.0" for cut in cuts), fired), ("", [default])) if cuts else [default]
        if not isinstance(one, Sweep):  # the value may be NaN or infinite
            yield from choose((f"!(fabs({y}) < INFINITY)", [default]))
        if output.lock_range:
            low, high = output.universe
            yield assign(y, f"least(greatest({y}, {low!r}), {high!r})")
        yield from _scaled(engine, k)


def _scaled(engine: Engine, k: int) -> Iterator[str]:
    """Scale the k-th output to its range, if that is the normalization."""
    if engine.scale:
        low, high = engine.scale[k - 1]
        yield assign(f"y{k}", f"least(greatest((y{k} - {low!r}) / {high - low!r}, 0.0), 1.0)")


def _valued(output: Output, k: int, cuts: Sequence[str], system: System) -> list[str]:
    """Compute the mean of an output's values, weighted by their strengths, or the sum."""
    inputs, outputs = variable_names(system.inputs), variable_names(system.outputs[: k - 1])
    names = {name: f"x{i}" for i, name in enumerate(inputs, 1)} | {name: f"y{i}" for i, name in enumerate(outputs, 1)}
    lines = [f"w{k} = 0.0;"]
    for j, (cut, term) in enumerate(zip(cuts, output.terms, strict=True), 1):
        if isinstance(term.shape, Value):
            cases: Cases = [("", code(term.shape.expression(inputs, outputs).tree, names))]
        else:
            cases = _position(term.shape, cut)
        added = [f"y{k} = y{k} + {cut} * v{k}_{j};", f"w{k} = w{k} + {cut};"]
        lines += choose((f"{cut} > 0.0", [*assign_first(f"v{k}_{j}", cases), *added]))
    return [*lines, f"y{k} = y{k} / w{k};"] if output.defuzzifier == "average" else lines


def _position(shape: Membership, cut: str) -> Cases:
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


def _shared(system: System) -> Iterator[str]:
    """Divide by the sum or the maximum of all weights, if that is the normalization."""
    if system.normalization not in ("sum", "max"):
        return
    ys = [f"y{k}" for k in range(1, len(system.outputs) + 1)]
    logic = Expressions()
    total = " + ".join(ys) if system.normalization == "sum" else logic.join("max", ys)
    yield from logic.assign("total", total)
    yield from choose(("total > 0.0", [f"{y} = {y} / total;" for y in ys]))  # if all are 0, they stay 0
