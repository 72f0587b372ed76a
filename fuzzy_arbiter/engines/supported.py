"""Check that a system is of the plain kind: straight terms, min and max or their products, the centroid."""

from __future__ import annotations

from fuzzy_arbiter.definition import System, Variable, variable_names
from fuzzy_arbiter.propositions import Anything, Hedged, Proposition
from fuzzy_arbiter.shapes import Shape
from fuzzy_arbiter.terms.curves import Curve

PLAIN = {"conjunction": ("min", "prod"), "disjunction": ("max", "probor"), "implication": ("min", "prod")}


def unsupported_reason(system: System, curved_inputs: bool = False) -> str:
    """Return the first reason why a system is not of the plain kind, which some engines and checks require."""
    for key, known in PLAIN.items():
        if getattr(system, key) not in known:
            return f"the {key} is {getattr(system, key)}, expected {' or '.join(known)}"
    outputs = variable_names(system.outputs)
    for i, rule in enumerate(system.rules):
        if rule.operators is not None:
            return f"R{i + 1} has operators of its own, expected those of the system"
        output_name = next((s.variable for s in rule.condition.terms() if s.variable in outputs), None)
        if output_name is not None:
            return f"R{i + 1} asks for the output {output_name!r}, expected conditions on inputs alone"
        if bent(rule.condition):
            return f"R{i + 1} has a hedge or 'any', expected 'not' alone"
    for output in system.outputs:
        if (output.defuzzifier, output.aggregation) != ("centroid", "max"):
            return (
                f"output {output.name!r} has the defuzzifier {output.defuzzifier} and the aggregation "
                f"{output.aggregation}, expected centroid and max"
            )
        if output.lock_previous:
            return f"output {output.name!r} keeps its previous value, expected none that does"
    for variable in (*(() if curved_inputs else system.inputs), *system.outputs):
        if reason := curved_term(variable):
            return reason
    return ""


def curved_term(variable: Variable) -> str:
    """Describe the first term of a variable that is not piecewise linear."""
    for term in variable.terms:
        if not isinstance(term.shape, Shape):
            kind = term.shape.kind if isinstance(term.shape, Curve) else type(term.shape).__name__.lower()
            return f"term {term.name!r} of {variable.name!r} is of the kind {kind}, expected piecewise-linear ones"
    return ""


def bent(p: Proposition) -> bool:
    """Return True if a condition has hedges or the term *any*."""
    return any(isinstance(part, Hedged | Anything) for part in p.parts_within())
