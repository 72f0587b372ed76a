"""Rules by the order of the criteria, and variants for comparison: reversed, crisp, and without an arbiter."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Literal

from cosim.scenario.criteria import CriterionSetup
from fuzzy_arbiter import Rule, Shape, System, Term, Variable, prioritised

RuleVariant = Literal["ordered", "reversed", "crisp", "none"]
_ON = Shape(((0.5 - 1e-9, 0.0), (0.5 + 1e-9, 1.0)))  # crisp, but continuous
_OFF = Shape(((0.5 - 1e-9, 1.0), (0.5 + 1e-9, 0.0)))


@functools.lru_cache(maxsize=16)
def rules_by_order(variant: RuleVariant, criteria: tuple[CriterionSetup, ...], points: int) -> System:
    """Make the fuzzy system that weighs criteria by their order."""
    fuzzy = [criterion.fuzzy for criterion in criteria]
    if variant == "reversed":
        system = prioritised(fuzzy[::-1], points=points)
        return replace(system, outputs=system.outputs[::-1], weights_of=system.weights_of[::-1])
    system = prioritised(fuzzy, points=points)
    if variant == "crisp":
        inputs = [Variable(c.name, (0.0, 1.0), (Term(c.off, _OFF), Term(c.on, _ON))) for c in fuzzy]
        return replace(system, inputs=tuple(inputs))
    if variant == "none":
        rules = [
            Rule.parse(f"if {criterion.name} is {term} then {output.name} is {level}")
            for criterion, output in zip(fuzzy, system.outputs, strict=True)
            for term, level in zip((criterion.off, criterion.on), output.term_names, strict=True)
        ]
        return replace(system, rules=tuple(rules))
    return system
