"""The text of MATLAB's Fuzzy Logic Toolbox, which Octave's fuzzy-logic-toolkit reads too."""

from __future__ import annotations

import math

from fuzzy_arbiter.definition import WEIGHTED, Output, System, Variable, variable_names
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.fis_reader import read
from fuzzy_arbiter.formats.fis_words import DEFUZZIFIERS, MATLAB, SETTINGS
from fuzzy_arbiter.formats.notation import format_number, format_numbers, unsupported_rule, word_of
from fuzzy_arbiter.formats.settings import format_settings
from fuzzy_arbiter.propositions import And, Is, Not, Or, Proposition
from fuzzy_arbiter.shapes import Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.norms import AGGREGATIONS, S_NORMS, T_NORMS
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Constant, Linear, Value

__all__ = ["read", "write"]

_SIGNS = "'=:,"  # characters at which MATLAB's reader splits lines


def write(system: System) -> str:
    """Format a system as MATLAB's text."""
    _require_names(system)
    kind, method, aggregation = _method(system)
    lines = [f"% {text}" for text in format_settings(system, SETTINGS)]
    lines += ["[System]", f"Name='{system.name}'", f"Type='{kind}'", "Version=2.0"]
    lines += [f"NumInputs={len(system.inputs)}", f"NumOutputs={len(system.outputs)}", f"NumRules={len(system.rules)}"]
    lines += [f"AndMethod='{word_of('fis', 'conjunction', system.conjunction, T_NORMS)}'"]
    lines += [f"OrMethod='{word_of('fis', 'disjunction', system.disjunction, S_NORMS)}'"]
    lines += [f"ImpMethod='{word_of('fis', 'implication', system.implication, T_NORMS)}'", f"AggMethod='{aggregation}'"]
    lines += [f"DefuzzMethod='{method}'", ""]
    for kind, variables in (("Input", system.inputs), ("Output", system.outputs)):
        for k, v in enumerate(variables):
            lines += [f"[{kind}{k + 1}]", *_variable(v, system), ""]
    lines += ["[Rules]", *(_rule(system, i) for i in range(len(system.rules)))]
    return "\n".join([*lines, ""])


def _method(system: System) -> tuple[str, str, str]:
    """Return the type of a system, and the words of its defuzzifier and aggregation, which all outputs share."""
    pairs = dict.fromkeys((o.defuzzifier, o.aggregation) for o in system.outputs)
    if len(pairs) > 1:
        pairs_text = "; ".join(f"{defuzzifier}, {aggregation}" for defuzzifier, aggregation in pairs)
        raise UnsupportedError(
            f"fis cannot say outputs of several defuzzifiers and aggregations, {pairs_text}: expected one"
        )
    ((defuzzifier, aggregation),) = pairs
    method = next(word for word, name in DEFUZZIFIERS.items() if name == defuzzifier)
    if defuzzifier not in WEIGHTED:
        return "mamdani", method, word_of("fis", "aggregation", aggregation, AGGREGATIONS)
    if aggregation != "sum":
        raise UnsupportedError(f"fis cannot say the aggregation {aggregation!r} of values: expected 'sum'")
    values = all(isinstance(term.shape, Value) for output in system.outputs for term in output.terms)
    return ("sugeno" if values else "tsukamoto"), method, "sum"


def _require_names(system: System) -> None:
    names = [name for v in (*system.inputs, *system.outputs) for name in (v.name, *v.term_names)]
    for name in (system.name, *names):
        if any(sign in name for sign in _SIGNS):
            raise UnsupportedError(f"fis cannot say the name {name!r}: expected none of {' '.join(_SIGNS)}")


def _variable(v: Variable, system: System) -> list[str]:
    if isinstance(v, Output):
        for key in ("default", "lock_range", "lock_previous"):
            if getattr(v, key) is not (None if key == "default" else False):
                raise UnsupportedError(f"fis cannot say the {key} {getattr(v, key)!r} of output {v.name!r}")
    lines = [f"Name='{v.name}'", f"Range=[{format_numbers(v.universe)}]", f"NumMFs={len(v.terms)}"]
    for j, term in enumerate(v.terms):
        lines.append(f"MF{j + 1}='{term.name}':{_function(term, v)}")
    return lines


def _function(term: Term, v: Variable) -> str:
    """Format a term's function and places; half a triangle gets its other foot beyond the range, as Octave needs it."""
    if not isinstance(term.shape, Shape):
        return _named(term, v)
    low, high = v.universe
    width = high - low

    def below(x: float) -> float:
        return x - width if x - width < x else math.nextafter(x, -math.inf)

    def above(x: float) -> float:
        return x + width if x + width > x else math.nextafter(x, math.inf)

    points = [x for x, _ in term.shape.points]
    if isinstance(v, Output) and v.weighted:  # a ramp of Tsukamoto's method, for which fuzzylite alone has a word
        if max(degree for _, degree in term.shape.points) != 1.0:
            raise UnsupportedError(_no_function(term, v))
        foot, top = points if term.shape.points[0][1] == 0.0 else reversed(points)
        return f"'rampmf',[{format_number(foot)} {format_number(top)}]"
    match [degree for _, degree in term.shape.points]:
        case [0.0, 1.0, 0.0] | [0.0, 1.0, 1.0, 0.0]:
            pass
        case [0.0, 1.0]:
            a, b = points
            points = [a, b, above(b)] if b >= high else [a, b, high, above(high)]
        case [1.0, 0.0]:
            a, b = points
            points = [below(a), a, b] if a <= low else [below(low), low, a, b]
        case [1.0]:
            points = [below(low), low, high, above(high)]
        case [0.0]:
            points = [high, above(high), above(above(high))]
        case _:
            raise UnsupportedError(_no_function(term, v))
    if not all(map(math.isfinite, points)):
        raise UnsupportedError(_no_function(term, v))
    return f"'{'trimf' if len(points) == 3 else 'trapmf'}',[{format_numbers(points)}]"


def _named(term: Term, v: Variable) -> str:
    """Format a curve or a value."""
    shape, what = term.shape, f"fis cannot say the term {term.name!r} of {v.name!r}"
    if isinstance(shape, Constant):
        return f"'constant',[{format_number(shape.value)}]"
    if isinstance(shape, Linear):
        return f"'linear',[{format_numbers((*shape.coefficients, shape.constant))}]"
    if not isinstance(shape, Curve):
        raise UnsupportedError(f"{what}, a formula: expected a function of MATLAB's, a constant or a linear term")
    if shape.kind == "singleton" and shape.height == 1.0:
        return f"'trimf',[{format_numbers(shape.parameters * 3)}]"
    word, order = KINDS[shape.kind].fis
    if word not in MATLAB or shape.height != 1.0:
        raise UnsupportedError(
            f"{what}, {shape.kind} of the height {shape.height:g}: expected one of {', '.join(MATLAB)}"
        )
    return f"'{word}',[{format_numbers(shape.parameters[i] for i in order)}]"


def _no_function(term: Term, v: Variable) -> str:
    assert isinstance(term.shape, Shape)
    points = " ".join(f"({format_number(x)}, {format_number(degree)})" for x, degree in term.shape.points)
    return f"fis cannot say the term {term.name!r} of {v.name!r}, {points}: expected a triangle, a trapezoid or a half"


def _rule(system: System, i: int) -> str:
    rule = system.rules[i]
    condition = rule.condition
    if rule.operators is not None:
        raise unsupported_rule("fis", i, rule, "those of the system", "operators")
    parts = condition.parts if isinstance(condition, And | Or) else (condition,)
    row = [0] * len(system.inputs)
    names = variable_names(system.inputs)
    last = -1
    for part in parts:
        statement = _statement(part)
        if statement is None or statement.variable not in names:
            raise unsupported_rule("fis", i, rule, "one connective per rule, and only terms negated")
        k = names.index(statement.variable)
        if k <= last:
            raise unsupported_rule("fis", i, rule, "each input once, in the order of the inputs")
        last = k
        row[k] = (system.inputs[k].term_names.index(statement.term) + 1) * (1 if statement is part else -1)
    concluded = [0] * len(system.outputs)
    outputs = variable_names(system.outputs)
    order = [outputs.index(c.variable) for c in rule.conclusions]
    if order != sorted(order):
        raise unsupported_rule("fis", i, rule, "each output in the order of the outputs", "conclusions")
    for k, conclusion in zip(order, rule.conclusions, strict=True):
        concluded[k] = system.outputs[k].term_names.index(conclusion.term) + 1
    numbers = f"{' '.join(map(str, row))}, {' '.join(map(str, concluded))}"
    return f"{numbers} ({format_number(rule.weight)}) : {2 if isinstance(condition, Or) else 1}"


def _statement(part: Proposition) -> Is | None:
    inner = part.part if isinstance(part, Not) else part
    return inner if isinstance(inner, Is) else None
