"""Search all combinations of inputs' patterns exhaustively, without those that bounds refute."""

# Inputs are settled one after the other. As long as one is open, a statement about it has bounds, the least and the
# greatest rank of its term. *and*, *or* and *not* take bounds to bounds, so a question is often answered for a whole
# box of combinations at once: for prioritized criteria the work grows with a power of their number, not with two to the
# power of it.

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fuzzy_arbiter.engines.firing import Logic
from fuzzy_arbiter.propositions import Is, Proposition
from fuzzy_arbiter.verification.cells import Domain, Ranks

CHUNK = 8192  # number of combinations evaluated together
Bounds = tuple[Ranks, Ranks]
Group = tuple[tuple[Proposition, int], ...]
Box = dict[str, int]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Goal:
    """A combination to look for."""

    groups: tuple[Group, ...]  # A group fires where any of its propositions has a rank above the number beside it
    min_count: int  # bounds of the number of groups that fire
    max_count: int

    def inputs(self) -> frozenset[str]:
        """Return the names of the inputs that the groups speak of."""
        return frozenset(s.variable for group in self.groups for condition, _ in group for s in condition.terms())


@dataclass(frozen=True, slots=True)
class Answer:
    """The result of a search."""

    boxes: tuple[Box, ...]  # pattern of each input that matters; the goal is met whatever the others are
    is_complete: bool  # true if the search went through all combinations, so that there are no more boxes
    combinations: int  # number of combinations of the goal's inputs


class Search:
    """One search for several goals that speak of the same inputs."""

    def __init__(self, goals: Sequence[Goal], domains: Mapping[str, Domain], top: int) -> None:
        self._goals = goals
        whole = np.array([top - 1], dtype=np.int32)  # rank of the degree 1
        # hedges keep the degrees 0 and 1, and those between
        self._logic: Logic[Bounds] = Logic(_min, _max, lambda a: _not(a, top), lambda _, a: a, (whole, whole))
        groups: dict[Group, int] = {}
        self._members = [[groups.setdefault(group, len(groups)) for group in goal.groups] for goal in goals]
        self._groups = len(groups)
        self._uses: dict[Proposition, list[tuple[int, int]]] = {}  # group and threshold
        for group, g in groups.items():
            for condition, threshold in group:
                self._uses.setdefault(condition, []).append((g, threshold))
        # the inputs of most statements come first: they refute most
        statements = [statement for condition in self._uses for statement in condition.terms()]
        self._cost = max(1, len(statements))
        stated_ones = set(statements)
        mentions = Counter(statement.variable for statement in statements)
        self._order = sorted((name for name in domains if name in mentions), key=lambda name: -mentions[name])
        self._position = {name: i for i, name in enumerate(self._order)}
        self._ranks: dict[Is, Ranks] = {}
        self._bounds: dict[Is, Bounds] = {}
        self._patterns: list[NDArray[np.intp]] = []  # patterns of each input in order that its stated terms distinguish
        for name in self._order:
            domain = domains[name]
            stated = [j for j, term in enumerate(domain.terms) if Is(name, term) in stated_ones]
            _, first = np.unique(domain.ranks[:, stated], axis=0, return_index=True)
            self._patterns.append(np.sort(first))
            for j in stated:
                ranks = domain.ranks[self._patterns[-1], j]
                self._ranks[Is(name, domain.terms[j])] = ranks
                self._bounds[Is(name, domain.terms[j])] = ranks.min(keepdims=True), ranks.max(keepdims=True)
        self.combinations = math.prod(map(len, self._patterns))

    def run(self, limit: int, max_boxes: int = 1) -> list[Answer]:
        """Search for boxes that meet the goals."""
        boxes_by_goal: list[list[Box]] = [[] for _ in self._goals]
        open_goals = list(range(len(self._goals)))
        stack = [np.zeros((1, 0), dtype=np.int32)]
        searched = 0
        while stack and open_goals and searched * self._cost < limit:
            # few at a time in the beginning, so that an easy goal ends early
            size = min(CHUNK, max(16, searched // 8), max(1, limit // self._cost))
            boxes = stack.pop()
            if len(boxes) > size:
                stack.append(boxes[size:])
                boxes = boxes[:size]
            searched += len(boxes)
            sure, possible = self._judge(boxes)
            keep = np.zeros(len(boxes), dtype=np.bool_)
            for g in open_goals:
                for row in np.flatnonzero(sure[g])[: max_boxes - len(boxes_by_goal[g])]:
                    boxes_by_goal[g].append(self._box(boxes[row]))
            open_goals = [g for g in open_goals if len(boxes_by_goal[g]) < max_boxes]
            for g in open_goals:
                keep |= possible[g] & ~sure[g]
            boxes = boxes[keep]
            if len(boxes):
                patterns = np.arange(len(self._patterns[boxes.shape[1]]), dtype=np.int32)
                grown = np.repeat(boxes, len(patterns), axis=0)
                stack.append(np.column_stack((grown, np.tile(patterns, len(boxes)))))
        is_complete = not stack  # for a goal that has max_boxes, others were left out
        return [
            Answer(tuple(boxes), is_complete and len(boxes) < max_boxes, self.combinations) for boxes in boxes_by_goal
        ]

    def _box(self, row: NDArray[np.int32]) -> Box:
        return {self._order[i]: int(self._patterns[i][p]) for i, p in enumerate(row)}

    def _judge(self, boxes: NDArray[np.int32]) -> tuple[list[Flags], list[Flags]]:
        """Return two masks for each goal: it is met in all of a box; it may be met in some of the box."""
        n, depth = boxes.shape
        known: dict[Is, Bounds] = {}

        def bounds_of(statement: Is) -> Bounds:
            if statement not in known:
                known[statement] = self._bounds[statement]
                if (i := self._position[statement.variable]) < depth:
                    degrees = self._ranks[statement][boxes[:, i]]
                    known[statement] = degrees, degrees
            return known[statement]

        surely, maybe = np.zeros((2, self._groups, n), dtype=np.bool_)
        for condition, uses in self._uses.items():
            lower, upper = self._logic.degree(condition, bounds_of)
            for g, threshold in uses:
                surely[g] |= lower > threshold
                maybe[g] |= upper > threshold
        sure, possible = [], []
        for goal, members in zip(self._goals, self._members, strict=True):
            lower_count = surely[members].sum(axis=0)
            upper_count = maybe[members].sum(axis=0)
            sure.append((lower_count >= goal.min_count) & (upper_count <= goal.max_count))
            possible.append((upper_count >= goal.min_count) & (lower_count <= goal.max_count))
        return sure, possible


# bounds that are one array are known exactly, and need no second evaluation
def _min(a: Bounds, b: Bounds) -> Bounds:
    lower = np.minimum(a[0], b[0])
    return lower, lower if a[0] is a[1] and b[0] is b[1] else np.minimum(a[1], b[1])


def _max(a: Bounds, b: Bounds) -> Bounds:
    lower = np.maximum(a[0], b[0])
    return lower, lower if a[0] is a[1] and b[0] is b[1] else np.maximum(a[1], b[1])


def _not(a: Bounds, top: int) -> Bounds:
    upper = np.int32(top) - a[0]
    return (upper if a[0] is a[1] else np.int32(top) - a[1]), upper
