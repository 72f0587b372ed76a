"""Places of a view's signals in the arrays that a page's flight writes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from cosim.replay.interactive.flight import Flight
from cosim.simulation.signals import Column

_AXES = ("X", "Y", "Z", "K", "M", "N")


def signal_sources(flight: Flight, columns: Sequence[Column]) -> dict[str, list[Any]]:
    """Return the place of each signal in a flight's arrays, or the numbers from which the page computes it."""
    # with returns ["trace", place]
    known = dict(_known(flight))
    return {column.name: known[column.name] for column in columns if column.name in known}


def _known(flight: Flight) -> Iterator[tuple[str, list[Any]]]:
    scenario, through = flight.scenario, flight.setup.thrusters > 0
    n, c, m = len(scenario.regions), len(scenario.criteria), flight.workspace.signals.inputs.size
    criteria, matrix = scenario.criterion_names, scenario.vehicle.thruster_matrix.tolist()
    motion = [
        *(f"position.{axis}" for axis in "xyz"), *(f"quaternion.e{i}" for i in range(4)),
        *(f"velocity.{axis}" for axis in "uvwpqr"),
    ]  # fmt: skip
    for i, name in enumerate(["time", *motion]):
        yield name, ["trace", i]
    for axis in ("roll", "pitch", "yaw"):
        yield f"attitude.{axis}", ["attitude", axis]
    for i, name in enumerate(criteria):
        yield f"weight.{name}", ["trace", 17 + i]
        yield f"membership.{name}", ["reasons", 1 + n + i]
    for i, name in enumerate(["goal", *(secondary.region.name for secondary in scenario.regions)]):
        yield f"{name}.clearance", ["reasons", i]
        for k, letter in enumerate("xyz" if name in scenario.moving else ""):
            yield f"{name}.shift.{letter}", ["shift", i, k]
    for i, axis in enumerate("xyz"):
        yield f"water_velocity.{axis}", ["water", i]
    yield "goal.place", ["reasons", 11 + n + c + m]
    for i, signal in enumerate(scenario.rules.inputs if scenario.arbiter.file else ()):
        yield f"arbiter.{signal.name}", ["reasons", 1 + n + c + i]
    for i in range(4):
        yield f"estimate.phi{i + 1}", ["reasons", 1 + n + c + m + i]
    allocated, forces = 5 + n + c + m, 12 + n + c + m
    for i, axis in enumerate(_AXES):
        if not through:
            yield f"command.{axis}", ["trace", 17 + c + i]
        elif flight.law.output == "wrench":
            yield f"command.{axis}", ["reasons", allocated + i]
        else:
            yield f"command.{axis}", ["sum", "trace", 17 + c, matrix[i]]
        if through:
            yield f"actuation.{axis}", ["sum", "reasons", forces, matrix[i]]
        elif i < 3:
            yield f"actuation.{axis}", ["reasons", forces + i]
    for i in range(scenario.vehicle.n_thrusters if through else 0):
        yield f"thruster_force[{i + 1}]", ["reasons", forces + i]
    yield "active", ["active"]
    for i in range(len(scenario.rules.system.rules)):
        yield f"rule.R{i + 1}", ["rules", i]
