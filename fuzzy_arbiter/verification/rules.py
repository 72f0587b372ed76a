"""Check the rules as text: names that no rule uses, and redundant rules."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.propositions import And, Is, Not, Or, Proposition
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.verification.report import Finding

MAX_COMPARED = 100  # maximum number of rules with one conclusion that are compared with each other


def unused(system: System) -> Iterator[Finding]:
    """Yield the inputs and terms that no rule uses."""
    stated = {s for rule in system.rules for s in rule.condition.terms()}
    concluded = {s for rule in system.rules for s in rule.conclusions}
    inputs = [(f"input {v.name!r}: no rule asks for", "", v, stated) for v in system.inputs]
    outputs = [(f"output {v.name!r}: no rule concludes", "on ", v, concluded) for v in system.outputs]
    for text, on, variable, used in [*inputs, *outputs]:
        if variable.name not in {s.variable for s in used}:
            yield Finding("warning", "terms", f"{text} {on}it")
            continue
        for term in variable.term_names:
            if Is(variable.name, term) not in used:
                yield Finding("note", "terms", f"{text} its term {term!r}")


def redundant(system: System) -> Iterator[Finding]:
    """Yield the rules whose conclusion another rule always draws at least as strongly."""
    # The check uses the form of conditions: `a and b` is never above `a`, nor `a` above `a or b`.
    lattice = system.conjunction == "min" and system.disjunction == "max"
    by_conclusion: dict[Is, list[tuple[int, Rule]]] = defaultdict(list)
    outputs = {v.name for v in system.outputs}
    for i, rule in enumerate(system.rules):
        if rule.operators is None and not any(s.variable in outputs for s in rule.condition.terms()):
            for conclusion in rule.conclusions:
                by_conclusion[conclusion].append((i, rule))
    many = [str(conclusion) for conclusion, rules in by_conclusion.items() if len(rules) > MAX_COMPARED]
    if many:
        what = f"not compared with each other, being more than {MAX_COMPARED}: rules on {', '.join(many)}"
        yield Finding("note", "rules", what)
    for conclusion, rules in by_conclusion.items():
        if len(rules) > MAX_COMPARED:
            continue
        for i, rule in rules:
            for j, other in rules:
                if i == j or rule.weight > other.weight or not _below(rule.condition, other.condition, lattice):
                    continue
                same = other.weight <= rule.weight and _below(other.condition, rule.condition, lattice)
                if not same or j < i:
                    what = "says the same as" if same else "adds nothing to"
                    text = f"R{i + 1} '{rule}': on {conclusion} it {what} R{j + 1} '{other}'"
                    yield Finding("warning", "rules", text)
                    break


def _below(p: Proposition, q: Proposition, lattice: bool) -> bool:
    """Return True if the form of two propositions shows that the first is never above the second."""
    if p == q:
        return True
    if isinstance(p, Not) and isinstance(q, Not):
        return _below(q.part, p.part, lattice)
    if not lattice:  # p times p is below p, so that repeated parts count
        if isinstance(p, And) and not Counter(q.parts if isinstance(q, And) else (q,)) - Counter(p.parts):
            return True
        return isinstance(q, Or) and not Counter(p.parts if isinstance(p, Or) else (p,)) - Counter(q.parts)
    if isinstance(p, Or):
        return all(_below(part, q, lattice) for part in p.parts)
    if isinstance(q, And):
        return all(_below(p, part, lattice) for part in q.parts)
    if isinstance(p, And) and any(_below(part, q, lattice) for part in p.parts):
        return True
    return isinstance(q, Or) and any(_below(p, part, lattice) for part in q.parts)


def labels(system: System) -> dict[Proposition, str]:
    """Return the labels of the rules with each condition."""
    result: dict[Proposition, list[str]] = defaultdict(list)
    for i, rule in enumerate(system.rules):
        result[rule.condition].append(f"R{i + 1}")
    return {condition: ", ".join(names) for condition, names in result.items()}
