"""The data of an interactive page: the WebAssembly, and the meaning of its numbers."""

from __future__ import annotations

import base64
import dataclasses
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace

from controller.regions.region_set import shape_center
from cosim.errors import RunError
from cosim.io.strict_json import nan_to_none
from cosim.replay.interactive.adjustable import BUOYANCY, find_slots
from cosim.replay.interactive.flight import Flight
from cosim.replay.interactive.module import flight_module
from cosim.replay.interactive.scenario_template import scenario_template
from cosim.results.run_result import Run
from cosim.results.spans import SETTLED_FOR
from cosim.scenario.scenario import Scenario
from cosim.simulation.actuation_limits import failure_stages
from cosim.ssp.memory import Memory


def flight_data(run: Run) -> dict[str, Any]:
    """Return the data by which a page simulates a run again, with other numbers."""
    scenario = run.scenario
    if scenario.log:
        raise RunError(
            f"{run.folder}: is imported from {scenario.log}, expected a simulated run for an interactive replay"
        )
    made = flight_module(scenario)
    flight, memory = made.flight, made.memory
    slots, moves = find_slots(flight, memory)
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    data: dict[str, Any] = nan_to_none({
        "wasm": base64.b64encode(deflate.compress(made.binary) + deflate.flush()).decode(),
        "name": scenario.name,
        "title": scenario.title,
        "rows": len(flight.rows),
        "columns": flight.columns,  # index of each signal in a row
        "metrics": dict(zip(flight.metrics._fields, map(memory.keep, flight.metrics), strict=True)),
        "step": scenario.time.step,
        "every": scenario.control_every,
        "settled_for": SETTLED_FOR,
        "slots": [dataclasses.asdict(slot) for slot in slots],
        "moves": moves,
        "noise": [scenario.sensing.position_noise, scenario.sensing.velocity_noise],
        # centers of the goal's next places in the scenario [m, NED], and the key that moves each
        "places": [[list(leg.center), key] for leg, key in scenario.mission.next_stops],
        "goal_center": list(shape_center(scenario.goal)),
        "restoring": _restoring(scenario),
        "failures": _failures(flight, memory),
        "toml": scenario_template(scenario, slots),
    })  # fmt: skip
    return data


def _restoring(scenario: Scenario) -> dict[str, Any]:
    """Return the true restoring parameters (12) as a linear function of the buoyancy."""
    parameters, truth = scenario.plant.parameters, scenario.true_restoring_parameters
    lighter = parameters | {"buoyancy": parameters.get("buoyancy", scenario.vehicle.buoyancy) + 1.0}
    changed = dataclasses.replace(scenario, plant=replace(scenario.plant, parameters=lighter))
    slopes = changed.true_restoring_parameters - truth
    weight = parameters.get("weight", scenario.vehicle.weight)
    return {"key": BUOYANCY, "weight": weight, "truth": truth.tolist(), "slopes": slopes.tolist()}


def _failures(flight: Flight, memory: Memory) -> dict[str, Any] | None:
    """Return where thruster failures are; None where the wrench acts on the body itself."""
    model, allocator, m = flight.model, flight.data.allocator, flight.scenario.vehicle.n_thrusters
    if not model.through_thrusters:
        return None
    arrays = {name: getattr(model, name) for name in ("failed", "failure_steps", "remaining")}
    arrays |= {name: getattr(allocator, name) for name in ("inverse", "lower", "upper")}
    own = list(zip(model.failure_steps.tolist(), model.failed.tolist(), model.remaining.tolist(), strict=True))[:-1]
    allocates = model.report_failures and model.law_gives_wrench
    return {
        "thrusters": m,
        "offsets": {name: memory.keep(array) for name, array in arrays.items()},
        "own": own,
        "stages": [_stages_with(flight, thruster, own) for thruster in range(m)] if allocates else None,
    }


def _stages_with(flight: Flight, thruster: int, own: Sequence[tuple[int, int, float]]) -> list[dict[str, list[float]]]:
    """Return the allocator's arrays after 0, 1, … of the total failures of the scenario, if a thruster fails too."""
    failed = np.array([thruster, *(which for _, which, remaining in own if not remaining > 0.0)])
    model = flight.model._replace(failed=failed, remaining=np.zeros(failed.size))
    stages = failure_stages(flight.scenario, model)
    arrays = {"inverse": stages.inverse, "lower": stages.lower, "upper": stages.upper}
    return [{name: array[k].ravel().tolist() for name, array in arrays.items()} for k in range(1, 1 + failed.size)]
