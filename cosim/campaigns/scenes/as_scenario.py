"""Conversion of a scored scene to a scenario, which the fused loop and the master can fly."""

from __future__ import annotations

import math
from typing import Any

import msgspec

from controller.regions.region_set import name_of
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.law_gains import AnyLaw, label_of, law_table
from cosim.campaigns.scenes.scenario_scene import AnyScene, ScenarioScene
from cosim.campaigns.scenes.scene import Scene, plant_parameters, scene_regions
from cosim.campaigns.scenes.scene_tables import sphere_table
from cosim.scenario.scenario import Scenario, validate_scenario
from plant_fmu.vehicle import load_vehicle


def scene_scenario(scene: AnyScene, law: AnyLaw, gains: Any, conditions: Conditions) -> Scenario:
    """Convert a scene to a scenario."""
    name = f"{label_of(law)}-scene-{scene.seed}"
    if isinstance(scene, ScenarioScene):
        return scene.with_law(law_table(law, gains), name, _changes(scene, conditions))
    vehicle = load_vehicle(scene.vehicle)
    table = {
        "title": f"Scene {scene.seed}",
        "vehicle": scene.vehicle,
        "time": {
            "duration": conditions.controls * conditions.control,
            "step": conditions.plant_step,
            "control": conditions.control,
            "arbiter": conditions.control,
        },
        "plant": {
            "current": scene.current,
            "substep": conditions.plant_step,
            "parameters": plant_parameters(scene, vehicle),
        },
        "initial": {"position": scene.start},
        "goal": sphere_table(scene.goal.centre, scene.goal.radius),
        "law": law_table(law, gains),
        "arbiter": conditions.arbiter_table({"ramp": conditions.ramp}),
        "actuation": {"through": "thrusters"},
        "sensing": _sensing(scene, conditions),
        "outages": msgspec.to_builtins(conditions.outages),
        "failures": _failures(scene, conditions),
        "report_failures": conditions.report_failures,
        "regions": _regions(scene),
    }
    return validate_scenario(table, name, vehicle)


def _changes(scene: ScenarioScene, conditions: Conditions) -> dict[str, Any]:
    """Return the tables of a scenario that conditions change."""
    table = scene.scenario
    changes: dict[str, Any] = {"report_failures": conditions.report_failures}
    changes["arbiter"] = conditions.arbiter_table(table.get("arbiter", {}))
    if conditions.sensing == "sensors":
        changes["sensing"] = {"through": "sensors", "seed": scene.seed}
    if conditions.outages:
        changes["outages"] = [*table.get("outages", ()), *msgspec.to_builtins(conditions.outages)]
    return changes


def _sensing(scene: Scene, conditions: Conditions) -> dict[str, Any]:
    """Return the table ``sensing``: through sensors, noise is that of their data sheets, not of the scene."""
    sensing: dict[str, Any] = {
        "through": conditions.sensing,
        "seed": scene.seed if scene.noise.seed is None else scene.noise.seed,
    }
    if conditions.sensing == "state":
        sensing |= {"position_noise": scene.noise.position, "velocity_noise": scene.noise.velocity}
    return sensing


def _failures(scene: Scene, conditions: Conditions) -> list[dict[str, float]]:
    """Return the failed thruster, with its time rounded up to a control step."""
    if scene.failed_thruster is None:
        return []
    step = math.ceil(min(scene.failed_thruster.time, conditions.duration) / conditions.control)
    return [{"thruster": scene.failed_thruster.index, "time": step * conditions.control}]


def _regions(scene: Scene) -> list[dict[str, Any]]:
    """Return the regions for the law, as tables of a scenario."""
    return [
        {
            "name": region.name,
            "criterion": criterion,
            "keep": region.keep,
            "gain": region.gain,
            "velocity": region.velocity,
            "shape": {"type": name_of(region.shape), **msgspec.to_builtins(region.shape)},
        }
        for region, criterion in scene_regions(scene)
    ]
