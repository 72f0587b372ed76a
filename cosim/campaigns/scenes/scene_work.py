"""Scenes as the work of a campaign: a row for each scene, in order of seed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from controller import LawError
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import SceneFlyer
from cosim.campaigns.scenes.law_gains import AnyLaw, digest_of_law
from cosim.campaigns.scenes.scene_file import SceneStore, decode_scene
from cosim.campaigns.scenes.scene_rows import SCHEMA, refused_row, row_of, table_of
from cosim.campaigns.store.plan import SCENES, code_digest, versions
from cosim.campaigns.workers.work import Rows, Work
from cosim.errors import ScenarioError
from plant_fmu import PlantError


@dataclass(frozen=True)
class SceneTask:
    """The data that all scenes of a campaign share."""

    law: AnyLaw
    gains: Any  # NamedTuple of the law's gains_type
    conditions: Conditions

    def flyer(self) -> SceneBatches:
        """Create a flyer."""
        return SceneBatches(self)

    def plan(self, scenes: int) -> dict[str, Any]:
        """Return all inputs that determine the rows of a number of scenes, but the scenes themselves."""
        conditions = msgspec.to_builtins(self.conditions)
        return {
            "kind": SCENES,
            "law": str(self.law),
            "gains": self.gains._asdict(),
            **digest_of_law(self.law),
            "conditions": conditions | {"outages": list(conditions["outages"])},  # as JSON is read
            "scenes": scenes,
            "code_sha256": code_digest(),
            "versions": versions(),
        }


class SceneBatches:
    """Flies scenes, given as lines, one after the other."""

    def __init__(self, task: SceneTask) -> None:
        self._flyer = SceneFlyer(task.law, task.conditions, task.gains)
        self.close = self._flyer.close

    def fly(self, batch: list[bytes]) -> Any:
        """Return a table with a row for each line; a scene that the plant refuses has a row with the reason."""
        rows = []
        for line in batch:
            scene, text = decode_scene(line), line.decode().strip()
            try:
                score, _ = self._flyer.fly(scene)
            except (PlantError, ScenarioError, LawError) as error:
                rows.append(refused_row(scene.seed, str(error), text))
            else:
                rows.append(row_of(scene.seed, score, self._flyer.conditions.plant_step, text))
        return table_of(rows)


class SceneWork(Work):
    """The scenes of a store, flown by one law."""

    unit, schema = "scene", SCHEMA

    def __init__(self, store: SceneStore, task: SceneTask) -> None:
        self.name, self.task = str(task.law), task
        self.plan = {**task.plan(len(store)), "scenes_sha256": store.digest}
        self._store = store
        self._seeds = np.array(store.seeds, dtype=np.int64)

    def __len__(self) -> int:
        return len(self._seeds)

    def batch(self, rows: Rows) -> list[bytes]:
        """Return the JSON lines of some rows."""
        return self._store.lines(self._seeds[rows].tolist())

    def rows_of(self, keys: Rows) -> Rows:
        """Return the rows of some seeds; -1 for an unknown seed."""
        rows = np.minimum(np.searchsorted(self._seeds, keys), len(self._seeds) - 1)
        return np.where(self._seeds[rows] == keys, rows, -1)

    def refused_table(self, row: int, reason: str) -> Any:
        """Return the table of one scene that could not be flown."""
        (line,) = self.batch(np.array([row]))
        return table_of([refused_row(int(self._seeds[row]), reason, line.decode().strip())])
