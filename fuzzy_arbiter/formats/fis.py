"""The text of MATLAB's Fuzzy Logic Toolbox, which Octave's fuzzy-logic-toolkit reads too."""

from __future__ import annotations

import math

from fuzzy_arbiter.definition import WEIGHTED, Output, System, Variable, variable_names
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.fis_reader import read
from fuzzy_arbiter.formats.fll_terms import parts_of
from fuzzy_arbiter.formats.notation import format_number, format_numbers, unsupported_rule
from fuzzy_arbiter.formats.settings import format_settings
from fuzzy_arbiter.formats.vocabulary import operator_words, word_of
from fuzzy_arbiter.propositions import And, Is, Not, Or
from fuzzy_arbiter.shapes import Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Value

__all__ = ["read", "write"]

_SIGNS = "'=:,"  # characters at which MATLAB's reader splits lines
MATLAB = ("gaussmf", "gauss2mf", "gbellmf", "sigmf", "dsigmf", "psigmf", "zmf", "smf", "pimf")  # not fuzzylite's alone


def write(system: System) -> str:
    """Format a system as MATLAB's text."""
    names = [name for v in (*system.inputs, *system.outputs) for name in (v.name, *v.term_names)]
    for name in (system.name, *names):
        if any(sign in name for sign in _SIGNS):
            raise UnsupportedError(f"fis cannot say the name {name!r}: expected none of {' '.join(_SIGNS)}")
    type_word, method, aggregation = _method(system)
    lines = [f"% {text}" for text in format_settings(system)]
    lines += ["[System]", f"Name='{system.name}'", f"Type='{type_word}'", "Version=2.0"]
    lines += [f"NumInputs={len(system.inputs)}", f"NumOutputs={len(system.outputs)}", f"NumRules={len(system.rules)}"]
    lines += [
        f"{key}Method='{word}'" for key, word in zip(("And", "Or", "Imp"), operator_words("fis", system), strict=True)
    ]
    lines += [f"AggMethod='{aggregation}'", f"DefuzzMethod='{method}'", ""]
    for kind, variables in (("Input", system.inputs), ("Output", system.outputs)):
        for k, v in enumerate(variables):
            lines += [f"[{kind}{k + 1}]", f"Name='{v.name}'", f"Range=[{format_numbers(v.universe)}]"]
            lines.append(f"NumMFs={len(v.terms)}")
            lines += [f"MF{j + 1}='{term.name}':{_function(term, v)}" for j, term in enumerate(v.terms)]
            lines.append("")
    lines += ["[Rules]", *(_rule(system, i) for i in range(len(system.rules)))]
    return "\n".join([*lines, ""])


def _method(system: System) -> tuple[str, str, str]:
    """Return the type of a system, and the words of its defuzzifier and aggregation, which all outputs share."""
    for output in system.outputs:
        for key, usual in (("default", None), ("lock_range", False), ("lock_previous", False)):
            if getattr(output, key) is not usual:
                raise UnsupportedError(f"fis cannot say the {key} {getattr(output, key)!r} of output {output.name!r}")
    pairs = dict.fromkeys((o.defuzzifier, o.aggregation) for o in system.outputs)
    if len(pairs) > 1:
        pairs_text = "; ".join(f"{defuzzifier}, {aggregation}" for defuzzifier, aggregation in pairs)
        raise UnsupportedError(
            f"fis cannot say outputs of several defuzzifiers and aggregations, {pairs_text}: expected one"
        )
    ((defuzzifier, aggregation),) = pairs
    method = word_of("fis", "defuzzifier", defuzzifier)
    if defuzzifier not in WEIGHTED:
        return "mamdani", method, word_of("fis", "aggregation", aggregation)
    if aggregation != "sum":
        raise UnsupportedError(f"fis cannot say the aggregation {aggregation!r} of values: expected 'sum'")
    values = all(isinstance(term.shape, Value) for output in system.outputs for term in output.terms)
    return ("sugeno" if values else "tsukamoto"), method, "sum"


def _function(term: Term, v: Variable) -> str:
    """Format a term's function and places."""
    shape = term.shape
    kind, numbers, _ = parts_of(shape)
    what = f"fis cannot say the term {term.name!r} of {v.name!r}"
    if isinstance(shape, Shape):
        function = _straight(shape, v)
        if function is None:
            points = " ".join(f"({format_number(x)}, {format_number(degree)})" for x, degree in shape.points)
            raise UnsupportedError(f"{what}, {points}: expected a triangle, a trapezoid or a half")
        kind, numbers = function
    elif kind == "formula":
        raise UnsupportedError(f"{what}, a formula: expected a function of MATLAB's, a constant or a linear term")
    elif kind == "singleton" and isinstance(shape, Curve) and shape.height == 1.0:
        kind, numbers = "trimf", numbers * 3
    elif isinstance(shape, Curve):
        kind, order = KINDS[shape.kind].fis
        numbers = tuple(numbers[i] for i in order)
        if kind not in MATLAB or shape.height != 1.0:
            expected = f"expected one of {', '.join(MATLAB)}"
            raise UnsupportedError(f"{what}, {shape.kind} of the height {shape.height:g}: {expected}")
    return f"'{kind}',[{format_numbers(numbers)}]"


def _straight(shape: Shape, v: Variable) -> tuple[str, tuple[float, ...]] | None:
    """Return the function and places of a shape; half a triangle gets its foot beyond the range, as Octave needs it."""
    low, high = v.universe
    width = high - low

    def beyond(x: float, sign: float) -> float:
        return x + sign * width if x + sign * width != x else math.nextafter(x, sign * math.inf)

    points = tuple(x for x, _ in shape.points)
    degrees = [degree for _, degree in shape.points]
    if isinstance(v, Output) and v.weighted:  # a ramp of Tsukamoto's method, for which fuzzylite alone has a word
        return ("rampmf", points if degrees[0] == 0.0 else points[::-1]) if max(degrees) == 1.0 else None
    above = beyond(high, 1.0)
    match degrees:
        case [0.0, 1.0, 0.0] | [0.0, 1.0, 1.0, 0.0]:
            pass
        case [0.0, 1.0]:
            points = (*points, beyond(points[1], 1.0)) if points[1] >= high else (*points, high, above)
        case [1.0, 0.0]:
            points = (beyond(points[0], -1.0), *points) if points[0] <= low else (beyond(low, -1.0), low, *points)
        case [1.0]:
            points = (beyond(low, -1.0), low, high, above)
        case [0.0]:
            points = (high, above, beyond(above, 1.0))
        case _:
            return None
    return ("trimf" if len(points) == 3 else "trapmf", points) if all(map(math.isfinite, points)) else None


def _rule(system: System, i: int) -> str:
    rule = system.rules[i]
    condition = rule.condition
    if rule.operators is not None:
        raise unsupported_rule("fis", i, rule, "those of the system", "operators")
    columns = {v.name: k for k, v in enumerate(system.inputs)}
    row = [0] * len(system.inputs)
    last = -1
    for part in condition.parts if isinstance(condition, And | Or) else (condition,):
        statement = part.part if isinstance(part, Not) else part
        if not isinstance(statement, Is) or statement.variable not in columns:
            raise unsupported_rule("fis", i, rule, "one connective per rule, and only terms negated")
        k = columns[statement.variable]
        if k <= last:
            raise unsupported_rule("fis", i, rule, "each input once, in the order of the inputs")
        last = k
        row[k] = (system.inputs[k].term_names.index(statement.term) + 1) * (1 if statement is part else -1)
    concluded = [0] * len(system.outputs)
    order = [variable_names(system.outputs).index(c.variable) for c in rule.conclusions]
    if order != sorted(order):
        raise unsupported_rule("fis", i, rule, "each output in the order of the outputs", "conclusions")
    for k, conclusion in zip(order, rule.conclusions, strict=True):
        concluded[k] = system.outputs[k].term_names.index(conclusion.term) + 1
    numbers = f"{' '.join(map(str, row))}, {' '.join(map(str, concluded))}"
    return f"{numbers} ({format_number(rule.weight)}) : {2 if isinstance(condition, Or) else 1}"
