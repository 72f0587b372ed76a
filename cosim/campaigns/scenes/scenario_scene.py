"""A scene that is a whole scenario without a law: with its own vehicle, criteria and priorities."""

from __future__ import annotations

import copy
from typing import Any

from controller import ControllerError
from cosim.batch.fused import require_fused
from cosim.campaigns.scenes.scene import Scene, Seed
from cosim.errors import RunError, ScenarioError
from cosim.scenario.scenario import Scenario, validate_scenario
from plant_fmu import PlantFmuError
from plant_fmu.toml_tables import Table

_MAX_LENGTH = 60  # maximum number of characters of a kind
_ANY_LAW = {"name": "pd"}  # takes all that a scene may ask for


class ScenarioScene(Table, frozen=True):
    """One scene of a file."""

    seed: Seed
    kind: str  # name under which scenes are summarized together
    scenario: dict[str, Any]  # table of the scenario, without a law

    def with_law(self, law: dict[str, Any], name: str, changes: dict[str, Any]) -> Scenario:
        """Make the scenario with the table of a law, a name, and replaced tables."""
        table = copy.deepcopy(self.scenario) | {"law": law} | changes
        try:
            return validate_scenario(table, name)
        except (PlantFmuError, ControllerError) as error:
            raise ScenarioError(str(error)) from error


AnyScene = Scene | ScenarioScene


def check_scenario_scene(scene: ScenarioScene) -> None:
    """Raise `ScenarioError` at the first invalid key, for any law."""
    if not (0 < len(scene.kind) <= _MAX_LENGTH and scene.kind.isprintable()):
        raise ScenarioError(f"kind is {scene.kind!r}, expected up to {_MAX_LENGTH} printable characters")
    table = scene.scenario
    if "law" in table:
        raise ScenarioError("scenario.law is given, expected none: the campaign says by which law it is flown")
    if str(table.get("vehicle", "")).endswith(".toml"):
        raise ScenarioError(f"scenario.vehicle is {table['vehicle']!r}, expected one that is shipped")
    arbiter = table.get("arbiter")
    if isinstance(arbiter, dict) and arbiter.get("file") and not arbiter.get("text"):
        raise ScenarioError("scenario.arbiter.text is missing, expected that of arbiter.file")
    try:
        require_fused(scene.with_law(_ANY_LAW, "scene", {}))
    except RunError as error:
        raise ScenarioError(f"scenario.{error}") from error
