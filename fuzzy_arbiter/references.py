"""Check the references of a system's rules and values to variables and terms."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.propositions import Anything, Is
from fuzzy_arbiter.terms.values import Linear, Value

if TYPE_CHECKING:
    from fuzzy_arbiter.definition import System
    from fuzzy_arbiter.rule import Rule

_Terms = dict[str, frozenset[str]]  # names of each variable's terms


def require_rules(system: System) -> None:
    """Require that the rules refer only to variables and terms of the system."""
    inputs = {v.name: frozenset(v.term_names) for v in system.inputs}
    outputs = {v.name: frozenset(v.term_names) for v in system.outputs}
    before: set[str] = set()
    for i, rule in enumerate(system.rules):
        try:
            _require_rule(rule, inputs, outputs, before)
        except DefinitionError as error:
            raise DefinitionError(f"R{i + 1} {str(rule)!r}: {error}") from None
        before |= {c.variable for c in rule.conclusions}


def _require_rule(rule: Rule, inputs: _Terms, outputs: _Terms, before: set[str]) -> None:
    for statement in rule.condition.terms():
        if statement.variable not in outputs:
            _require_known(statement, inputs, "input")
            continue
        _require_known(statement, outputs, "output")
        if statement.variable not in before:
            raise DefinitionError(f"asks for output {statement.variable!r}, on which no rule before concludes")
    for part in rule.condition.parts_within():
        if isinstance(part, Anything) and part.variable not in inputs:
            raise DefinitionError(f"no input {part.variable!r}, expected one of {', '.join(inputs)}")
    for statement in rule.conclusions:
        _require_known(statement, outputs, "output")
    if len({statement.variable for statement in rule.conclusions}) < len(rule.conclusions):
        raise DefinitionError("two conclusions on one output, expected each output once")


def require_values(system: System) -> None:
    """Require that values refer only to existing variables, and that every input is used."""
    inputs, outputs = ([v.name for v in variables] for variables in (system.inputs, system.outputs))
    used: set[str] = set()
    for k, output in enumerate(system.outputs):
        for term in output.terms if output.weighted else ():
            if isinstance(term.shape, Value):
                try:
                    whole = term.shape.expression(inputs, outputs[:k])
                except DefinitionError as error:
                    raise DefinitionError(f"output {output.name!r}: term {term.name!r}: {error}") from None
                used |= whole.names | (set(inputs) if isinstance(term.shape, Linear) else set())
    for variable in system.inputs:
        if not variable.terms and variable.name not in used:
            raise DefinitionError(f"variable {variable.name!r}: no terms, expected at least one")


def _require_known(statement: Is, known: _Terms, kind: str) -> None:
    if statement.variable not in known:
        raise DefinitionError(f"no {kind} {statement.variable!r}, expected one of {', '.join(known)}")
    if statement.term not in known[statement.variable]:
        expected = ", ".join(sorted(known[statement.variable]))
        raise DefinitionError(f"{statement.variable!r} has no term {statement.term!r}, expected one of {expected}")
