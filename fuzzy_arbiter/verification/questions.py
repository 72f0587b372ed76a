"""Questions about a system, for all crisp rows or all graded inputs, within a common effort."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.engines.clipped_centroid import term_centroids
from fuzzy_arbiter.propositions import And, Anything, Is, Not, Or, Proposition
from fuzzy_arbiter.rule import Operators, Rule
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.verification.cells import Domain, crisp, graded, ranked
from fuzzy_arbiter.verification.search import Answer, Goal, Group, Search

SUPPORT = (0.0, 1.0)
FULL = math.nextafter(1.0, 0.0)  # strength that only the strength 1 exceeds
ANY = 2**30  # number of groups that is never reached, for no upper limit
SAMPLES = 4096  # maximum number of sampled combinations
SEARCHES = 8  # which share the effort
# norms that are above 0 wherever the minimum is, or below 1 wherever the maximum is
_STRICT = ("min", "prod", "einstein_product", "hamacher_product", "max", "probor", "einstein_sum", "hamacher_sum")


def greatest_term(output: Output) -> str:
    """Return the term of an output with the greatest centroid."""
    centroids = term_centroids(output)
    return output.term_names[max(range(len(centroids)), key=lambda j: (centroids[j], j))]


def conditions_on_inputs(system: System) -> list[Proposition]:
    """Return the conditions of the rules, in which a statement on an output is the conditions of rules before."""
    result: list[Proposition] = []
    outputs = {v.name for v in system.outputs}
    never = Not(Anything(system.inputs[0].name))

    def on_inputs(p: Proposition) -> Proposition:
        if isinstance(p, Is) and p.variable in outputs:
            earlier = [own for own, rule in zip(result, system.rules, strict=False) if p in rule.conclusions]
            return Or(tuple(earlier)) if len(earlier) > 1 else earlier[0] if earlier else never
        if isinstance(p, And | Or):
            return type(p)(tuple(map(on_inputs, p.parts)))
        return replace(p, part=on_inputs(p.inner[0])) if p.inner else p  # type: ignore[type-var]

    for rule in system.rules:
        result += [on_inputs(rule.condition)]
    return result


def _is_sound(p: Proposition, norms: System | Operators, outputs: Collection[str], above: bool) -> bool:
    """Return True if a degree is above 0 (or, if not `above`, below 1) just where that under ``min`` and ``max`` is."""
    if isinstance(p, And | Or):
        if above == isinstance(p, And) and (norms.conjunction if above else norms.disjunction) not in _STRICT:
            return False
    elif isinstance(p, Is):
        return above or p.variable not in outputs
    return all(_is_sound(part, norms, outputs, above != isinstance(p, Not)) for part in p.inner)


class Questions:
    """Questions on one kind of inputs, crisp rows or graded inputs."""

    def __init__(self, system: System, domains: Sequence[Domain], levels: Sequence[float], effort: int) -> None:
        self._system, self._levels, self._effort = system, levels, effort
        self._domains = {domain.variable: domain for domain in domains}
        self._conditions = conditions_on_inputs(system)

    @classmethod
    def of_rows(cls, system: System, effort: int) -> Questions:
        """Return the questions on crisp rows."""
        return cls(system, [crisp(v, SUPPORT) for v in system.inputs if v.terms], SUPPORT, effort)

    @classmethod
    def of_support(cls, system: System, effort: int) -> Questions:
        """Return the questions on rules that fire at all."""
        return cls(system, [graded(v, SUPPORT) for v in system.inputs if v.terms], SUPPORT, effort)

    @classmethod
    def of_halves(cls, system: System, effort: int) -> Questions:
        """Return the questions on rules that fire above 1/2; they hold for ``min`` and ``max`` and every weight."""
        above = {0.5, *(0.5 / rule.weight for rule in system.rules if rule.weight > 0.5)}
        levels = sorted(above | {1.0 - level for level in above})
        return cls(system, [graded(v, levels) for v in system.inputs], levels, effort)

    @property
    def proves(self) -> bool:
        """True if the answers on support hold for the system's norms, and not only for ``min`` and ``max``."""
        system = self._system
        outputs = {v.name for v in system.outputs}
        return all(_is_sound(rule.condition, rule.operators or system, outputs, True) for rule in system.rules)

    def rules_on(self, statement: Is) -> list[tuple[Rule, Proposition]]:
        """Return the rules that conclude a statement, with their conditions on inputs."""
        pairs = zip(self._system.rules, self._conditions, strict=True)
        return [(rule, condition) for rule, condition in pairs if statement in rule.conclusions]

    def group(self, statement: Is, above: float = 0.0) -> Group:
        """Return the group of rules that conclude a statement at a strength above a number."""
        chosen = [(rule, condition) for rule, condition in self.rules_on(statement) if rule.weight > above]
        ranks = ranked(np.array([above / rule.weight for rule, _ in chosen]), self._levels).tolist()
        return tuple((condition, rank) for (_, condition), rank in zip(chosen, ranks, strict=True))

    def two_of(self, statements: Sequence[Is], above: float) -> Goal:
        """Return the goal that rules conclude two of some statements at a strength above a number."""
        return Goal(tuple(self.group(statement, above) for statement in statements), 2, ANY)

    def none_of(self, statements: Sequence[Is], above: float = 0.0) -> Goal:
        """Return the goal that rules conclude none of some statements at a strength above a number."""
        return Goal(tuple(self.group(statement, above) for statement in statements), 0, 0)

    def each(self) -> list[Group]:
        """Return a group for each rule, at any strength."""
        (fires,) = ranked(np.zeros(1), self._levels).tolist()
        return [((condition, fires),) for condition in self._conditions]

    def ask(self, goals: Sequence[Goal], max_boxes: int = 1) -> list[Answer]:
        """Search for the goals; goals with the same inputs share a search."""
        together: dict[frozenset[str], list[int]] = {}
        for i, goal in enumerate(goals):
            together.setdefault(goal.inputs(), []).append(i)
        answers: dict[int, Answer] = {}
        for members in together.values():
            search = Search([goals[i] for i in members], self._domains, 2 * len(self._levels))
            results = search.run(self._effort // SEARCHES // len(together), max_boxes)
            answers.update(zip(members, results, strict=True))
        return [answers[i] for i in range(len(goals))]

    def places(self, box: dict[str, int]) -> dict[str, float | str]:
        """Format a box as inputs: a number or a term for each one that matters."""
        return {v.name: self._domains[v.name].positions[box[v.name]] for v in self._system.inputs if v.name in box}

    def combinations(self) -> int:
        """Return the number of combinations of patterns."""
        return math.prod(len(domain.positions) for domain in self._domains.values())

    def samples(self) -> Array:
        """Return combinations of the patterns' places, all of them or 4096 by a fixed seed."""
        known = {name: np.array(domain.positions, dtype=np.float64) for name, domain in self._domains.items()}
        places = [known.get(v.name, np.array(v.universe)) for v in self._system.inputs]
        if math.prod(map(len, places)) <= SAMPLES:
            return np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, len(places))
        random = np.random.default_rng(0)
        return np.column_stack([random.choice(place, SAMPLES) for place in places])


def reach(system: System, conditions: Sequence[Proposition]) -> str:
    """Return the strength of a proof by ranks at 1/2 for a system's *and* and *or*: exact, a bound, or samples only."""
    parts = [part for condition in conditions for part in condition.parts_within()]
    if system.disjunction != "max" and any(isinstance(part, Or) for part in parts):
        return "samples"
    if system.conjunction == "min" or not any(isinstance(part, And) for part in parts):
        return "exact"
    negated = [part.part for part in parts if isinstance(part, Not)]
    return "bound" if all(isinstance(part, Is) for part in negated) else "samples"
