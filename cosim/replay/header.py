"""The header of a run for a view: regions, vehicle, rules and signals, as plain values for JSON."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from controller.regions.region_set import name_of, of_attitude, shape_center, shape_entry, surface_of
from controller.regions.shape import Bounds, Shape
from cosim.results.region_colors import colors_of_regions
from cosim.results.wording import describe_task
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import Mode
from cosim.simulation.signals import Column
from fuzzy_arbiter import System
from plant_fmu import Vehicle
from plant_fmu.thruster_lines import thruster_lines

VERSION = 1  # version of the header's format
_MIN_MARGIN = 5.0  # m, around start and bounded regions
_DIGITS = 6  # decimals of coordinates in m
_SEA_WATER = 1026.0 * 9.81  # N/m3; for the size of a hull without a radius in the vehicle's file


def header_of(scenario: Scenario, columns: Sequence[Column], commands: bool | list[Mode] = False) -> dict[str, Any]:
    """Return a run's header; `commands`: True if every command is accepted, False if none, or the modes that are."""
    limits, colors = limits_of(scenario), colors_of_regions(scenario)
    return {
        "version": VERSION,
        "name": scenario.name,
        "title": scenario.title,
        "task": describe_task(scenario),
        "law": scenario.law.name,
        "imported": scenario.log,
        "step": scenario.time.step,
        "duration": scenario.time.duration,
        "ramp": scenario.arbiter.ramp,
        "commands": commands,
        "through": scenario.actuation.through,
        "vehicle": _vehicle(scenario.vehicle),
        "criteria": [{"name": criterion.name, "color": criterion.color} for criterion in scenario.criteria],
        "regions": [_region(scenario, i, limits) | {"color": color} for i, color in enumerate(colors)],
        "rules": rules_of(scenario.rules.system),
        "truth": {"estimate": [float(phi) for phi in scenario.true_restoring_parameters]},
        "signals": [dataclasses.asdict(column) for column in columns],
    }


def rules_of(system: System) -> list[dict[str, str]]:
    """Return the rules of an arbiter: label, text, and a short form for a view."""
    return [
        {"label": f"R{i + 1}", "text": str(rule), "words": _words(str(rule))} for i, rule in enumerate(system.rules)
    ]


def shape_of(shape: Shape, limits: Bounds) -> dict[str, Any]:
    """Return a shape with its ``kind``, its own parameters [m, rad, NED], and its ``drawing``; limits [m, NED]."""
    # The drawing of a shape of position is its `center` and `half_axes`, or its `planes`, each with `point` and
    # `normal`, or the `points` and `faces` of its mesh. A shape of attitude has a `sight`, its cone, instead.
    kind = name_of(shape)
    known = {"kind": kind, **dataclasses.asdict(shape)}  # type: ignore[call-overload]
    cone = shape_entry(shape).cone
    return known | ({"sight": cone(shape)._asdict()} if cone else {"drawing": _drawing(shape, limits)})


def limits_of(scenario: Scenario) -> Bounds:
    """Return the corners of a box about the start and all bounded regions, with a border of its size, 5 m at least."""
    goal = [scenario.goal_region] if scenario.has_goal else []
    regions = [*goal, *(secondary.region for secondary in scenario.regions if not secondary.is_dynamic)]
    corners = [np.array(corner) for region in regions for corner in region.shape.bounds()]
    points = np.array([scenario.initial.position, *(corner for corner in corners if np.isfinite(corner).all())])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = max(_MIN_MARGIN, float((high - low).max()))
    return tuple((low - margin).tolist()), tuple((high + margin).tolist())


def _drawing(shape: Shape, limits: Bounds) -> dict[str, Any]:
    entry = shape_entry(shape)
    if entry.half_axes is not None:
        center, axes = entry.half_axes(shape)
        return {"center": center.tolist(), "half_axes": axes.tolist()}
    if entry.planes is not None:
        return {"planes": [{"point": p.tolist(), "normal": n.tolist()} for p, n in entry.planes(shape)]}
    mesh = surface_of(shape, limits)
    return {"points": np.round(mesh.vertices, _DIGITS).tolist(), "faces": mesh.triangles.tolist()}


def _region(scenario: Scenario, index: int, limits: Bounds) -> dict[str, Any]:
    secondary = scenario.regions[index - 1] if index else None
    region = secondary.region if secondary else scenario.goal_region
    return {
        "name": region.name,
        "criterion": secondary.criterion if secondary else None,
        "keep": region.keep,
        "hard": region.hard,
        "gain": region.gain,
        "moves": region.name in scenario.moving,
        # present only while it is shifted; never, for the missing goal of a log
        "is_dynamic": secondary.is_dynamic if secondary else not scenario.has_goal,
        "unit": "rad" if of_attitude(region.shape) else "m",  # of its clearance
        "shape": shape_of(region.shape, limits),
        **({} if secondary or not scenario.goal_then else _goal_places(scenario)),
    }


def _goal_places(scenario: Scenario) -> dict[str, Any]:
    """Return the shifts of the goal to each of its places in turn [m, NED], and their names."""
    center = shape_center(scenario.goal)
    shifts = [[0.0] * 3, *(np.subtract(place, center).tolist() for place in scenario.goal_then)]
    return {"places": shifts, "stops": scenario.mission.stops}


def _words(rule: str) -> str:
    condition, conclusion = rule.removeprefix("if ").split(" then ")
    for symbol, plain in ((" is ", " "), ("_", " "), ("alpha ", "α")):
        condition, conclusion = condition.replace(symbol, plain), conclusion.replace(symbol, plain)
    return f"{condition} → {conclusion}"


def _vehicle(vehicle: Vehicle) -> dict[str, Any]:
    """Return the vehicle's drawing: a hull by its radius, or else by its buoyancy, and arrows at its thrusters."""
    # A vehicle's file has the wrench of each thruster, but no position: an arrow is at the point of its line of action
    # that is nearest to the body origin.
    radius = vehicle.hull_radius or (0.75 * vehicle.buoyancy / (_SEA_WATER * np.pi)) ** (1.0 / 3.0)
    thrusters = zip(thruster_lines(vehicle), vehicle.thrust_min.tolist(), vehicle.thrust_max.tolist(), strict=True)
    return {
        "name": vehicle.name,
        "title": vehicle.title,
        "hull": vehicle.hull_shape,
        "radius": float(radius),
        "thrusters": [
            {
                "name": str(i),
                "position": line.nearest.tolist(),
                "direction": line.force.tolist(),
                "min": low,
                "max": high,
            }
            for i, (line, low, high) in enumerate(thrusters, 1)
        ],
    }
