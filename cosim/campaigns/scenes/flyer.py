"""A scored scene, flown by a law, with the FMU of each vehicle loaded once for many."""

from __future__ import annotations

import math
from types import TracebackType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller import LAWS
from cosim.batch.c_calls import Clock
from cosim.batch.flight_config import FlightMetrics
from cosim.batch.fused import fly_scenario
from cosim.campaigns.scenes.as_scenario import VEHICLE, scene_scenario
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.scenario_scene import AnyScene
from cosim.errors import RunError
from cosim.scenario.scenario import Scenario
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu import Plant
from plant_fmu.vehicle import Vehicle, load_vehicle

_LEVEL = (1.0, 0.0, 0.0, 0.0)
_ROUNDING = 1e-9  # of a count of steps


class Score(NamedTuple):
    """What the flight of a scene came to."""

    reached: bool  # inside the goal region for the last `Conditions.settled` seconds
    reach_time: float  # s, since when it was inside without a break; inf if it is outside at the end
    min_clearance: float  # m, least over all hard regions, the start and all plant steps; negative: violated
    effort: float  # N s, sum over thrusters of the integral of the given force's magnitude
    thrust_variation: float  # N, sum over thrusters of the changes of the commanded force, from 0 on
    worst_step: float  # s of the wall clock, the longest that law and allocation took
    failed_step: int  # plant step that the FMU refused, -1 for none
    bound_excess: float = -math.inf  # m, by which a clearance was below the law's bound, greatest; -inf: it gives none
    weighted_violation: float = 0.0  # m s, integral of how deep each region is violated, times its priority, summed


class SceneFlyer:
    r"""One law and one plant, for scene after scene.

    Parameters
    ----------
    law : str
        One of those in `controller.LAWS`.
    conditions : Conditions
        The same for all scenes.
    gains : NamedTuple, optional
        Of the law; default: its own defaults.

    Raises
    ------
    RunError
        If there is no such law.
    LawError
        If it cannot work with the gains.
    BuildError, PlantError
        If there is no FMU of the vehicle.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> _ = Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    >>> flyer = cosim.SceneFlyer("pd")
    >>> for scene in cosim.read_scenes(Path("scenes.jsonl")):
    ...     score, _ = flyer.fly(scene)
    >>> flyer.close()
    >>> score.reached
    True
    """

    def __init__(self, law: str, conditions: Conditions | None = None, gains: Any = None) -> None:
        if law not in LAWS:
            raise RunError(f"law is {law!r}, expected one of {', '.join(sorted(LAWS))}")
        self.law = law
        self.conditions = conditions or Conditions()
        self.gains = LAWS[law].gains_type() if gains is None else gains
        vehicle = load_vehicle(VEHICLE)
        model, level = vehicle_model(vehicle), np.array(_LEVEL)
        LAWS[law].for_vehicle(model, self.gains, level, self.conditions.control, 0)  # says now what it cannot work with
        self._clock = Clock()
        self._plants = {VEHICLE: Plant(vehicle)}

    def fly(self, scene: AnyScene, trace: bool = False) -> tuple[Score, NDArray[np.float64]]:
        """Fly one scene.

        Parameters
        ----------
        scene : Scene or ScenarioScene
            With all that the plant needs.
        trace : bool
            Whether to keep what happened, see `cosim.batch.flight_config`.

        Returns
        -------
        Score, ndarray
            What it came to, and the trace, shape (0, 0) if none is kept.

        Raises
        ------
        ScenarioError, PlantError
            If the plant cannot be as the scene has it. The flyer can go on with another scene.
        BuildError
            If there is no FMU of its vehicle.
        """
        scenario = scene_scenario(scene, self.law, self.gains, self.conditions)
        plant = self._plant(scenario.vehicle)
        metrics, _, _, _, rows = fly_scenario(plant, scenario, trace, self._clock.numbers)
        return self._score(metrics, scenario), rows

    def _plant(self, vehicle: Vehicle) -> Plant:
        if vehicle.name not in self._plants:
            self._plants[vehicle.name] = Plant(vehicle)
        return self._plants[vehicle.name]

    def _score(self, metrics: FlightMetrics, scenario: Scenario) -> Score:
        inside, since, step = metrics.inside and metrics.failed_step < 0, metrics.last_entered, scenario.time.step
        return Score(
            reached=inside and scenario.steps - since >= math.ceil(self.conditions.settled / step - _ROUNDING),
            reach_time=since * step if inside else math.inf,
            min_clearance=metrics.least_clearance,
            effort=metrics.thrust_effort,
            thrust_variation=metrics.thrust_variation,
            worst_step=metrics.worst_step,
            failed_step=int(metrics.failed_step),
            bound_excess=metrics.bound_excess,
            weighted_violation=metrics.weighted_violation,
        )

    def close(self) -> None:
        """Free the plant. May be called twice."""
        for plant in self._plants.values():
            plant.close()

    def __enter__(self) -> SceneFlyer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
