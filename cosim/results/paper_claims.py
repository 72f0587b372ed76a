"""The paper's claims beside the results of a run, and reasons for differences."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from controller.regions import Sphere
from cosim.results.wording import format_force
from cosim.scenario.scenario import Scenario

PAPER_WINDOW = (2.65, 2.95)  # s, "An intersection of the secondary sub-regions occurs at 2.65 s to 2.95 s"


@dataclass(frozen=True)
class Claim:
    """A statement of the paper beside the result of a run."""

    statement: str
    result: str
    reason: str  # why both differ or agree


def paper_claims(scenario: Scenario, summary: dict[str, Any]) -> list[Claim]:
    """Return the paper's claims beside the results of this run."""
    return [
        _convergence(summary),
        _intersection(scenario, summary),
        _avoidance(scenario, summary),
        _arbitration(summary),
        _effort(scenario, summary),
        _adaptation(summary),
    ]


def _convergence(summary: dict[str, Any]) -> Claim:
    if summary["settled"]:
        result = f"In at {summary['reach_time']:.2f} s, inside from {summary['settle_time']:.2f} s."
        reason = "Agrees that the region is reached; the paper gives no time."
    elif summary["reached"]:
        result = f"In at {summary['reach_time']:.2f} s, but not inside for the last 10 s."
        reason = "The run ends, or the vehicle leaves, before it has settled."
    else:
        result = f"Never in; closest {summary['closest_to_goal']:.2f} m from the region's surface."
        reason = "See the estimate below: adaptation (27) goes on while the actuators give less than the law asks for."
        if summary["saturated_time"] == 0.0:
            reason = f"The actuators were never saturated; the run is {summary['simulated_time']:g} s long."
    return Claim("The vehicle converges into the primary sub-region (Fig. 5, 6).", result, reason)


def _intersection(scenario: Scenario, summary: dict[str, Any]) -> Claim:
    windows = summary["intersection_windows"]
    names = " and ".join(summary["intersection"])
    result = (
        ", ".join(f"{a:.3f} s to {b:.3f} s" for a, b in windows) + f" inside {names}."
        if windows
        else f"Never inside {names}."
    )
    statement = f"The regions' intersection is crossed at {PAPER_WINDOW[0]} s to {PAPER_WINDOW[1]} s (Fig. 8)."
    if not windows:
        return Claim(statement, result, f"In {summary['simulated_time']:g} s the path did not meet the overlap.")
    first = windows[0]
    limits = (
        [f"a body force of at most {format_force(scenario.limit.force)}"] if scenario.limit.force < math.inf else []
    )
    limits += [f"a lag of {scenario.limit.time_constant:g} s"] if scenario.limit.time_constant > 0.0 else []
    limits += ["the thrusters' limits"] if scenario.actuation.through == "thrusters" else []
    if limits:
        reason = (
            f"With {' and '.join(limits)}. "
            "The paper states no limits: these are a choice of this scenario, no evidence of what was simulated there."
        )
    else:
        reason = (
            f"Without a limit the law starts with {format_force(summary['max_force_asked'])} and the vehicle runs at "
            f"up to {summary['max_speed']:.1f} m/s. "
            "The paper's times need a limit on the actuators that it does not state."
        )
    if abs(first[0] - PAPER_WINDOW[0]) < 0.05 and abs(first[1] - PAPER_WINDOW[1]) < 0.05:
        reason = "Agrees. " + reason
    return Claim(statement, result, reason)


def _avoidance(scenario: Scenario, summary: dict[str, Any]) -> Claim:
    clearances = summary["min_clearance"]
    entered = [r for r in scenario.regions if clearances[r.region.name] < 0.0]
    later = [r for r in entered if r.region.name not in summary["violated_at_start"]]
    result = "; ".join(f"{name}: {c:+.3f} m" for name, c in clearances.items()) + " (negative: violated)."
    push = max(
        (r.region.gain * r.region.shape.radius**2 for r in later if isinstance(r.region.shape, Sphere)), default=None
    )
    if push is not None:
        reason = (
            f"A sphere pushes with at most gain × r² = {push:.0f} N; the law asked for up to "
            f"{format_force(summary['max_force_asked'])} in all. "
            "The paper's own Fig. 8 shows the vehicle inside the intersection."
        )
    elif later:
        reason = f"Entered: {', '.join(r.region.name for r in later)}."
    else:
        reason = "No region was entered" + (", but for those in which the run starts." if entered else ".")
    return Claim("The control effort leads the vehicle out of the undesired sub-regions (Fig. 5b).", result, reason)


def _arbitration(summary: dict[str, Any]) -> Claim:
    above = summary["weights_above_half"]
    return Claim(
        "Only a single α is high at a time.",
        f"At most {above} of the weights above ½ at once; their sum at most {summary['weights_sum_max']:.3f}.",
        "Holds as “at most one”: where no region matters, all three are low."
        if above <= 1
        else "Two weights above ½ contradict the rule base.",
    )


def _effort(scenario: Scenario, summary: dict[str, Any]) -> Claim:
    vehicle = scenario.vehicle
    limit = float(max(vehicle.thrust_max.max(), -vehicle.thrust_min.min()))
    return Claim(
        "Excessive control effort is avoided.",
        f"Asked for up to {format_force(summary['max_force_asked'])}; "
        f"acting up to {format_force(summary['max_force'])}.",
        f"One thruster of this vehicle gives {limit:g} N; f is a square: k_p1 f ∇f grows as the cube of the distance.",
    )


def _adaptation(summary: dict[str, Any]) -> Claim:
    final, true = summary["estimate_final"][0], summary["estimate_true"][0]
    low, high = summary["estimate_lowest"][0], summary["estimate_highest"][0]
    lever, true_lever = summary["estimate_final"][3], summary["estimate_true"][3]
    result = (
        f"φ̂1 between {low:.2f} and {high:.2f} N, at the end {final:.2f} N; true {true:.2f} N. "
        f"φ̂4 at the end {lever:.2f} N m; true {true_lever:.2f} N m."
    )
    if abs(final - true) < 1.0:
        reason = "φ̂1, weight less buoyancy, ends within 1 N of the truth."
    elif summary["saturated_time"] > 0.0:
        reason = (
            f"Winds up: the actuators were saturated for {summary['saturated_time']:.1f} s, "
            "in which (27) took the error for an unknown weight."
        )
    else:
        reason = "Has not converged to the truth; (27) promises only that the errors vanish."
    return Claim("The unknown restoring forces are compensated by adaptation.", result, reason)
