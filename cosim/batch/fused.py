"""Flights by the fused loop: the vehicle's FMU, stepped in C with the functions of the master."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller import LAWS
from controller.allocation import Allocation
from controller.regions import pack
from cosim.batch.flight_config import (
    LOSSES,
    PLANT_OUTPUTS,
    SENSOR_OUTPUTS,
    Allocator,
    Array,
    FlightConfig,
    FlightMetrics,
    find_bound,
    make_workspace,
)
from cosim.batch.fused_loop import fly_law
from cosim.batch.outcome import OUTCOME, BatchResult, empty_outcomes
from cosim.batch.variation import Variation
from cosim.errors import RunError, ScenarioError
from cosim.results.spans import SETTLED_FOR
from cosim.scenario.law_factory import law_of, require_builtin_law
from cosim.scenario.scenario import Scenario
from cosim.scenario.sensor_suite import outage_schedule, scenario_sensors, sensor_model
from cosim.scenario.start_values import start_values
from cosim.simulation.arbiter_inputs import pack_inputs
from cosim.simulation.environment import shape_center, stay_steps
from cosim.simulation.sensor import STREAM
from fuzzy_arbiter import Arbiter
from plant_fmu import Plant, PlantError
from plant_fmu.running.native import Native

_ROUNDING = 1e-6  # tolerance of times, as a part of a step, as in the master
_NO_CLOCK = np.empty(0, np.int64)
_NO_ALLOCATION = Allocator(np.zeros((1, 0, 6)), np.zeros((1, 0)), np.zeros((1, 0)), False)


class FusedFlyer:
    """Flies variations of a scenario one after the other, with one plant that is reset before each."""

    def __init__(self, variation: Variation) -> None:
        self.variation = variation
        base = variation.base
        require_fused(base)
        for key, (_, expected) in _fixed_keys(base).items():
            if key in variation.keys:
                raise RunError(f"{key} varies, expected {expected!r} for flights without a record")
        require_builtin_law(base)
        self._plant = Plant(base.vehicle)

    def fly(self, values: Array, seeds: NDArray[np.int64]) -> BatchResult:
        """Fly a batch; values (rows, keys), seeds (rows,)."""
        outcomes, refused = empty_outcomes(len(seeds)), {}
        for row, (row_values, seed) in enumerate(zip(values, seeds, strict=True)):
            try:
                scenario = self.variation.scenario(row_values.tolist(), int(seed))
                outcomes[row] = self.fly_one(scenario)[0]
            except (ScenarioError, PlantError) as error:
                refused[row] = str(error)
        return BatchResult(outcomes, refused)

    def fly_one(self, scenario: Scenario, trace: bool = False) -> tuple[NDArray[np.void], Array]:
        """Fly one scenario of the variation; returns ()."""
        metrics, setup, native, estimate, rows = fly_scenario(self._plant, scenario, trace)
        return _outcome(metrics, setup, native, estimate), rows

    def close(self) -> None:
        """Free the plant. May be called twice."""
        self._plant.close()

    def __enter__(self) -> FusedFlyer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def require_fused(scenario: Scenario, what: str = "flights without a record") -> None:
    """Raise `RunError` for the first key of a scenario that the fused loop does not support; `what` needs the loop."""
    for key, (received, expected) in _fixed_keys(scenario).items():
        if received != expected:
            way = f", such as by --set {key}={expected}" if isinstance(expected, str) else ""
            raise RunError(f"{key} is {received!r}, expected {expected!r} for {what}{way}")


def _fixed_keys(scenario: Scenario) -> dict[str, tuple[Any, Any]]:
    """Return the present and the required value of each key that has to have a fixed value."""
    return {
        "arbiter.engine": (scenario.arbiter.engine, Arbiter(system=scenario.rules.system).engine),
        "master.order": (scenario.master.order, "gauss-seidel"),
        "plant.fmi": (scenario.plant.fmi, 3),
        "commands.enabled": (scenario.commands.enabled, False),
    }


def fly_scenario(
    plant: Plant, scenario: Scenario, trace: bool = False, clock: NDArray[np.int64] = _NO_CLOCK
) -> tuple[FlightMetrics, FlightConfig, Native, Array, Array]:
    """Reset a plant, and fly a scenario with it; returns (4,)."""
    law = law_of(scenario)
    n, through = scenario.vehicle.n_thrusters, scenario.actuation.through == "thrusters"
    plant.reset()
    plant.set(start_values(scenario))
    plant.initialize()
    native = plant.native(*exchanged_variables(scenario))
    names = [f"thrust_effectiveness[{i + 1}]" for i in range(n)]
    effectiveness = plant.native(names, ())
    effectiveness.inputs[:] = [plant[name] for name in names] if scenario.failures else 1.0
    losses = plant.native(LOSSES, ())
    losses.inputs[:] = [plant[name] for name in LOSSES] if scenario.outages else 0.0
    setup = configure_flight(scenario, n if through else 0, clock)
    allocator = failure_stages(scenario, setup) if through else _NO_ALLOCATION
    decisions = -(-scenario.steps // scenario.control_every)
    criteria, rules = len(scenario.criteria), scenario.rules
    inputs = native.inputs.size
    rows = np.zeros((decisions, 17 + criteria + inputs + law.report.size) if trace else (0, 0))
    workspace = make_workspace(setup, criteria, inputs, n)
    metrics, estimate = fly_law(setup, native, effectiveness, losses, allocator, law, rules.system, workspace, rows)
    return metrics, setup, native, estimate, rows


def exchanged_variables(scenario: Scenario) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the plant's variables that the loop exchanges with it in each step."""
    if scenario.actuation.through == "thrusters":
        n = scenario.vehicle.n_thrusters
        inputs = tuple(f"thrust[{i + 1}]" for i in range(n))
        forces = (*(f"thruster_force[{i + 1}]" for i in range(n)), *(f"actuation.{axis}" for axis in "XYZ"))
    else:
        inputs = tuple(f"wrench.{axis}" for axis in "XYZKMN")
        forces = tuple(f"actuator.wrench.{axis}" for axis in "XYZ")  # states: they cost no evaluation
    sensed = SENSOR_OUTPUTS if scenario.sensing.through == "sensors" else ()
    return inputs, (*PLANT_OUTPUTS, *forces, *sensed)


def configure_flight(scenario: Scenario, thrusters: int, clock: NDArray[np.int64] = _NO_CLOCK) -> FlightConfig:
    """Make the configuration of a flight from a scenario."""
    sensing, step = scenario.sensing, scenario.time.step
    decisions = -(-scenario.steps // scenario.control_every)
    noise = np.zeros((0, 6))
    if sensing.through == "state" and not sensing.exact:
        deviation = np.repeat([sensing.position_noise, sensing.velocity_noise], 3)
        noise = deviation * np.random.default_rng([sensing.seed, STREAM]).standard_normal((decisions, 6))
    sensors = scenario_sensors(scenario)
    outages = outage_schedule(scenario.outages, sensors, step)
    failures = sorted(
        (math.ceil(f.time / step - _ROUNDING), f.thruster - 1, math.nan if f.stuck else f.effectiveness)
        for f in scenario.failures
    )
    return FlightConfig(
        goal=pack([scenario.goal_region]),
        regions=pack([secondary.region for secondary in scenario.regions]),
        criteria=np.array(scenario.criterion_places, np.int64),
        priorities=np.array([secondary.priority for secondary in scenario.regions]),
        inputs=pack_inputs(scenario.regions, scenario.criteria, scenario.rules, scenario.arbiter.ramp),
        step=step,
        steps=scenario.steps,
        control_every=scenario.control_every,
        arbiter_every=scenario.arbiter_every,
        moving=bool(scenario.moving),
        goal_places=(np.reshape(scenario.goal_then, (-1, 3)) - shape_center(scenario.goal)).astype(float),
        goal_stay=stay_steps(scenario),
        exact=sensing.exact,
        noise=noise,
        dead_from=sensing.dead_from,
        dead_until=sensing.dead_from + sensing.dead_for,
        frozen=sensing.frozen,
        through_sensors=sensing.through == "sensors",
        sensors=sensor_model(sensors),
        outage_steps=np.array([step for step, _, _ in outages], np.int64),
        outage_sensors=np.array([sensor for _, sensor, _ in outages], np.int64),
        outage_losses=np.array([loss for _, _, loss in outages]),
        failed=np.array([thruster for _, thruster, _ in failures], np.int64),
        failure_steps=np.array([at for at, _, _ in failures], np.int64),
        remaining=np.array([remaining for _, _, remaining in failures]),
        report_failures=scenario.report_failures,
        thrusters=thrusters,
        bound=find_bound(LAWS[scenario.law.name].diagnostics),
        clock=clock,
    )


def failure_stages(scenario: Scenario, setup: FlightConfig) -> Allocator:
    """Return the arguments of the allocation for each number of reported failures."""
    vehicle, limits = scenario.vehicle, scenario.actuation.limits
    health, stages = np.ones(vehicle.n_thrusters), []
    total = setup.failed[~(setup.remaining > 0.0)]
    for failed in (None, *total) if setup.report_failures else (None,):
        if failed is not None:
            health[failed] = 0.0
        lower, upper = vehicle.thrust_min * health, vehicle.thrust_max * health
        stages.append(Allocation(vehicle.thruster_matrix, lower, upper, limits).arguments)
    inverse, lower, upper, direction = zip(*stages, strict=True)
    return Allocator(np.array(inverse), np.array(lower), np.array(upper), direction[0])


def _outcome(metrics: FlightMetrics, setup: FlightConfig, native: Native, estimate: Array) -> NDArray[np.void]:
    def when(step: float) -> float:
        return step * setup.step if step >= 0 else math.nan

    stopped = metrics.failed_step >= 0
    last = metrics.failed_step if stopped else setup.steps
    stayed = (last - metrics.last_entered) * setup.step if metrics.inside else 0.0
    fields = {
        "reached": metrics.first_inside >= 0,
        "reach_time": when(metrics.first_inside),
        "settled": metrics.inside and stayed >= SETTLED_FOR,
        "settle_time": when(metrics.last_entered),
        "violated": metrics.least_clearance < 0.0 or metrics.least_angle < 0.0,
        "min_clearance": metrics.least_clearance,
        "weighted_violation": metrics.weighted_violation,
        "closest_to_goal": -metrics.goal_clearance if metrics.goal_clearance > -math.inf else math.nan,
        "effort": metrics.effort,
        "max_force": metrics.max_force,
        "max_speed": metrics.max_speed,
        **{f"final_{axis}": native.outputs[i] for i, axis in enumerate("xyz")},
        **{f"phi{i + 1}": estimate[i] for i in range(4)},
        "stopped_at": when(metrics.failed_step),
    }
    return np.array(tuple(fields[name] for name in OUTCOME.names or ()), OUTCOME)
