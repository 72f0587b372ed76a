"""Name the rules that fire at a place that a search has found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.engines.firing import logic_of
from fuzzy_arbiter.propositions import Is


def row_strengths(system: System, place: Mapping[str, float | str]) -> list[float]:
    """Return the firing strength of each rule in a crisp row."""
    row = {v.name: place.get(v.name, v.term_names[-1]) for v in system.inputs}
    logic = logic_of(system)
    return [
        rule.weight * logic.degree(rule.condition, lambda s: float(row[s.variable] == s.term)) for rule in system.rules
    ]


def reasons(system: System, strengths: Sequence[float], statements: Sequence[Is], above: float) -> str:
    """Name the rules that conclude statements above a strength."""
    parts = []
    for statement in dict.fromkeys(statements):
        rules = [
            f"R{i + 1}"
            for i, (rule, strength) in enumerate(zip(system.rules, strengths, strict=True))
            if statement in rule.conclusions and (strength > above or strength == above == 1.0)
        ]
        if rules:
            parts.append(f"{statement} by {' '.join(rules)}")
    return ", ".join(parts)
