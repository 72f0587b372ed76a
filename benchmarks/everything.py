"""All contests with peers, in one table."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator

from benchmarks.contest import Contest
from benchmarks.contests import closed_loop, deciding, link, plant, starting
from benchmarks.peer_environment import Environment
from benchmarks.table import Table

RATIO = "how many times as long as ours the peer takes; its range is over the repeats, in which they take turns"
REPEATS = 7
SUBJECTS: dict[str, Callable[[Environment], Iterator[Contest]]] = {
    "plant": plant.contests,
    "loop": closed_loop.contests,
    "deciding": deciding.contests,
    "link": link.contests,
    "starting": starting.contests,
}


def measure(subjects: list[str], budget: float, repeats: int, environment: Environment) -> list[Table]:
    """Run the contests of some subjects; budget [s] of a repeat."""
    tables = []
    for subject in subjects:
        for contest in SUBJECTS[subject](environment):
            print(contest.title, file=sys.stderr, flush=True)
            tables.append(contest.measure(budget, repeats))
    return tables
