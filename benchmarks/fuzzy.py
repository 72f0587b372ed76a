"""Time of a decision of the arbiter, and of scikit-fuzzy and other libraries on the same rules."""

from __future__ import annotations

import importlib.util
import itertools
import json
import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peer_environment import Environment, installed_python
from benchmarks.peer_process import peer
from benchmarks.peers import skfuzzy_rules
from benchmarks.peers.fuzzy_libraries import LIBRARIES
from benchmarks.table import Row, with_base
from benchmarks.timing import InProcess, Timing, time_batches, time_calls, time_contestant
from fuzzy_arbiter import Arbiter, Output, System, Variable, auto_terms, curve, triangle
from fuzzy_arbiter.criteria import SECTION_VI, Criterion
from fuzzy_arbiter.definition import Defuzzifier
from fuzzy_arbiter.shapes import Membership

STEPS = 20_000
RATIO = "how many times as long as scikit-fuzzy as its examples use it"
POINTS = 101  # number of points of scikit-fuzzy's universes
# environment variable with the path of a Python with pyfuzzylite or simpful, for libraries that neither this Python nor
# the peers' environment has; pyfuzzylite needs a NumPy before 2
OTHER_PYTHON = "FUZZY_LIBRARIES_PYTHON"
_MODULES = {"pyfuzzylite": "fuzzylite", "simpful": "simpful"}  # importable module of each distribution
_ROWS = 5  # rows of a batch per step
_SLOWER = 50  # divisor of the calls of slower contestants
_OTHER_TIPPING: dict[str, dict[str, Any]] = {
    "Gaussian tips": {"curved": True},
    "Gaussian tips, bisector": {"curved": True, "defuzzifier": "bisector"},
    "Gaussian tips, mean of maxima": {"curved": True, "defuzzifier": "mom"},
    "Gaussian tips, prod": {"curved": True, "implication": "prod"},
    "Gaussian tips, probabilistic sum": {"curved": True, "aggregation": "probor"},
    "sum of triangles": {"aggregation": "sum"},
    "probabilistic sum of triangles": {"aggregation": "probor"},
}
_FUZZYLITE_WORDS: dict[str, dict[str, str]] = {name: {} for name in _OTHER_TIPPING} | {
    "Gaussian tips, bisector": {"defuzzifier": "Bisector"},
    "Gaussian tips, mean of maxima": {"defuzzifier": "MeanOfMaximum"},
    "Gaussian tips, prod": {"implication": "AlgebraicProduct"},
    "Gaussian tips, probabilistic sum": {"aggregation": "AlgebraicSum"},
    "sum of triangles": {"aggregation": "UnboundedSum"},
    "probabilistic sum of triangles": {"aggregation": "AlgebraicSum"},
}


def measure(steps: int, repeats: int) -> list[Row]:
    """Time evaluations of the paper's rules, with new inputs at each; a batch has five times as many rows."""
    timings: dict[str, Timing | str] = {}
    add, few = timings.__setitem__, max(1, steps // _SLOWER)
    add(f"scikit-fuzzy, stock, {POINTS} points", _stock(skfuzzy_rules.calls, few, repeats))
    add("scikit-fuzzy, stock, arrays", _stock(skfuzzy_rules.arrays, max(2, few), repeats))
    for library in LIBRARIES:
        add(f"{library}, resolution 100", _other(library, few, repeats))
    for engine in ("auto", "closed", "exact", "grid", "skfuzzy"):
        arbiter = Arbiter(engine=engine)
        add(f"one call: {engine} ({arbiter.engine})", _calls(arbiter, few if engine == "skfuzzy" else steps, repeats))
    forms = ("a dict", _named), ("an array", np.array), ("keywords", None)
    for words, form in forms:
        add(f"one call: closed, {words} in the place of a list", _calls(Arbiter(), steps, repeats, form))
    add("one call: closed, compiled", _compiled(Arbiter(engine="closed"), steps, repeats))
    for n in (3, 10, 40):
        criteria = [Criterion(f"c{i + 1}") for i in range(n)]
        add(f"one call: closed, {n} criteria", _calls(Arbiter(criteria, engine="closed"), steps, repeats))
    batch = np.random.default_rng(0).random((_ROWS * steps, len(SECTION_VI)))
    for engine in ("closed", "exact", "grid"):
        work = _batch(Arbiter(engine=engine), batch)
        add(f"batch of {len(batch)}: {engine}", time_batches(work, len(batch), repeats))
    for name, general in (("one rule at 0.9", _general()), ("tipping", _tipping())):
        rows = np.column_stack(
            [np.random.default_rng(0).uniform(*v.universe, len(batch)) for v in general.system.inputs]
        )
        add(f"batch of {len(rows)}: exact, {name}", time_batches(_batch(general, rows), len(rows), repeats))
        add(f"compiled, in a loop of its own: exact, {name}", _looped(general, rows, repeats))
    for name, options in _OTHER_TIPPING.items():
        other, rows = _tipping(**options), batch[: max(1, len(batch) // _SLOWER), :2] * 10.0
        add(f"one call: exact, tipping, {name}", _calls(other, few, repeats))
        add(f"batch of {len(rows)}: exact, tipping, {name}", time_batches(_batch(other, rows), len(rows), repeats))
        words = {"system": "gaussian_tipping" if "curved" in options else "tipping", **_FUZZYLITE_WORDS[name]}
        for points in (100, 1000):
            label = f"batch of {len(rows)}: pyfuzzylite, resolution {points}, tipping, {name}"
            add(label, _other_batch({**words, "resolution": points}, len(rows), repeats))
        if "curved" in options and not {"implication", "aggregation"} & set(options):
            setup = {"points": POINTS, "defuzzifier": options.get("defuzzifier", "centroid")}
            stock = _stock(skfuzzy_rules.tipping, max(2, few // 10), repeats, setup)
            add(f"batch: scikit-fuzzy, stock, arrays, {POINTS} points, tipping, {name}", stock)
    add("simpful, resolution 100, tipping, Gaussian tips", _other("simpful", few, repeats, "gaussian_tipping"))
    for system in ("section_vi", "tipping"):
        timing = _other_batch({"system": system, "resolution": 100}, len(batch), repeats)
        add(f"batch of {len(batch)}: pyfuzzylite, resolution 100, {system}", timing)
    add("building: 40 criteria", time_calls(lambda: Arbiter(criteria), max(1, few // 10), repeats))
    return with_base(timings)


def interpreter(library: str) -> str | None:
    """Return a Python that has a library: this one, one of the peers', or that of an environment variable; or None."""
    if importlib.util.find_spec(_MODULES[library]) is not None:
        return sys.executable
    if (python := installed_python(library)) is not None:
        return python
    other = os.environ.get(OTHER_PYTHON)
    if other is None:
        return None
    done = subprocess.run([other, "-c", f"import {_MODULES[library]}"], capture_output=True, check=False)
    return other if done.returncode == 0 else None


def ask(python: str, **request: Any) -> dict[str, Any]:
    """Send a request to `benchmarks.peers.fuzzy_libraries` in another process, and return the answer."""
    script = Path(__file__).parent / "peers" / "fuzzy_libraries.py"
    done = subprocess.run([python, str(script)], input=json.dumps(request), capture_output=True, text=True, check=True)
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def _other(library: str, evaluations: int, repeats: int, system: str = "section_vi") -> Timing | str:
    python = interpreter(library)
    if python is None:
        return f"{library} is not installed"
    setup = {"library": library, "system": system, "resolution": 100}
    with peer(Environment(python), library, "fuzzy_libraries", "evaluations", setup) as contestant:
        return time_contestant(contestant, evaluations, repeats)


def _other_batch(setup: dict[str, Any], rows: int, repeats: int) -> Timing | str:
    python = interpreter("pyfuzzylite")
    if python is None:
        return "pyfuzzylite is not installed"
    with peer(Environment(python), "pyfuzzylite", "fuzzy_libraries", "batches", setup) as contestant:
        return time_contestant(contestant, rows, repeats)


def _general() -> Arbiter:
    """Return the paper's rules with one of lower weight, for which there is no closed form."""
    system = Arbiter().system
    return Arbiter(replace(system, rules=(*system.rules[:-1], replace(system.rules[-1], weight=0.9))))


def _tipping(
    curved: bool = False, defuzzifier: Defuzzifier = "centroid", aggregation: str = "max", implication: str = "min"
) -> Arbiter:
    service, food = (Variable(name, (0, 10), auto_terms(3)) for name in ("service", "food"))
    terms: dict[str, Membership] = {
        "low": triangle(0, 0, 13), "medium": triangle(0, 13, 25), "high": triangle(13, 25, 25),
    }  # fmt: skip
    if curved:
        terms = {name: curve("gaussian", mean, 3.0) for name, mean in (("low", 4.0), ("medium", 12.5), ("high", 21.0))}
    rules = (
        "if service is poor or food is poor then tip is low",
        "if service is average then tip is medium",
        "if service is good or food is good then tip is high",
    )
    tip = Output("tip", (0, 25), terms, None, defuzzifier, aggregation)
    return Arbiter(System((service, food), (tip,), rules, implication=implication))


def _looped(arbiter: Arbiter, rows: np.ndarray[Any, np.dtype[np.float64]], repeats: int) -> Timing | str:
    """Time the compiled function when called from compiled code, as in a campaign."""
    if importlib.util.find_spec("numba") is None:
        return "Numba is not installed"
    import numba

    evaluate, outputs = arbiter.compiled(), np.empty((len(rows), len(arbiter.system.outputs)))

    @numba.njit
    def loop(inputs: Any, outputs: Any) -> None:
        for i in range(len(inputs)):
            evaluate(inputs[i], outputs[i])

    return time_batches(lambda: loop(rows, outputs), len(rows), repeats)


def _stock(
    function: Callable[[dict[str, Any]], Callable[[int], object]],
    count: int,
    repeats: int,
    setup: dict[str, Any] | None = None,
) -> Timing:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return time_contestant(InProcess(function(setup or {"points": POINTS})), count, repeats)


def _calls(arbiter: Arbiter, calls: int, repeats: int, form: Callable[[list[float]], Any] | None = list) -> Timing:
    """Time calls with samples converted by `form`; with None, with keyword arguments."""
    rows = itertools.islice(_inputs(len(arbiter.system.inputs)), 10_000)
    inputs = itertools.cycle([(_named if form is None else form)(row) for row in rows])
    if form is None:
        return time_calls(lambda: arbiter(**next(inputs)), calls, repeats)
    return time_calls(lambda: arbiter(next(inputs)), calls, repeats)


def _named(row: list[float]) -> dict[str, float]:
    return dict(zip((criterion.name for criterion in SECTION_VI), row, strict=True))


def _batch(arbiter: Arbiter, inputs: np.ndarray[Any, np.dtype[np.float64]]) -> Callable[[], object]:
    return lambda: arbiter.batch(inputs)


def _compiled(arbiter: Arbiter, calls: int, repeats: int) -> Timing | str:
    if not hasattr(arbiter, "compiled"):
        return "this arbiter has no compiled function"
    work = arbiter.compiled()
    inputs = itertools.cycle([np.array(row) for row in itertools.islice(_inputs(len(SECTION_VI)), 1000)])
    outputs = np.empty(len(SECTION_VI))
    return time_calls(lambda: work(next(inputs), outputs), calls, repeats)


def _inputs(n: int) -> itertools.cycle[list[float]]:
    return itertools.cycle(np.random.default_rng(0).random((10_000, n)).tolist())
