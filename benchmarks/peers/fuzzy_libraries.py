"""Two systems in pyfuzzylite and in simpful; independent of this project, since pyfuzzylite needs its own NumPy.

One request in JSON comes on the standard input, and one answer in JSON goes to the standard output:
``{"library": "simpful", "system": "tipping", "resolution": 100, "inputs": [[6.5, 9.8]]}``.
"""

from __future__ import annotations

import itertools
import json
import random
import sys
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

LIBRARIES = ("pyfuzzylite", "simpful")

# variables: range, and points (value, degree) of each term
_DEGREE = ((0.0, 1.0), {"off": ((0.0, 1.0), (1.0, 0.0)), "on": ((0.0, 0.0), (1.0, 1.0))})
_WEIGHT = ((0.0, 1.0), {"low": ((0.0, 1.0), (1.0, 0.0)), "high": ((0.0, 0.0), (1.0, 1.0))})
_MARK = (
    (0.0, 10.0),
    {
        "poor": ((0.0, 1.0), (5.0, 0.0)),
        "average": ((0.0, 0.0), (5.0, 1.0), (10.0, 0.0)),
        "good": ((5.0, 0.0), (10.0, 1.0)),
    },
)
_TIP = (
    (0.0, 25.0),
    {
        "low": ((0.0, 1.0), (13.0, 0.0)),
        "medium": ((0.0, 0.0), (13.0, 1.0), (25.0, 0.0)),
        "high": ((13.0, 0.0), (25.0, 1.0)),
    },
)
_CURVED_TIP = ((0.0, 25.0), {"low": (4.0, 3.0), "medium": (12.5, 3.0), "high": (21.0, 3.0)})  # means, deviations
_TIPPING_RULES = (
    (["quality is poor", "service is poor"], "or", "tip is low"),
    (["service is average"], "", "tip is medium"),
    (["quality is good", "service is good"], "or", "tip is high"),
)
# inputs, outputs, and rules in a form that is converted to the text of each library
SYSTEMS: dict[str, Any] = {
    "section_vi": (
        {"obstacle": _DEGREE, "shape": _DEGREE, "depth": _DEGREE},
        {"alpha_1": _WEIGHT, "alpha_2": _WEIGHT, "alpha_3": _WEIGHT},
        (
            (["obstacle is on"], "", "alpha_1 is high"),
            (["obstacle is off"], "", "alpha_1 is low"),
            (["obstacle is on"], "", "alpha_2 is low"),
            (["shape is off"], "", "alpha_2 is low"),
            (["obstacle is off", "shape is on"], "and", "alpha_2 is high"),
            (["obstacle is on", "shape is on"], "or", "alpha_3 is low"),
            (["depth is off"], "", "alpha_3 is low"),
            (["obstacle is off", "shape is off", "depth is on"], "and", "alpha_3 is high"),
        ),
    ),
    "tipping": ({"quality": _MARK, "service": _MARK}, {"tip": _TIP}, _TIPPING_RULES),
    "gaussian_tipping": ({"quality": _MARK, "service": _MARK}, {"tip": _CURVED_TIP}, _TIPPING_RULES),
}
Evaluate = Callable[[list[float]], list[float]]


def _fuzzylite_text(
    system: str,
    resolution: int,
    defuzzifier: str = "Centroid",
    aggregation: str = "Maximum",
    implication: str = "Minimum",
) -> str:
    """Return a system's text in the FuzzyLite language."""
    inputs, outputs, rules = SYSTEMS[system]
    text = [f"Engine: {system}"]
    for kind, variables in (("InputVariable", inputs), ("OutputVariable", outputs)):
        for name, ((low, high), terms) in variables.items():
            text += [f"{kind}: {name}", "  enabled: true", f"  range: {low} {high}", "  lock-range: false"]
            if kind == "OutputVariable":
                text += [
                    f"  aggregation: {aggregation}",
                    f"  defuzzifier: {defuzzifier} {resolution}",
                    "  default: nan",
                ]
                text += ["  lock-previous: false"]
            for term, points in terms.items():
                if isinstance(points[0], float):
                    shape = "Gaussian {} {}".format(*points)
                elif len(points) == 3:
                    shape = "Triangle {} {} {}".format(*(x for x, _ in points))
                else:  # a ramp runs from its foot to its top
                    shape = "Ramp {} {}".format(*(x for x, _ in sorted(points, key=lambda point: point[1])))
                text += [f"  term: {term} {shape}"]
    text += ["RuleBlock:", "  enabled: true", "  conjunction: Minimum", "  disjunction: Maximum"]
    text += [f"  implication: {implication}", "  activation: General"]
    text += [f"  rule: if {f' {join} '.join(asked)} then {concluded}" for asked, join, concluded in rules]
    return "\n".join(text)


def pyfuzzylite(system: str, resolution: int) -> tuple[Evaluate, str]:
    """Return a function of the inputs, and the system's text in the FuzzyLite language."""
    import fuzzylite

    text = _fuzzylite_text(system, resolution)
    engine = fuzzylite.FllImporter().from_string(text)

    def evaluate(values: list[float]) -> list[float]:
        for variable, value in zip(engine.input_variables, values, strict=True):
            variable.value = value
        engine.process()
        return [float(variable.value) for variable in engine.output_variables]

    return evaluate, text


def simpful(system: str, resolution: int) -> tuple[Evaluate, str]:
    """Return a function of the inputs, and the system's terms and rules in simpful's format."""
    from simpful import FuzzySet, FuzzySystem, GaussianFuzzySet, LinguisticVariable

    inputs, outputs, rules = SYSTEMS[system]
    made = FuzzySystem(show_banner=False)
    text = []
    for name, ((low, high), terms) in {**inputs, **outputs}.items():
        sets = []
        for term, points in terms.items():
            if isinstance(points[0], float):
                sets.append(GaussianFuzzySet(*points, term))
                continue
            # simpful needs a degree at both ends of the universe
            ends = [point for point in ((low, points[0][1]), (high, points[-1][1])) if point not in points]
            shown = sorted([*points, *ends])
            sets.append(FuzzySet(points=[list(point) for point in shown], term=term))
            text.append(f"{name} {term}: {shown}")
        made.add_linguistic_variable(name, LinguisticVariable(sets, universe_of_discourse=[low, high]))
    sentences = []
    for asked, join, concluded in rules:
        first, *others = (f"({clause.replace(' is ', ' IS ')})" for clause in asked)
        clauses = first
        for i, other in enumerate(others):  # simpful's connectives have two operands
            clauses = f"{f'({clauses})' if i else clauses} {join.upper()} {other}"
        sentences.append(f"IF {clauses} THEN ({concluded.replace(' is ', ' IS ')})")
    made.add_rules(sentences)

    def evaluate(values: list[float]) -> list[float]:
        for name, value in zip(inputs, values, strict=True):
            made.set_variable(name, value)
        found = made.Mamdani_inference(subdivisions=resolution)
        return [float(found[name]) for name in outputs]

    return evaluate, "\n".join([*text, *sentences])


_LIBRARIES = {"pyfuzzylite": pyfuzzylite, "simpful": simpful}


def evaluations(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that makes a given number of evaluations, with new inputs each time."""
    evaluate, _ = _LIBRARIES[setup["library"]](setup["system"], setup["resolution"])
    n, rng = len(SYSTEMS[setup["system"]][0]), random.Random(0)
    inputs = itertools.cycle([[rng.random() for _ in range(n)] for _ in range(1000)])

    def work(count: int) -> None:
        for _ in range(count):
            evaluate(next(inputs))

    return work


def batches(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that evaluates a given number of rows at once, which only pyfuzzylite supports."""
    import fuzzylite
    import numpy as np

    engine = fuzzylite.FllImporter().from_string(_fuzzylite_text(**setup))
    rng, ranges = np.random.default_rng(0), [span for span, _ in SYSTEMS[setup["system"]][0].values()]

    def work(count: int) -> None:
        for variable, (low, high) in zip(engine.input_variables, ranges, strict=True):
            variable.value = rng.uniform(low, high, count)
        engine.process()

    return work


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """Return a library's version, the system's text, and the outputs."""
    evaluate, text = _LIBRARIES[request["library"]](request["system"], request["resolution"])
    return {
        "library": request["library"],
        "version": version(request["library"]),
        "resolution": request["resolution"],
        "text": text,
        "outputs": [evaluate(values) for values in request["inputs"]],
    }


if __name__ == "__main__":
    json.dump(answer(json.load(sys.stdin)), sys.stdout)
