"""Thrust findings: whether the thrusters can keep the vehicle still, and give the first force of the law."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from scipy.optimize import brentq

from controller import paper_law
from controller.driven_axes import PITCH, ROLL, join_axes, undriven_axes
from controller.force_limits import max_forces
from controller.laws.deployable.braking import max_upright_speed
from controller.paper_law import primary_error, secondary_error
from controller.quaternion import error, rotation_matrix
from controller.regions.region_set import evaluate_at_pose
from cosim.precheck.finding import Finding, status
from cosim.precheck.thrust_margin import Margin, ThrustMargin, held_wrench, least_margins, thrust_margin
from cosim.results.wording import format_force
from cosim.scenario.scenario import Scenario
from cosim.scenario.true_vehicle import true_vehicle
from cosim.scenario.vehicle_model import vehicle_model
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle

_ROUNDING = 1e-6  # N, a force up to which nothing counts as left


def thrust_findings(scenario: Scenario) -> Iterator[Finding]:
    """Yield the findings on thrust left beside station keeping in the current, with all thrusters and with one lost."""
    vehicle, phi = true_vehicle(scenario), scenario.true_restoring_parameters
    quaternion, current = np.array(scenario.law.desired_quaternion), np.array(scenario.plant.current)
    margin = thrust_margin(vehicle, phi, quaternion, current)
    trim = f", a trim of {force:.3g} N" if (force := float(np.linalg.norm(vehicle.trim[:3]))) else ""
    against = f"the current's drag of {margin.drag:.3g} N{trim} and a net weight of {margin.excess_weight:.3g} N"
    yield from _undriven_finding(scenario, vehicle)
    numbers: dict[str, float | str | None] = {
        "drag": margin.drag, "excess_weight": margin.excess_weight,
        "thrust": _force(margin.thrust), "left": _force(margin.left),
        "worst": margin.left.direction if margin.left else None,
    }  # fmt: skip
    if margin.thrust and margin.left and margin.left.force > _ROUNDING:
        text = (
            f"In the worst of 26 directions, {margin.left.direction}, {margin.left.force:.3g} N are left beside "
            f"{against}, the attitude kept; in still water and weightless it is {margin.thrust.force:.3g} N."
        )
        yield Finding("thrust", "holding still", "holds", text, numbers=numbers)
    else:
        text = f"The thrusters cannot hold the vehicle still, attitude kept, against {against}."
        yield Finding("thrust", "holding still", "fails", text, _mend_current(scenario), numbers)
        return
    yield _with_one_lost(margin)


def _undriven_finding(scenario: Scenario, vehicle: Vehicle) -> Iterator[Finding]:
    """Yield a finding if the thrusters do not drive all axes, or none of the vehicle's moments rights it."""
    left = undriven_axes(vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max)
    if scenario.actuation.through != "thrusters" or not left:
        return
    righting, names = vehicle.righting_moment, join_axes(left)
    full = np.abs(vehicle.thruster_matrix[left]) @ np.maximum(-vehicle.thrust_min, vehicle.thrust_max)
    lean = float(full.max()) / righting if righting > 0.0 else math.inf
    text = f"The thrusters do not drive {names}: a righting moment of {righting:.3g} N m is left to hold it"
    tilt = f"by at most {math.degrees(math.asin(lean)):.0f}°" if lean < 1.0 else "over"
    speed = ""
    if scenario.law.name == "deployable":
        tilt_limit = scenario.law.gains.tilt
        limit = max_upright_speed(vehicle_model(scenario.vehicle), tilt_limit)
        speed = f" The law keeps below {math.degrees(tilt_limit):.0f}°, at up to {limit:.2g} m/s through the water."
    holds = righting > 0.0 and {ROLL, PITCH} >= set(left)
    advice = "Put the center of buoyancy (plant.parameters.r_B.z) above the center of gravity, or add thrusters."
    yield Finding(
        "thrust", "undriven axes", status(holds), f"{text}, which all thrusters at full force tilt {tilt}.{speed}",
        "" if holds else advice, {"righting_moment": righting},
    )  # fmt: skip


def _with_one_lost(margin: ThrustMargin) -> Finding:
    lost = [i + 1 for i, left in enumerate(margin.left_without) if left is None]
    numbers = {f"left_without[{i + 1}]": _force(left) for i, left in enumerate(margin.left_without)}
    if lost:
        text = f"Without thruster {', '.join(map(str, lost))} the vehicle can no longer hold still, attitude kept."
        return Finding("thrust", "one thruster lost", "note", text, numbers=numbers)
    worst = min(range(len(margin.left_without)), key=lambda i: numbers[f"left_without[{i + 1}]"] or 0.0)
    left = margin.left_without[worst]
    assert left is not None
    text = f"With any one thruster lost at least {left.force:.3g} N are left (thruster {worst + 1}, {left.direction})."
    return Finding("thrust", "one thruster lost", "holds" if left.force > 0.0 else "note", text, numbers=numbers)


def _force(margin: Margin | None) -> float | None:
    return margin.force if margin else None


def _mend_current(scenario: Scenario) -> str:
    """Return advice on the maximum current in which the vehicle can be kept still."""
    vehicle, phi = true_vehicle(scenario), scenario.true_restoring_parameters
    quaternion, current = np.array(scenario.law.desired_quaternion), np.array(scenario.plant.current)

    def reach(fraction: float) -> float:
        hold = held_wrench(vehicle, phi, quaternion, fraction * current)
        (left,) = least_margins(vehicle, quaternion, hold, np.ones((1, vehicle.n_thrusters)))
        return left.force - _ROUNDING if left else -1.0

    if reach(0.0) <= 0.0:
        return "Trim the vehicle (plant.parameters.buoyancy, weight, r_G, r_B) or choose a level desired attitude."
    fraction = brentq(reach, 0.0, 1.0, xtol=0.01)
    return f"Take a current of at most {fraction * float(np.linalg.norm(current)):.2g} m/s, or stronger thrusters."


def initial_force_finding(scenario: Scenario, weights: Array) -> Finding:
    """Compare the first force of the paper's law with the maximum force of the thrusters in that direction."""
    gains, initial, vehicle = scenario.law.gains, scenario.initial, true_vehicle(scenario)
    (f,), (slope,), _ = evaluate_at_pose([scenario.goal_region], initial.position, initial.quaternion)
    regions = [secondary.region for secondary in scenario.regions]
    values, gradients, _ = evaluate_at_pose(regions, initial.position, initial.quaternion)
    betas = np.array([region.gain for region in regions]) * weights / gains.k_q
    quaternion, desired = np.array(initial.quaternion), np.array(scenario.law.desired_quaternion)
    R, e_att = rotation_matrix(quaternion), error(desired, quaternion)[1:]
    e_p, e_s = primary_error(float(f), slope), secondary_error(values, gradients, betas)
    tau, velocity = np.empty(6), np.array(initial.velocity)
    paper_law.apply(e_p, e_s, e_att, R, velocity, gains, 0.0, np.zeros(4), tau)
    force = tau[:3]
    required = float(np.linalg.norm(force))
    if not required > 0.0:
        text = "The law asks for no force at the start."
        return Finding("thrust", "initial force", "holds", text, numbers={"asked": 0.0})
    along = force[None] / required
    (available,) = np.nan_to_num(max_forces(vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max, along))
    text = (
        f"The law asks for {format_force(required)} at the start; "
        f"the thrusters give at most {format_force(available)} that way."
    )
    if scenario.actuation.through == "wrench":
        limit = f"at most {format_force(scenario.limit.force)}" if scenario.limit.force < np.inf else "no limit"
        text += f" In this scenario the wrench acts on the body directly, with {limit}."
    advice = ""
    if required > available:
        # nearly all of it is attraction to the goal, which is proportional to k_p1
        k_p1 = gains.k_p1 * available / required
        advice = f"Lower law.gains.k_p1 to about {k_p1:.2g}, start nearer, or take a law with a bounded attraction."
    return Finding(
        "thrust", "initial force", status(required <= available), text, advice,
        {"asked": required, "given": float(available)},
    )  # fmt: skip
