"""What a view must know of a run before its first row: regions, vehicle, rules, in words and numbers JSON knows."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from controller.regions.region_set import name_of, of_attitude, surface_of
from controller.regions.shape import Shape
from cosim.results.wording import asked
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Column
from fuzzy_arbiter import Arbiter, System
from plant_fmu import Vehicle
from plant_fmu.thruster_lines import thruster_lines

VERSION = 1  # of the format
# whose pictures the page makes of their numbers; all others are drawn by the mesh of their entry
DRAWN_BY_NUMBERS = (
    "sphere", "ellipsoid", "box", "cylinder", "prism", "cone", "pipe", "depth_band", "half_space", "orientation",
    "visibility",
)  # fmt: skip
_SEA_WATER = 1026.0 * 9.81  # N/m3; only for the size of a hull that no vehicle's file tells


def header_of(scenario: Scenario, columns: Sequence[Column], commands: bool = False) -> dict[str, Any]:
    """Return what a view must know of a run before its first row.

    Parameters
    ----------
    scenario : Scenario
        What is run.
    columns : sequence of Column
        Of the rows that a view gets, in their order.
    commands : bool
        Whether the viewer may order things.

    Returns
    -------
    dict
        Of texts, numbers, booleans, lists and dicts.
    """
    system = Arbiter(engine="closed").system
    return {
        "version": VERSION,
        "name": scenario.name,
        "title": scenario.title,
        "asked": asked(scenario),
        "law": scenario.law.name,
        "step": scenario.time.step,
        "duration": scenario.time.duration,
        "ramp": scenario.arbiter.ramp,
        "commands": commands,
        "through": scenario.actuation.through,
        "vehicle": _vehicle(scenario.vehicle),
        "regions": [_region(scenario, i) for i in range(len(scenario.regions) + 1)],
        "rules": rules_of(system),
        "truth": {"estimate": [float(phi) for phi in scenario.true_restoring_parameters]},
        "signals": [dataclasses.asdict(column) for column in columns],
    }


def rules_of(system: System) -> list[dict[str, str]]:
    """Return the rules of an arbiter: label, text, and words that are short enough for a view."""
    return [
        {"label": f"R{i + 1}", "text": str(rule), "words": _words(str(rule))} for i, rule in enumerate(system.rules)
    ]


def shape_of(shape: Shape) -> dict[str, Any]:
    """Return a shape with its ``kind`` and its own parameters [m, rad, NED], and its ``mesh`` where its entry has one.

    Raises
    ------
    RegionError
        If the page could draw it by neither.
    """
    kind = name_of(shape)
    told = {"kind": kind, **dataclasses.asdict(shape)}  # type: ignore[call-overload]
    if kind not in DRAWN_BY_NUMBERS:
        mesh = surface_of(shape, shape.bounds())
        told["mesh"] = {"points": mesh.vertices.tolist(), "faces": mesh.triangles.tolist()}
    return told


def _region(scenario: Scenario, index: int) -> dict[str, Any]:
    secondary = scenario.regions[index - 1] if index else None
    region = secondary.region if secondary else scenario.goal_region
    return {
        "name": region.name,
        "criterion": secondary.criterion if secondary else None,
        "keep": region.keep,
        "hard": region.hard,
        "gain": region.gain,
        "moves": region.name in scenario.moving,
        "comes": bool(secondary and secondary.seen),  # is there only while it is shifted
        "unit": "rad" if of_attitude(region.shape) else "m",  # of its clearance
        "shape": shape_of(region.shape),
    }


def _words(rule: str) -> str:
    condition, conclusion = rule.removeprefix("if ").split(" then ")
    for symbol, plain in ((" is ", " "), ("_", " "), ("alpha ", "α")):
        condition, conclusion = condition.replace(symbol, plain), conclusion.replace(symbol, plain)
    return f"{condition} → {conclusion}"


def _vehicle(vehicle: Vehicle) -> dict[str, Any]:
    """Return the vehicle as it is drawn: a hull of its size where the file tells one, arrows at its thrusters.

    A vehicle's file has no places of thrusters, but the wrench of each: an arrow stands at the point of its line of
    action that is nearest to the body origin.
    """
    radius = vehicle.hull_radius or (0.75 * vehicle.buoyancy / (_SEA_WATER * np.pi)) ** (1.0 / 3.0)
    thrusters = []
    for i, (line, least, most) in enumerate(
        zip(thruster_lines(vehicle), vehicle.thrust_min, vehicle.thrust_max, strict=True)
    ):
        thrusters.append(
            {
                "name": str(i + 1),
                "position": [float(x) for x in line.nearest],
                "direction": [float(x) for x in line.force],
                "min": float(least),
                "max": float(most),
            }
        )
    return {"name": vehicle.name, "title": vehicle.title, "radius": float(radius), "thrusters": thrusters}
