"""A decision of the arbiter with the paper's rules, and a step of the laws."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import numpy as np

from benchmarks.contest import Contest, Entry
from benchmarks.law import LawSteps
from benchmarks.peer_environment import Environment
from benchmarks.peer_process import peer
from benchmarks.timing import Contestant, InProcess
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.criteria import SECTION_VI

POINTS = 101  # number of points of scikit-fuzzy's universes
LAWS = ("ismail_dunnigan", "deployable")
OBSTACLES = 6  # number of obstacles on the path of a law


def contests(environment: Environment) -> Iterator[Contest]:
    """Yield the contests of arbiter and laws."""
    ours: dict[str, Entry] = {
        "arbiter, exact engine": _calls("exact"),
        "arbiter, closed form": _calls("closed"),
        "arbiter, closed form, compiled": _compiled,
        "arbiter, on scikit-fuzzy": _calls("skfuzzy"),
    }
    stock = f"scikit-fuzzy, compute(), {POINTS} points"
    setup = {"points": POINTS}
    libraries = {
        "pyfuzzylite, 100 points": _library(environment, "pyfuzzylite"),
        "simpful, 100 points": _library(environment, "simpful"),
    }
    yield Contest(
        "A decision by the paper's eight rules, new inputs each time",
        ours,
        {
            stock: lambda stack: stack.enter_context(
                peer(environment, "scikit-fuzzy", "skfuzzy_rules", "calls", setup)
            ),
            **libraries,
        },
        (*((our, stock) for our in ours), *(("arbiter, closed form", library) for library in libraries)),
    )
    yield Contest(
        "A decision of many at once, arrays",
        {"arbiter, closed form, batch": _batch},
        {
            "scikit-fuzzy, compute() of arrays": lambda stack: stack.enter_context(
                peer(environment, "scikit-fuzzy", "skfuzzy_rules", "arrays", setup)
            )
        },
    )
    yield Contest(
        f"A step of a law in compiled code, {OBSTACLES} obstacles and a depth band",
        {f"law {law!r}": _law(law) for law in LAWS},
    )


class _Decisions:
    """Decisions with new inputs each time: some engines cache their last results."""

    def __init__(self, decide: Callable[[Any], object], made: Callable[[list[float]], Any] = list) -> None:
        self._decide, self._made, self._rng = decide, made, np.random.default_rng(0)

    def seconds(self, count: int) -> float:
        """Decide `count` times, and return the time [s]."""
        decide, inputs = self._decide, [self._made(row) for row in self._rng.random((count, len(SECTION_VI))).tolist()]
        before = time.perf_counter()
        for row in inputs:
            decide(row)
        return time.perf_counter() - before


def _calls(engine: str) -> Entry:
    return lambda _: _Decisions(Arbiter(engine=engine))


def _compiled(_: ExitStack) -> Contestant:
    decide, outputs = Arbiter(engine="closed").compiled(), np.empty(len(SECTION_VI))
    return _Decisions(lambda inputs: decide(inputs, outputs), np.array)


def _batch(_: ExitStack) -> Contestant:
    arbiter, rng = Arbiter(engine="closed"), np.random.default_rng(0)
    return InProcess(lambda count: arbiter.batch(rng.random((count, len(SECTION_VI)))))


def _library(environment: Environment, library: str) -> Callable[[ExitStack], Contestant]:
    setup = {"library": library, "system": "section_vi", "resolution": 100}
    return lambda stack: stack.enter_context(peer(environment, library, "fuzzy_libraries", "evaluations", setup))


def _law(law: str) -> Entry:
    return lambda _: LawSteps(law, OBSTACLES)
