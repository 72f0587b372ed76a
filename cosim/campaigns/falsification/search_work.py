"""The rows of a search, which are created when the search requests them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from cosim.campaigns.campaign import run_campaign
from cosim.campaigns.falsification.search import import_cma
from cosim.campaigns.falsification.spaces import FAMILIES, SceneSpace
from cosim.campaigns.falsification.splitting import MIN_BUDGET
from cosim.campaigns.parameter_sweep import run_sweep
from cosim.campaigns.scenes.generator import generate_scenes
from cosim.campaigns.scenes.scene_rows import SCHEMA, refused_row, table_of
from cosim.campaigns.scenes.scene_work import SceneTask
from cosim.campaigns.store.results import Results
from cosim.campaigns.sweeps.design import Design, Vary
from cosim.campaigns.sweeps.sweep_rows import SweepBatch, SweepWork
from cosim.campaigns.workers.work import Rows, Work
from cosim.errors import RunError
from cosim.scenario.law_factory import OwnLaw
from cosim.scenario.scenario import Scenario
from plant_fmu.archive import temporary_folder
from plant_fmu.toml_tables import hint

Objective = Literal["clearance", "violation", "arrival"]
OBJECTIVES: tuple[Objective, ...] = get_args(Objective)
_LIMIT = 3.0  # standard deviations of a normal number within which a search stays
_MAX_BUDGET = 1_000_000  # maximum number of rows


@dataclass(frozen=True)
class SearchSettings:
    """Objective and budget of a search."""

    # outcome to be found: ``"clearance"``, the least one; ``"violation"``, the greatest one weighted by priority;
    # ``"arrival"``, the latest one, where no arrival is the worst
    objective: Objective = "clearance"
    budget: int = 2000  # number of rows
    seed: int = 0  # seed of the search
    rare_event: bool = False  # true to estimate the probability of a violation, instead of a search for the worst row

    def __post_init__(self) -> None:
        if self.objective not in OBJECTIVES:
            raise RunError(f"objective {self.objective!r} is unknown; {hint(self.objective, OBJECTIVES)}")
        min_budget = MIN_BUDGET if self.rare_event else 1
        if not min_budget <= self.budget <= _MAX_BUDGET:
            raise RunError(f"budget is {self.budget}, expected {min_budget} to {_MAX_BUDGET} flights")
        if not 0 <= self.seed < 2**31:
            raise RunError(f"seed is {self.seed}, expected a whole number from 0 to 2^31 - 1")
        if self.rare_event and self.objective != "clearance":
            raise RunError(f"objective is {self.objective}, expected clearance: the rare event is a violation")

    def table(self) -> dict[str, Any]:
        """Return the settings and the version of cma, for JSON; raise RunError if cma is needed and not installed."""
        return asdict(self) | ({} if self.rare_event else {"cma": import_cma().__version__})


class SceneSearch(Work):
    """A search for the worst scenes of a family of the generator."""

    unit, schema = "scene", SCHEMA

    def __init__(self, family: str, task: SceneTask, settings: SearchSettings) -> None:
        if family not in FAMILIES:
            raise RunError(f"family {family!r} is unknown; {hint(family, FAMILIES)}")
        self._space = SceneSpace(family, None if settings.rare_event else _LIMIT)
        self.dimension, self.horizon = self._space.dimension, task.conditions.duration
        self.family, self.name, self.settings = family, str(task.law), settings
        self.task = self._task = task
        self.law = task.law
        self.title = f"The {task.law} law on {family} scenes"
        self.plan = task.plan(settings.budget) | {"search": {"family": family, **settings.table()}}
        self._lines: list[bytes] = []

    def __len__(self) -> int:
        return self.settings.budget

    def add(self, points: NDArray[np.float64]) -> Rows:
        """Add a row for each point, shape (n, dimension), and return their numbers."""
        first = len(self._lines)
        self._lines += [self._space.line(point, first + i) for i, point in enumerate(points)]
        return np.arange(first, len(self._lines))

    def batch(self, rows: Rows) -> list[bytes]:
        """Return the scenes of some rows, as lines of JSON."""
        return [self._lines[row] for row in rows]

    def refused_table(self, row: int, reason: str) -> Any:
        """Return the table of one scene that could not be flown."""
        return table_of([refused_row(row, reason, self._lines[row].decode().strip())])

    def fly_random(self, out: Path, workers: int, progress: bool) -> Results:
        """Fly random scenes of the generator, as many as the budget."""
        with temporary_folder("falsify-") as folder:
            scenes, task = folder / "scenes.jsonl", self._task
            scenes.write_text("\n".join(generate_scenes(len(self), self.settings.seed, self.family)))
            return run_campaign(scenes, task.law, out, task.conditions, task.gains, workers, progress=progress).results


class ScenarioSearch(SweepWork):
    """A search for the worst values of some keys of a scenario."""

    def __init__(
        self, scenario: Scenario, vary: Sequence[Vary], settings: SearchSettings, law: OwnLaw | None = None
    ) -> None:
        super().__init__(scenario, Design(tuple(vary), "random", settings.budget, settings.seed), law)
        self.plan = {**self.plan, "search": settings.table()}
        self.settings, self._scenario, self.title, self.law = settings, scenario, scenario.title, law
        self.dimension, self.horizon = len(vary), scenario.time.duration
        self._values = np.empty((0, self.dimension))

    def add(self, points: NDArray[np.float64]) -> Rows:
        """Add a row for each point, shape (n, dimension), and return their numbers."""
        first = len(self._values)
        values = [vary.at(points[:, i]) for i, vary in enumerate(self.design.vary)]
        self._values = np.concatenate([self._values, np.column_stack(values)])
        return np.arange(first, len(self._values))

    def batch(self, rows: Rows) -> SweepBatch:
        """Return values and seeds of some rows."""
        return SweepBatch(rows, self._values[rows], self.design.seeds(rows))

    def fly_random(self, out: Path, workers: int, progress: bool) -> Results:
        """Fly rows with uniformly drawn values, as many as the budget."""
        how: Any = {"law": self.law, "workers": workers, "progress": progress}
        return run_sweep(self._scenario, self.design, out, **how).results
