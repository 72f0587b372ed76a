"""Flies and scores scenes with a law; the FMU of each vehicle is loaded once."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from controller import Law
from cosim.batch.fused import FlownVehicle
from cosim.batch.outcome import Arrivals, arrivals_of
from cosim.campaigns.scenes.as_scenario import scene_scenario
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.law_gains import fmu_table, gains_from, law_class, to_law
from cosim.campaigns.scenes.scenario_scene import AnyScene
from cosim.campaigns.scenes.scene import ODIN
from cosim.results.file_copies import fmus_of
from cosim.results.record import Rows
from cosim.scenario.law_factory import OwnLaw
from cosim.scenario.scenario import Scenario
from cosim.scenario.true_vehicle import true_vehicle
from cosim.scenario.vehicle_model import vehicle_model
from cosim.step.plant_calls import Clock
from cosim.step.score import FlightMetrics
from plant_fmu.build import cached_fmu
from plant_fmu.vehicle import load_vehicle

_LEVEL = (1.0, 0.0, 0.0, 0.0)  # attitude without rotation, from body to world
_ROUNDING = 1e-9  # tolerance of a count of steps
_HALF = 0.5  # fraction of the least true limit of a thruster below which an estimated one is too low


class Score(NamedTuple):
    """Score of the flight of a scene."""

    reached: bool  # inside the goal region for the last `Conditions.settled` seconds
    reach_time: float  # s, beginning of the last stay inside; inf if outside at the end
    min_clearance: float  # m, least over all hard regions and plant steps, with the start; negative: violated
    effort: float  # N s, sum over thrusters of the integral of the given force's magnitude
    thrust_variation: float  # N, sum over thrusters of the absolute changes of the commanded force, from 0 on
    worst_step: float  # s, wall-clock time: longest time of law and allocation in a step
    failed_step: int  # plant step in which the FMU failed, -1 for none
    bound_excess: float = -math.inf  # m, maximum excess of the law's bound over a clearance; -inf: it has no bound
    weighted_violation: float = 0.0  # m s, sum over regions of priority times the integral of the violation depth
    bound_promised: float = math.nan  # fraction of its steps in which the law gave a bound; NaN: it has none
    healthy_weakened: bool = False  # a healthy thruster was isolated, or its limit lowered below half its true one
    arrivals: Arrivals = ()  # s, first time within the goal at each of its places; None: never


def _least_limit(scenario: Scenario) -> float:
    """Return the least true limit of a thruster, as a fraction of that in the vehicle's file."""
    vehicle, true = scenario.vehicle, true_vehicle(scenario)
    limits = np.array([vehicle.thrust_min, vehicle.thrust_max])
    used = limits != 0.0  # a thruster of one direction has no limit in the other
    return float(np.min(np.array([true.thrust_min, true.thrust_max])[used] / limits[used]))


class SceneFlyer:
    r"""Flies scenes one after the other with one law.

    Parameters
    ----------
    law : str or Law
        Name of the law, a key of `controller.LAWS`; the file of an FMU; ``"file.py:name"``; or a law, such as a
        `FunctionLaw`, of which each flight has a copy.
    conditions : Conditions
        Conditions of all flights.
    gains : NamedTuple, optional
        Gains of the law; default: its own defaults.

    Raises
    ------
    RunError
        If there is no such law.
    LawError
        If the law refuses the gains.
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

    def __init__(self, law: str | Law | OwnLaw, conditions: Conditions | None = None, gains: Any = None) -> None:
        self.law = to_law(law)
        self.conditions = conditions or Conditions()
        self.gains = gains_from(self.law) if gains is None else gains
        vehicle = load_vehicle(ODIN)
        if isinstance(self.law, str) and fmu_table(self.law) is None:
            model, level = vehicle_model(vehicle), np.array(_LEVEL)
            # refuses invalid gains
            law_class(self.law).for_vehicle(model, self.gains, level, self.conditions.control, 0)
        cached_fmu(vehicle, 3)  # raises an error if there is none
        self._clock = Clock()
        self._vehicles: dict[tuple[str, ...], FlownVehicle] = {}  # by vehicle and other FMUs

    def fly(self, scene: AnyScene, trace: bool = False) -> tuple[Score, Rows]:
        """Fly one scene.

        Parameters
        ----------
        scene : Scene or ScenarioScene
            Scene to fly.
        trace : bool
            True to return a trace.

        Returns
        -------
        Score, Rows
            Score of the flight, and its signals by name, such as ``trace["position.x"]``.

        Raises
        ------
        ScenarioError, PlantError, LawError
            If the plant, or a custom law, refuses the scene. The flyer can then fly another one.
        BuildError
            If there is no FMU of its vehicle.
        """
        scenario = scene_scenario(scene, self.law, self.gains, self.conditions)
        own = self.law.make(scenario) if isinstance(self.law, OwnLaw) else None
        metrics, _, data, signals = self._vehicle(scenario).fly(scenario, trace, self._clock.numbers, own)
        return self._score(metrics, scenario)._replace(arrivals=arrivals_of(data.arrivals)), signals

    def _vehicle(self, scenario: Scenario) -> FlownVehicle:
        fmus = (str(fmu._replace(parameters={})) for fmu in fmus_of(scenario))
        key = (scenario.vehicle.name, *fmus)
        if key not in self._vehicles:
            self._vehicles[key] = FlownVehicle(scenario)
        return self._vehicles[key]

    def _score(self, metrics: FlightMetrics, scenario: Scenario) -> Score:
        inside, since, step = metrics.inside > 0.0 and metrics.failed_step < 0, metrics.last_entered, scenario.time.step
        return Score(
            reached=bool(inside and scenario.steps - since >= math.ceil(self.conditions.settled / step - _ROUNDING)),
            reach_time=float(since * step) if inside else math.inf,
            min_clearance=float(metrics.min_clearance),
            effort=float(metrics.thrust_effort),
            thrust_variation=float(metrics.thrust_variation),
            worst_step=float(metrics.worst_step),
            failed_step=int(metrics.failed_step),
            bound_excess=float(metrics.bound_excess),
            weighted_violation=float(metrics.weighted_violation),
            bound_promised=float(metrics.promises / metrics.calls) if metrics.calls else math.nan,
            healthy_weakened=bool(metrics.healthy_isolated or metrics.thrust_limit < _HALF * _least_limit(scenario)),
        )

    def close(self) -> None:
        """Free all FMUs. May be called twice."""
        for vehicle in self._vehicles.values():
            vehicle.close()

    def __enter__(self) -> SceneFlyer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
