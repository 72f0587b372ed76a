"""Properties 1-3 of the vehicle, and the gain conditions of the paper's law with the part of space where they hold."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from controller import VehicleState
from controller.compiling.function import BoundCall
from controller.paper_law import Gains, primary_error
from controller.regions import Region, Sphere, pack
from controller.regions.region_set import evaluate_at_pose
from controller.theory import (
    Fit,
    Model,
    damping_fit,
    error_jacobian_bound,
    gain_fits,
    greatest_gradient,
    potential_fits,
    secondary_fit,
    sphere_radii,
)
from controller.theory.conditions import least_of_potential_test
from controller.theory.equations_of_motion import asymmetry, damping, least_inertia, restoring_defect, skew_defect
from cosim.precheck.finding import Finding, status
from cosim.scenario.scenario import Scenario
from cosim.scenario.true_vehicle import true_model, true_vehicle
from cosim.simulation.signals import Array
from cosim.step.arbiter_inputs import compute_inputs, empty_signals, pack_inputs
from fuzzy_arbiter import Arbiter

_ROUNDING = 1e-9  # tolerance of defects, as a part of the greatest element
_SAMPLES = 50  # velocities and attitudes at which a property is checked
_LEVEL = (1.0, 0.0, 0.0, 0.0)  # a goal does not depend on attitude
_STEP = 1e-4  # m, for the central differences of e_p


def vehicle_findings(scenario: Scenario) -> Iterator[Finding]:
    """Yield the findings on Properties 1-3 of the true vehicle, and on its restoring forces, linear in phi (12)."""
    vehicle, model = true_vehicle(scenario), true_model(scenario)
    rng = np.random.default_rng(1)
    velocities, quaternions = rng.normal(size=(_SAMPLES, 6)), rng.normal(size=(_SAMPLES, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]

    min_eigenvalue, lopsided = least_inertia(model.mass), asymmetry(model.mass)
    yield Finding(
        "vehicle", "Property 1", status(min_eigenvalue > 0.0 and lopsided < _ROUNDING),
        f"M is symmetric and positive definite: least eigenvalue {min_eigenvalue:.4g}, asymmetry {lopsided:.1g}.",
        numbers={"least_eigenvalue": min_eigenvalue, "asymmetry": lopsided},
    )  # fmt: skip
    defect = max(skew_defect(model.mass, nu) for nu in velocities)
    yield Finding(
        "vehicle", "Property 2", status(defect < _ROUNDING),
        f"dM/dt - 2 C is skew-symmetric at {_SAMPLES} velocities, to {defect:.1g} of its greatest element.",
        numbers={"defect": defect},
    )  # fmt: skip
    yield _damping(model, velocities)
    defect = max(restoring_defect(vehicle.weight, vehicle.buoyancy, vehicle.r_G, vehicle.r_B, q) for q in quaternions)
    largest = max(vehicle.weight, vehicle.buoyancy, 1.0)
    yield Finding(
        "vehicle", "(12)", status(defect < _ROUNDING * largest),
        f"Restoring forces are Z phi at {_SAMPLES} attitudes, to {defect:.1g} N or N m.",
        numbers={"defect": defect},
    )  # fmt: skip


def _damping(model: Model, velocities: Array) -> Finding:
    at_rest = float(model.linear_damping.min())
    moving = min(float(damping(model.linear_damping, model.quadratic_damping, nu).min()) for nu in velocities)
    numbers = {"least_at_rest": at_rest, "least_moving": moving}
    if at_rest > 0.0:
        text = f"D is positive definite: least eigenvalue {at_rest:.4g} at rest, and more when moving."
        return Finding("vehicle", "Property 3", "holds", text, numbers=numbers)
    if at_rest == 0.0 and moving > 0.0:
        text = (
            "D is positive definite only where every velocity is other than 0: at rest its least eigenvalue is 0 "
            "(no linear drag). What (45) needs then has to come from K_v alone."
        )
        return Finding("vehicle", "Property 3", "note", text, numbers=numbers)
    text = f"D is not positive definite: least eigenvalue {at_rest:.4g} at rest, {moving:.4g} when moving."
    advice = "Give the vehicle drag along and about every axis (hydrodynamics.*_damping)."
    return Finding("vehicle", "Property 3", "fails", text, advice, numbers)


def start_weights(scenario: Scenario) -> Array:
    """Return the weight of each secondary region in the master's first step, shape (n,)."""
    initial = scenario.initial
    secondary = [r.region for r in scenario.regions]
    clearances = evaluate_at_pose(secondary, initial.position, initial.quaternion)[2]
    position, quaternion, velocity = map(np.array, (initial.position, initial.quaternion, initial.velocity))
    state = VehicleState(position, quaternion, velocity, np.ones(scenario.vehicle.n_thrusters))
    packed = pack_inputs(scenario.regions, scenario.criteria, scenario.rules, scenario.arbiter.ramp)
    signals = empty_signals(packed, len(secondary), len(scenario.criteria))
    goal, regions = pack([scenario.goal_region]), pack(secondary)
    BoundCall(compute_inputs, (packed, goal, regions, state, 0.0, clearances, signals)).call()
    weights = Arbiter(scenario.rules.system, engine=scenario.arbiter.engine)(signals.inputs.tolist())
    return np.array(weights)[list(scenario.criterion_places)]


@dataclass(frozen=True)
class _Start:
    """Numbers at the start on which the conditions of the paper's law depend."""

    scenario: Scenario
    model: Model
    gains: Gains
    value: float  # f of the goal
    slope: float  # |df/dp| of the goal
    radii: tuple[float, float, float] | None  # m, within which conditions hold, of a sphere as goal

    @property
    def position(self) -> Array:
        return np.array(self.scenario.initial.position)

    def or_start_within(self, radius: int) -> str:
        """Return the end of an advice: to start nearer to the goal, if it is known how near."""
        return f", or start within {self.radii[radius]:.2f} m." if self.radii else "."

    @property
    def distance(self) -> str:
        """Text that says how far from the center of a sphere the start is."""
        assert isinstance(self.scenario.goal, Sphere)
        return f"the start is {math.dist(self.scenario.initial.position, self.scenario.goal.center):.2f} m away."


def gain_findings(scenario: Scenario, weights: Array) -> Iterator[Finding]:
    """Yield the findings on (38) and (45) at the start, and on where else they hold, for the paper's law."""
    gains: Gains = scenario.law.gains
    model, goal = true_model(scenario), scenario.goal
    value, gradient = _value_and_gradient(scenario.goal_region, np.array(scenario.initial.position))
    radii = None
    if isinstance(goal, Sphere):
        radii = sphere_radii(model.mass, model.linear_damping, goal.radius, gains)
    start = _Start(scenario, model, gains, value, float(np.linalg.norm(gradient)), radii)
    yield _potential(start)
    yield _secondary(start, weights)
    yield _damped(start)
    second, third = gain_fits(gains)
    yield Finding(
        "law", "(45) 2, 3", status(second.holds and third.holds),
        f"Least eigenvalue of J K_0 is {second.have:.4g} > 0; k_q exceeds it by {third.have - third.need:.4g}.",
        "" if second.holds and third.holds else f"Raise law.gains.k_q above {third.need:.4g}; k_p1 and k_p2 above 0.",
        {"least_k_0": second.have, "k_q": third.have},
    )  # fmt: skip


def _potential(start: _Start) -> Finding:
    mass, gains, slope = start.model.mass, start.gains, start.slope
    min_eigenvalue = least_of_potential_test(mass, slope, gains) if slope else math.inf
    limit = greatest_gradient(mass, gains)
    first, second = potential_fits(mass, slope, gains)
    where = f"Holds where |df/dp| < {limit:.4g}" + (
        f", within {start.radii[0]:.2f} m of the goal's center; {start.distance}"
        if start.radii
        else f"; at the start it is {slope:.4g}."
    )
    scalar = "" if second.holds else (
        f" With the scalar lambda_m as printed the condition on attitude fails too ({_pair(second)}); "
        "it takes the mass for an inertia."
    )  # fmt: skip
    text = f"P - sigma M sigma has the least eigenvalue {min_eigenvalue:.4g} at the start ({_pair(first)} in position)."
    return Finding(
        "law", "(38) 1, 2", status(min_eigenvalue > 0.0), f"{text} {where}{scalar}",
        "" if min_eigenvalue > 0.0 else _lower_sigma(start),
        {
            "least_eigenvalue": min_eigenvalue, "position_have": first.have, "position_need": first.need,
            "attitude_have": second.have, "attitude_need_scalar": second.need, "greatest_gradient": limit,
            "gradient_at_start": slope, "radius": start.radii[0] if start.radii else None,
        },
    )  # fmt: skip


def _lower_sigma(start: _Start) -> str:
    """Return advice on sigma_p, or on sigma_a where the condition fails in attitude."""
    if sigma := _max_sigma(start, start.gains, "sigma_p"):
        return f"Lower law.gains.sigma_p to {_below(sigma)}" + start.or_start_within(0)
    if sigma := _max_sigma(start, start.gains._replace(sigma_p=0.0), "sigma_a"):
        return f"Lower law.gains.sigma_a to {_below(sigma)}: the condition fails in attitude, everywhere."
    return "Raise law.gains.k_p1 and k_p2 above 0."


def _secondary(start: _Start, weights: Array) -> Finding:
    scenario, gains, mass = start.scenario, start.gains, start.model.mass
    regions = [secondary.region for secondary in scenario.regions]
    values, gradients, _ = evaluate_at_pose(regions, scenario.initial.position, scenario.initial.quaternion)
    alphas = np.array([region.gain for region in regions]) * weights
    active = (values > 0.0) & (alphas > 0.0)
    fit = secondary_fit(mass, np.linalg.norm(gradients[active], axis=1), alphas[active] / gains.k_q, gains)
    names = ", ".join(region.name for region, on in zip(regions, active, strict=True) if on)
    at_start = f"Active at the start: {names} ({_pair(fit)})." if names else "No region is active at the start."
    limits = {}
    for region in regions:  # alone and with weight 1: bound of its gradient
        if region.gain > 0.0:
            one = secondary_fit(mass, np.ones(1), np.array([region.gain / gains.k_q]), gains)
            limits[region.name] = math.sqrt(one.have / one.need) if one.need else math.inf
    where = "; ".join(f"{name} {limit:.3g}" for name, limit in limits.items())
    return Finding(
        "law", "(38) 3", status(fit.holds),
        at_start + (f" Alone and fully weighted a region keeps it while |dg/dp| is below: {where}." if where else ""),
        "" if fit.holds else "Lower law.gains.sigma_p, or the regions' gains.",
        {"have": fit.have, "need": fit.need, **{f"greatest_gradient.{name}": x for name, x in limits.items()}},
    )  # fmt: skip


def _damped(start: _Start) -> Finding:
    model, gains, goal, radii = start.model, start.gains, start.scenario.goal_region, start.radii
    steps = _STEP * np.eye(3)
    jacobian = np.column_stack([_error(goal, start.position + h) - _error(goal, start.position - h) for h in steps]) / (
        2.0 * _STEP
    )
    bound = max(0.0, error_jacobian_bound(jacobian))
    fit, translation = (
        damping_fit(model.mass, model.linear_damping, bound, gains, translation_alone=alone) for alone in (False, True)
    )
    text = (
        f"At the start lambda_min[D] + lambda_min[K_v] = {fit.have:.4g} ({translation.have:.4g} for translation alone) "
        f"against sigma c_0, of which the term with de_p/dt alone is {fit.need:.4g}."
    )
    if radii:
        text += (
            f" From that term it can hold within {radii[1]:.2f} m ({radii[2]:.2f} m) of the goal's center; "
            f"{start.distance}"
        )
    advice = ""
    if not fit.holds:
        sigma = _below(gains.sigma_p * fit.have / fit.need)
        advice = f"Lower law.gains.sigma_p to {sigma}{start.or_start_within(1)}"
    return Finding(
        "law", "(45) 1", status(fit.holds), text, advice,
        {
            "have": fit.have, "have_translation": translation.have, "need": fit.need, "f_at_start": start.value,
            "radius": radii[1] if radii else None, "radius_translation": radii[2] if radii else None,
        },
    )  # fmt: skip


def _value_and_gradient(goal: Region, position: Array) -> tuple[float, Array]:
    (value,), (gradient,), _ = evaluate_at_pose([goal], position, _LEVEL)
    return float(value), gradient


def _error(goal: Region, position: Array) -> Array:
    return primary_error(*_value_and_gradient(goal, position))


def _max_sigma(start: _Start, gains: Gains, name: str) -> float | None:
    """Return the value of a sigma up to which (38) 1, 2 holds, None if it fails at 0 already."""

    def margin(sigma: float) -> float:
        return least_of_potential_test(start.model.mass, start.slope, gains._replace(**{name: sigma}))

    if margin(0.0) <= 0.0:
        return None
    upper = 1e-6
    while margin(upper) > 0.0:
        upper *= 10.0
    return float(brentq(margin, 0.0, upper))


def _below(bound: float) -> str:
    """Format a bound, rounded down to three digits."""
    if bound <= 0.0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(bound)) - 2)
    return f"{math.floor(bound / unit) * unit:.3g}"


def _pair(fit: Fit) -> str:
    return f"{fit.have:.3g} {'>' if fit.holds else '<='} {fit.need:.3g}"
