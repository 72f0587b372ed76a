"""A decision of the arbiter by the paper's rules, and a step of the laws."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import numpy as np

from benchmarks.contest import Contest, Entry
from benchmarks.law import LawSteps
from benchmarks.peer_environment import Environment
from benchmarks.peer_process import peer
from benchmarks.timing import Contestant, Own, each
from fuzzy_arbiter import SECTION_VI, Arbiter

POINTS = 101
LAWS = ("printed", "deployable")
OBSTACLES = 6
_INPUTS = 1000


def contests(environment: Environment) -> Iterator[Contest]:
    """Yield the contests of arbiter and laws."""
    ours: dict[str, Entry] = {
        "arbiter, closed form": _calls("closed"),
        "arbiter, closed form, compiled": _compiled,
        "arbiter, exact engine": _calls("exact"),
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


def _calls(engine: str) -> Entry:
    def entry(_: ExitStack) -> Contestant:
        arbiter, inputs = Arbiter(engine=engine), _inputs()
        return Own(each(lambda: arbiter(next(inputs))))

    return entry


def _compiled(_: ExitStack) -> Contestant:
    decide = Arbiter(engine="closed").compiled()
    inputs = itertools.cycle([np.array(row) for row in itertools.islice(_inputs(), _INPUTS)])
    outputs = np.empty(len(SECTION_VI))
    return Own(each(lambda: decide(next(inputs), outputs)))


def _batch(_: ExitStack) -> Contestant:
    arbiter, rng = Arbiter(engine="closed"), np.random.default_rng(0)
    return Own(lambda count: arbiter.batch(rng.random((count, len(SECTION_VI)))))


def _inputs() -> itertools.cycle[list[float]]:
    return itertools.cycle(np.random.default_rng(0).random((_INPUTS, len(SECTION_VI))).tolist())


def _library(environment: Environment, library: str) -> Callable[[ExitStack], Contestant]:
    setup = {"library": library, "system": "section_vi", "resolution": 100}
    return lambda stack: stack.enter_context(peer(environment, library, "fuzzy_libraries", "evaluations", setup))


def _law(law: str) -> Entry:
    return lambda _: LawSteps(law, OBSTACLES)
