"""The fuzzy arbiter of a scenario as a component for FMUs."""

from __future__ import annotations

import re
from collections.abc import Iterator

from cosim.scenario.scenario import Scenario
from cosim.ssp.c_sources import c_files, under_own_names
from cosim.ssp.documentation import contents
from fuzzy_arbiter import System
from fuzzy_arbiter.export import to_c
from plant_fmu import quantities as q
from plant_fmu.component import Component
from plant_fmu.quantities import Quantity
from plant_fmu.variables import Variable

_WORDS = """To what degree each criterion asks for attention goes in, or what else the rules get; what weight the
fuzzy arbiter gives to each comes out, by the exact form of its rules.

The weights are worked out in a step, from the inputs at its beginning, once in each time.arbiter counted
from the start, and hold until the next time; before the first step they are 0."""

_DECLARATION = re.compile(r"^int (\w+)\(const double inputs\[\d+\], double outputs\[\d+\]\);$", re.MULTILINE)


def arbiter_component(scenario: Scenario) -> Component:
    """Make the component of a scenario's arbiter."""
    rows = (
        Variable("time", "time", "time", q.TIME, "Simulated time"),
        *_inputs(scenario),
        *(
            Variable(f"weight.{name}", "output", f"weights[{i}]", q.unbounded(""), f"Weight of criterion {name}")
            for i, name in enumerate(scenario.criterion_names)
        ),
        Variable("time.arbiter", "parameter", "period", Quantity("s", 1e-6, 1e6), "Period of the arbiter",
                 scenario.time.arbiter),
    )  # fmt: skip
    return Component(
        name="arbiter",
        description="Fuzzy arbiter: which criterion matters now",
        variables=rows,
        sources=_sources(scenario.rules.system),
        contents=lambda fmi: contents("Arbiter", _WORDS, rows, fmi),
        constants={"N_CRITERIA": len(scenario.criteria), "N_RULE_INPUTS": len(scenario.rules.inputs)},
        stop_time=scenario.time.duration,
        step=scenario.time.step,
    )


def _inputs(scenario: Scenario) -> Iterator[Variable]:
    """Yield the inputs of the rules: the memberships, or the scenario's signals."""
    for i, signal in enumerate(scenario.rules.signals):
        low, high = scenario.rules.system.inputs[i].universe
        unit = signal.unit if signal.unit in q.UNITS else ""
        quantity = Quantity(unit, min(low, 0.0), max(high, 0.0))  # masters start inputs with 0
        yield Variable(f"arbiter.{signal.name}", "input", f"inputs[{i}]", quantity, signal.what)
    for i, name in enumerate(() if scenario.rules.signals else scenario.criterion_names):
        what = f"Degree to which criterion {name} asks for attention"
        yield Variable(f"membership.{name}", "input", f"inputs[{i}]", q.FRACTION, what)


def _sources(system: System) -> dict[str, bytes]:
    code = to_c(system)
    declaration = _DECLARATION.search(code)
    if declaration is None:
        raise AssertionError("the arbiter's C code declares no function that evaluates it")
    header = f"/* The arbiter's rules: generated. */\n{declaration[0]}\n#define EVALUATE_RULES {declaration[1]}\n"
    return {
        **c_files("cosim.ssp", "csrc/arbiter"),
        **under_own_names({"rules.c": code.encode(), "rules.h": header.encode()}),
        "ticks.h": c_files("cosim.ssp", "csrc")["ticks.h"],
    }
