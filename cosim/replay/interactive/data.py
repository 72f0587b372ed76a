"""The data of an interactive page: the WebAssembly, and the meaning of its numbers."""

from __future__ import annotations

import base64
import dataclasses
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from cosim.errors import RunError
from cosim.io.strict_json import nan_to_none
from cosim.replay.interactive.adjustable import BUOYANCY, changed_scenario, find_slots
from cosim.replay.interactive.flight import Flight
from cosim.replay.interactive.module import flight_module
from cosim.replay.interactive.scenario_template import scenario_template
from cosim.replay.interactive.signals import signal_sources
from cosim.results.run_result import Run
from cosim.results.spans import SETTLED_FOR
from cosim.scenario.scenario import Scenario
from cosim.simulation.environment import shape_center
from cosim.simulation.signals import Array, Column
from cosim.ssp.memory import Memory
from plant_fmu.variables import variables


def flight_data(run: Run, columns: Sequence[Column]) -> dict[str, Any]:
    """Return the data by which a page simulates a run again, with other numbers."""
    scenario = run.scenario
    if scenario.log:
        raise RunError(
            f"{run.folder}: is imported from {scenario.log}, expected a run that was simulated for a page that flies"
        )
    made = flight_module(scenario)
    flight, memory = made.flight, made.memory
    slots, moves = find_slots(flight, memory)
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    template = scenario_template(scenario, slots)
    regions = [scenario.goal_velocity, *(secondary.region.velocity for secondary in scenario.regions)]
    data: dict[str, Any] = nan_to_none({
        "wasm": base64.b64encode(deflate.compress(made.binary) + deflate.flush()).decode(),
        "name": scenario.name,
        "title": scenario.title,
        "rows": len(flight.trace),
        "widths": {
            "trace": flight.trace.shape[1],
            "reasons": flight.reasons.shape[1],
            "rules": len(scenario.rules.system.rules),
        },
        "metrics": [memory.keep(flight.metrics), flight.metrics.size],
        "place": 11 + len(scenario.regions) + len(scenario.criteria) + flight.workspace.signals.inputs.size,
        "step": scenario.time.step,
        "every": scenario.control_every,
        "settled_for": SETTLED_FOR,
        "slots": [dataclasses.asdict(slot) for slot in slots],
        "moves": moves,
        "noise": [scenario.sensing.position_noise, scenario.sensing.velocity_noise],
        "signals": signal_sources(flight, columns),
        "velocities": [list(velocity) for velocity in regions],
        "goals": len(scenario.goal_then),  # places of the goal after the first
        "goal_center": list(shape_center(scenario.goal)),
        "water": _water(flight, run),
        "criteria": list(scenario.criterion_places),
        "restoring": _restoring(flight),
        "failures": _failures(flight, memory),
        "toml": dataclasses.asdict(template),
    })  # fmt: skip
    return data


def _restoring(flight: Flight) -> dict[str, Any]:
    """Return the true restoring parameters (12) as a linear function of the buoyancy."""
    scenario = flight.scenario
    truth, truth_above = (
        s.true_restoring_parameters
        for s in (scenario, changed_scenario(scenario, {BUOYANCY: _buoyancy(scenario) + 1.0}))
    )
    weight = scenario.plant.parameters.get("weight", scenario.vehicle.weight)
    return {"key": BUOYANCY, "weight": weight, "truth": truth.tolist(), "slopes": (truth_above - truth).tolist()}


def _water(flight: Flight, run: Run) -> dict[str, Any]:
    """Return the current at the surface, its growth with depth, and its variation at knots a period apart."""
    # The variation follows from the seed alone, so that it is the recorded one whatever a page changes.
    start = {v.name: v.start for v in variables(flight.scenario.vehicle)} | flight.start
    surface, shear, deviation = (
        np.array([start[f"{name}.{axis}"] for axis in "xyz"])
        for name in ("current", "current_shear", "current_variation")
    )
    names, period, variation = [f"water_velocity.{axis}" for axis in "xyz"], start["current_variation_period"], []
    if deviation.any() and len(run.record) > 1 and all(name in run.record.units for name in names):
        time, below = run.record["time"], np.maximum(run.record["position.z"], 0.0)[:, None]
        values = run.record.stack(names) - surface - shear * below
        ahead = values[-1] + (values[-1] - values[-2]) * (period / (time[-1] - time[-2]))  # to the knot after the end
        time, values = np.append(time, time[-1] + period), np.vstack([values, ahead])
        knots = np.arange(0.0, time[-1], period)
        variation = np.column_stack([np.interp(knots, time, of) for of in values.T]).round(6).tolist()
    return {"surface": surface.tolist(), "shear": shear.tolist(), "period": period, "variation": variation}


def _buoyancy(scenario: Scenario) -> float:
    return float(scenario.plant.parameters.get("buoyancy", scenario.vehicle.buoyancy))


def _failures(flight: Flight, memory: Memory) -> dict[str, Any] | None:
    """Return the places of thruster failures; None where the wrench acts on the body itself."""
    setup, allocator = flight.setup, flight.allocator
    if not setup.thrusters:
        return None

    def places(array: Array) -> list[int]:
        return [memory.keep(array), *array.shape]

    own = zip(setup.failure_steps, setup.failed, setup.remaining, strict=True)
    return {
        "failed": memory.keep(setup.failed),
        "steps": memory.keep(setup.failure_steps),
        "remaining": memory.keep(setup.remaining),
        "own": [[int(step), int(thruster), float(left)] for step, thruster, left in own if step >= 0],
        "reported": bool(setup.report_failures),
        "lower": places(allocator.lower),
        "upper": places(allocator.upper),
        "limits": [np.asarray(side[0]).tolist() for side in (allocator.lower, allocator.upper)],
    }
