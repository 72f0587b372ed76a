"""Questions about a system, for all crisp rows or all graded inputs, within a common effort."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Literal

import numpy as np

from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.engines.clipped_centroid import term_centroids
from fuzzy_arbiter.engines.firing import Firing
from fuzzy_arbiter.propositions import And, Is, Not, Or, Proposition
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.verification.cells import Domain, crisp, graded, rank
from fuzzy_arbiter.verification.search import Answer, Goal, Group, Search

Reach = Literal["exact", "bound", "samples"]
HALF = Fraction(1, 2)
SUPPORT = (Fraction(0), Fraction(1))
FIRES, FULLY = rank(Fraction(0), SUPPORT), rank(Fraction(1), SUPPORT) - 1  # ranks to exceed
ANY = 2**30  # number of groups that is never reached, for no upper limit
SAMPLES = 4096  # maximum number of sampled combinations


class Effort:
    """The statements that searches may evaluate in all; a search leaves its unused part to the next ones."""

    def __init__(self, limit: int, searches: int) -> None:
        self.limit = limit
        self._left = limit
        self._searches = searches

    def share(self) -> int:
        """Return the number of statements that the next search may evaluate."""
        share = max(0, self._left) // max(1, self._searches)
        self._searches -= 1
        return share

    def use(self, statements: int) -> None:
        """Subtract the statements that a search has evaluated."""
        self._left -= statements


def greatest_term(output: Output) -> str:
    """Return the term of an output with the greatest centroid."""
    centroids = term_centroids(output)
    return output.term_names[max(range(len(centroids)), key=lambda j: (centroids[j], j))]


def rules_on(system: System, statement: Is) -> tuple[Rule, ...]:
    """Return the rules that conclude a statement."""
    return tuple(rule for rule in system.rules if statement in rule.conclusions)


class Questions:
    """Questions on one kind of inputs, crisp rows or graded inputs."""

    def __init__(self, system: System, domains: Sequence[Domain], levels: Sequence[Fraction], effort: Effort) -> None:
        self._system = system
        self._domains = {domain.variable: domain for domain in domains}
        self._levels = levels
        self._effort = effort

    @classmethod
    def of_rows(cls, system: System, effort: Effort) -> Questions:
        """Return the questions on crisp rows."""
        return cls(system, [crisp(v, SUPPORT) for v in system.inputs], SUPPORT, effort)

    @classmethod
    def of_support(cls, system: System, effort: Effort) -> Questions:
        """Return the questions on rules that fire at all; the answers hold for every *and*, *or* and weight."""
        return cls(system, [graded(v, SUPPORT) for v in system.inputs], SUPPORT, effort)

    @classmethod
    def of_halves(cls, system: System, effort: Effort) -> Questions:
        """Return the questions on rules that fire above 1/2; they hold for ``min`` and ``max`` and every weight."""
        above = {HALF, *(level for rule in system.rules if (level := HALF / Fraction(rule.weight)) < 1)}
        levels = tuple(sorted(above | {1 - level for level in above}))
        return cls(system, [graded(v, levels) for v in system.inputs], levels, effort)

    def firing(self, statement: Is) -> Group:
        """Return the group of rules that conclude a statement at any strength."""
        return tuple((rule.condition, FIRES) for rule in rules_on(self._system, statement))

    def fully(self, statement: Is) -> Group:
        """Return the group of rules that conclude a statement at strength 1."""
        return tuple((rule.condition, FULLY) for rule in rules_on(self._system, statement) if rule.weight == 1.0)

    def above_half(self, statement: Is) -> Group:
        """Return the group of rules that conclude a statement above 1/2."""
        return tuple(
            (rule.condition, rank(HALF / Fraction(rule.weight), self._levels))
            for rule in rules_on(self._system, statement)
            if rule.weight > 0.5
        )

    def ask(self, goals: Sequence[Goal], max_boxes: int = 1) -> list[Answer]:
        """Search for the goals; goals with the same inputs share a search."""
        together: dict[frozenset[str], list[int]] = {}
        for i, goal in enumerate(goals):
            together.setdefault(goal.inputs(), []).append(i)
        answers: dict[int, Answer] = {}
        share = Effort(self._effort.share(), len(together))
        top = 2 * len(self._levels)
        for members in together.values():
            search = Search([goals[i] for i in members], self._domains, top)
            results, used = search.run(share.share(), max_boxes)
            share.use(used)
            self._effort.use(used)
            answers.update(zip(members, results, strict=True))
        return [answers[i] for i in range(len(goals))]

    def places(self, box: dict[str, int]) -> dict[str, float | str]:
        """Format a box as inputs: a number or a term for each one that matters."""
        return {v.name: self._domains[v.name].positions[box[v.name]] for v in self._system.inputs if v.name in box}

    def combinations(self) -> int:
        """Return the number of combinations of patterns."""
        return math.prod(len(domain.positions) for domain in self._domains.values())

    def samples(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """Return combinations of the patterns' places, all of them or 4096 by a fixed seed."""
        places = [np.array(self._domains[v.name].positions, dtype=np.float64) for v in self._system.inputs]
        if self.combinations() <= SAMPLES:
            return np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, len(places))
        random = np.random.default_rng(0)
        return np.column_stack([random.choice(place, SAMPLES) for place in places])


def reach(system: System, conditions: Sequence[Proposition]) -> Reach:
    """Return the strength of a proof by ranks at 1/2 for a system's *and* and *or*."""
    parts = [part for condition in conditions for part in condition.parts_within()]
    if system.disjunction != "max" and any(isinstance(part, Or) for part in parts):
        return "samples"
    if system.conjunction == "min" or not any(isinstance(part, And) for part in parts):
        return "exact"
    negated = [part.part for part in parts if isinstance(part, Not)]
    return "bound" if all(isinstance(part, Is) for part in negated) else "samples"


def sampled(system: System, questions: Questions, statements: Sequence[Is]) -> dict[str, float | str] | None:
    """Return a sample at which two of some statements are concluded above 1/2."""
    samples = questions.samples()
    firing = Firing(system)
    cuts = firing.cuts(firing.strengths(samples))
    terms = {v.name: (k, v.term_names) for k, v in enumerate(system.outputs)}
    chosen = [cuts[terms[s.variable][0]][terms[s.variable][1].index(s.term)] for s in statements]
    rows = np.flatnonzero((np.array(chosen) > 0.5 + 1e-9).sum(axis=0) >= 2)
    if not len(rows):
        return None
    return {v.name: float(x) for v, x in zip(system.inputs, samples[rows[0]], strict=True)}
