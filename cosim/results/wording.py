"""Sentences about a run: its task and its outcome."""

from __future__ import annotations

import math
from typing import Any

from controller.regions.region_set import SHAPES
from controller.regions.shape import Shape
from cosim.scenario.scenario import Scenario

IMPORTED = "imported"  # status of a run that was imported from a log
DRY_RUN = "dry run"  # status of a companion's run that sent nothing
_MAX_LISTED = 6  # maximum number of isolations that a sentence lists
_SAME_DRAG = (0.6, 1.7)  # estimated drags, relative to the file, between which a sentence leaves them out
_FEW_REJECTED = 0.005  # fraction of rejected samples below which a sentence leaves them out


def format_force(force: float) -> str:
    """Format a force [N] with four digits, such as ``26.82 kN``."""
    if not math.isfinite(force):
        return "no number"
    return f"{force / 1e3:.4g} kN" if force >= 1e3 else f"{force:.4g} N"


def describe_task(scenario: Scenario) -> str:
    """Describe the task of the vehicle in a sentence."""
    if not scenario.has_goal:
        return f"Imported from {scenario.log}, which has no goal and no regions to judge it by."
    start = ", ".join(f"{x:g}" for x in scenario.initial.position)
    regions = [
        f"{'within' if r.region.keep == 'in' else 'out of'} {r.region.name} ({r.criterion})" for r in scenario.regions
    ]
    respecting = f", keeping {', '.join(regions)}" if regions else ""
    kind = shape_name(scenario.goal)
    center = [sum(pair) / 2.0 for pair in zip(*scenario.goal.bounds(), strict=True)]
    at = f" about ({', '.join(f'{x:g}' for x in center)}) m" if all(map(math.isfinite, center)) else ""
    then = f", then to {len(scenario.goal_then)} more places in turn" if scenario.goal_then else ""
    by = f"{scenario.law.name} law" if not scenario.log else f"imported from {scenario.log}"
    return f"From ({start}) m into the goal region, a {kind}{at}{then}{respecting}; {by}."


def shape_name(shape: Shape) -> str:
    """Return the name of a shape, such as ``depth band``."""
    return next(name for name, of in SHAPES.items() if isinstance(shape, of)).replace("_", " ")


def format_number(value: float, digits: int) -> str:
    """Format a number for readers."""
    if not math.isfinite(value):
        return "no number"
    if abs(value) >= 10.0**digits:
        return f"{value:,.0f}".replace(",", " ").replace("-", "−")
    return f"{value:.{digits}g}".replace("-", "−")


def verdict(summary: dict[str, Any]) -> str:
    """Describe the outcome of a run in a few sentences."""
    if not summary["has_goal"]:
        return f"A log of {summary['simulated_time']:.1f} s, without goal and regions.{_commanded_force(summary)}"
    if summary["settled"]:
        entered, settled = summary["reach_time"], summary["settle_time"]
        stayed = "and stayed" if settled == entered else f"and stayed inside from {settled:.2f} s"
        goal = f"The vehicle entered the goal region at {entered:.2f} s {stayed}"
    elif summary["reached"]:
        goal = f"The vehicle entered the goal region at {summary['reach_time']:.2f} s but did not settle there"
    else:
        near, goals = summary["closest_to_goal"], summary.get("goals")
        how_near = f"it came within {near:.2f} m of it" if math.isfinite(near) else "how near it came is not recorded"
        goal = f"The vehicle never entered the goal region; {how_near}"
        if goals and goals["reached"] < goals["of"] - 1:  # the last goal, which counts, was not yet active
            goal = f"The vehicle reached {goals['reached']} of {goals['of']} goals in turn"
    violated = [_violation(summary, name) for name, c in summary["min_clearance"].items() if c < 0.0]
    regions = "; it kept every region."
    if violated:
        but = "" if summary["hard_violated"] or not summary["hard"] else "kept every hard region but "
        regions = f"; it {but}violated {', '.join(violated)}."
    if summary["status"] == IMPORTED:
        return f"{goal}{regions}{_commanded_force(summary)}"
    commanded, acted = format_force(summary["max_force_asked"]), format_force(summary["max_force"])
    force = f" The law asked for up to {commanded}" + ("." if commanded == acted else f"; up to {acted} acted.")
    if not math.isfinite(summary["max_force"]):
        force = f" The law asked for up to {commanded}; what acted was not measured."
    ending = {
        "completed": "",
        DRY_RUN: " It was a dry run: nothing was sent.",
        "interrupted": f" The run was interrupted at {summary['simulated_time']:.3f} s.",
        "reset": f" The run was reset at {summary['simulated_time']:.3f} s.",
        "killed": f" The run was killed; its record ends at {summary['simulated_time']:.3f} s.",
    }.get(summary["status"], f" The run {summary['status']}.")
    commands = summary.get("commands", 0)
    steering = f" It received {commands} command{'s' if commands > 1 else ''} on the way." if commands else ""
    laws = _above_surface(summary) + force + _law_reports(summary)
    miss = f" {summary['goal_miss']}" if summary["goal_miss"] else ""
    return goal + regions + laws + steering + ending + miss


def isolation_text(thruster: int, isolated: bool) -> str:
    """Describe that the law isolates a thruster, or uses it again."""
    return f"The law isolates thruster {thruster}" if isolated else f"The law uses thruster {thruster} again"


def format_isolations(summary: dict[str, Any]) -> str:
    """List the thrusters that the law isolated and when, such as ``3 at 12.30 s (pitch undriven)``; empty for none."""
    isolations = [
        f"{one['thruster']} at {one['time']:.2f} s"
        + (f" ({' and '.join(one['undriven'])} undriven)" if one.get("undriven") else "")
        for one in summary["isolations"]
    ]
    more = f" and {len(isolations) - _MAX_LISTED} more" if len(isolations) > _MAX_LISTED else ""
    return ", ".join(isolations[:_MAX_LISTED]) + more


def _law_reports(summary: dict[str, Any]) -> str:
    """Describe isolated thrusters, rejected samples, and a drag unlike the file's."""
    isolated, rejected = format_isolations(summary), summary["rejected_samples"] or 0.0
    text = f" It isolated thruster {isolated}." if isolated else ""
    if rejected >= _FEW_REJECTED:
        text += f" It rejected {rejected:.0%} of the position and velocity samples."
    ratio = summary["drag_ratio"]
    if ratio and not _SAME_DRAG[0] < ratio < _SAME_DRAG[1]:
        text += f" The vehicle is not that of the file: the law estimates {ratio:.2g} times its drag."
    return text


def _above_surface(summary: dict[str, Any]) -> str:
    """Describe what of a run was above the water surface, where the plant does not hold."""
    parts = [*summary["above_surface"]]
    if summary["time_above_surface"] > 0.0:
        share = 100.0 * summary["time_above_surface"] / summary["simulated_time"]
        parts.append(f"the vehicle for {max(1.0, share):.0f} % of the time")
    if not parts:
        return ""
    return f" Above the water surface (z < 0; z points down), where the simulation does not hold: {', '.join(parts)}."


def _commanded_force(summary: dict[str, Any]) -> str:
    """Describe the forces that the commands of a log ask for."""
    force = summary["max_force_asked"]
    if not math.isfinite(force):
        return " It has no commands."
    return f" Its commands ask for forces of up to {format_force(force)}."


def _violation(summary: dict[str, Any], name: str) -> str:
    """Describe how deep a region was violated."""
    remarks = ["soft"] if name not in summary["hard"] else []
    remarks += ["where it starts"] if name in summary["violated_at_start"] else []
    depth, unit = -summary["min_clearance"][name], summary["clearance_unit"][name]
    depth, unit, digits = (math.degrees(depth), "°", 1) if unit == "rad" else (depth, " m", 3)
    return f"{name} by {depth:.{digits}f}{unit}" + (f" ({', '.join(remarks)})" if remarks else "")
