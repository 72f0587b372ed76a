"""Name the rules that fire at a place that a search has found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.engines.firing import number_logic
from fuzzy_arbiter.propositions import Is


def row_strengths(system: System, place: Mapping[str, float | str]) -> list[float]:
    """Return the firing strength of each rule in a crisp row.

    Parameters
    ----------
    system : System
        System to verify.
    place : mapping from str to str
        Term of each input, or of those that matter.

    Returns
    -------
    list of float
        Strengths in the order of the rules.
    """
    row = {v.name: place.get(v.name, v.term_names[-1]) for v in system.inputs}
    logic = number_logic(system)
    return [
        rule.weight * logic.degree(rule.condition, lambda s: float(row[s.variable] == s.term)) for rule in system.rules
    ]


def reasons(system: System, strengths: Sequence[float], statements: Sequence[Is], above: float) -> str:
    """Name the rules that conclude statements above a strength.

    Parameters
    ----------
    system : System
        System to verify.
    strengths : sequence of float
        Strength of each rule.
    statements : sequence of Is
        Statements about outputs.
    above : float
        Threshold of the strength; 1 includes rules of exactly 1.

    Returns
    -------
    str
        Text such as ``alpha_1 is low by R2, alpha_1 is high by R1``.
    """
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
