"""A scored scene, flown by a law, with the plant's FMU loaded once for many."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller import LAWS
from cosim.batch.c_calls import Clock
from cosim.batch.flight_config import (
    LOSSES,
    PLANT_OUTPUTS,
    SENSOR_OUTPUTS,
    Allocator,
    FlightConfig,
    FlightMetrics,
    find_bound,
    make_workspace,
)
from cosim.batch.fused_loop import fly_law
from cosim.campaigns.scenes.scene import KnownScene, Scene, known_scene, plant_values
from cosim.errors import RunError
from cosim.scenario.arbiter_rules import PAPER_RULES
from cosim.scenario.criteria import PAPER
from cosim.scenario.sensor_suite import outage_schedule, sensor_model, sensor_parameters
from cosim.scenario.tables import Outage
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu import Plant
from plant_fmu.vehicle import load_vehicle

VEHICLE = "odin"
LEVEL = (1.0, 0.0, 0.0, 0.0)
_ROUNDING = 1e-9  # of a count of steps


@dataclass(frozen=True)
class Conditions:
    """How scenes are flown; the defaults are those of the score."""

    duration: float = 120.0  # s
    control: float = 0.02  # s
    plant_steps: int = 2  # plant steps a control step, each one integration step
    settled: float = 10.0  # s at the end inside the goal region
    ramp: float = 0.2  # m, width of the arbiter's memberships
    tell_failures: bool = False
    sensing: Literal["state", "sensors"] = "state"  # what the law is told, as `Sensing.through`
    outages: tuple[Outage, ...] = ()  # of sensors

    def __post_init__(self) -> None:
        for key in ("duration", "control"):
            if not 0.0 < getattr(self, key) < math.inf:
                raise RunError(f"{key} is {getattr(self, key)} s, expected a finite number above 0")
        if self.plant_steps < 1 or self.controls < 1:
            raise RunError(f"{self.controls} control steps of {self.plant_steps} plant steps, expected 1 or more")

    @property
    def controls(self) -> int:
        """How many control steps a flight has."""
        return round(self.duration / self.control)

    @property
    def plant_step(self) -> float:
        """Length of a plant step [s]."""
        return self.control / self.plant_steps


class Score(NamedTuple):
    """What the flight of a scene came to."""

    reached: bool  # inside the goal region for the last `Conditions.settled` seconds
    reach_time: float  # s, since when it was inside without a break; inf if it is outside at the end
    min_clearance: float  # m, least over all regions, the start and all plant steps; negative: violated
    effort: float  # N s, sum over thrusters of the integral of the given force's magnitude
    thrust_variation: float  # N, sum over thrusters of the changes of the commanded force, from 0 on
    worst_step: float  # s of the wall clock, the longest that law and allocation took
    failed_step: int  # plant step that the FMU refused, -1 for none
    bound_excess: float = (
        -math.inf
    )  # m, by which a clearance was below the law's last bound, greatest; -inf: it gives none


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
        self._vehicle = load_vehicle(VEHICLE)
        self._model = vehicle_model(self._vehicle)
        self._law(0)  # says now what it cannot work with
        self._clock = Clock()
        self._plant = Plant(self._vehicle)

    def fly(self, scene: Scene, trace: bool = False) -> tuple[Score, NDArray[np.float64]]:
        """Fly one scene.

        Parameters
        ----------
        scene : Scene
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
        """
        c, m = self.conditions, self._vehicle.n_thrusters
        plant, known = self._plant, known_scene(scene, c.ramp)
        law = self._law(known.regions.kinds.size)
        plant.reset()
        values, sensors = plant_values(scene, self._vehicle, c.plant_step), {}
        if c.sensing == "sensors":
            sensors = sensor_parameters(scene.seed, values)
        plant.set(values | sensors)
        plant.initialise()
        thrusts = [f"thrust[{i + 1}]" for i in range(m)]
        forces = [f"thruster_force[{i + 1}]" for i in range(m)]
        outputs = (*PLANT_OUTPUTS, *forces, *(f"actuation.{axis}" for axis in "XYZ"))
        native = plant.native(thrusts, (*outputs, *(SENSOR_OUTPUTS if sensors else ())))
        effectiveness = plant.native([f"thrust_effectiveness[{i + 1}]" for i in range(m)], ())
        effectiveness.inputs[:] = 1.0
        losses = plant.native(LOSSES, ())
        losses.inputs[:] = [sensors.get(name, 0.0) for name in LOSSES]
        setup = self._setup(scene, known, sensors)
        rows = np.zeros((c.controls, 17 + len(PAPER) + m + law.report.size) if trace else (0, 0))
        workspace = make_workspace(setup, len(PAPER), m, m)
        metrics, _ = fly_law(
            setup, native, effectiveness, losses, self._allocator(), law, PAPER_RULES.system, workspace, rows
        )
        return self._score(metrics, setup), rows

    def _score(self, metrics: FlightMetrics, setup: FlightConfig) -> Score:
        inside, since = metrics.inside and metrics.failed_step < 0, metrics.last_entered
        return Score(
            reached=inside and setup.steps - since >= math.ceil(self.conditions.settled / setup.step - _ROUNDING),
            reach_time=since * setup.step if inside else math.inf,
            min_clearance=metrics.least_clearance,
            effort=metrics.thrust_effort,
            thrust_variation=metrics.thrust_variation,
            worst_step=metrics.worst_step,
            failed_step=int(metrics.failed_step),
            bound_excess=metrics.bound_excess,
        )

    def _law(self, n_regions: int) -> Any:
        return LAWS[self.law].for_vehicle(self._model, self.gains, np.array(LEVEL), self.conditions.control, n_regions)

    def _setup(self, scene: Scene, known: KnownScene, sensors: dict[str, float]) -> FlightConfig:
        c, failure = self.conditions, scene.failed_thruster
        noise = np.random.default_rng([scene.seed, 1]).standard_normal((c.controls, 6))
        noise[:, :3] *= scene.noise.position
        noise[:, 3:] *= scene.noise.velocity
        fails_at = math.ceil(min(failure.time, c.duration) / c.control) * c.plant_steps if failure else 0
        outages = outage_schedule(c.outages, sensors, c.plant_step)
        return FlightConfig(
            goal=known.goal,
            regions=known.regions,
            criteria=known.criteria,
            priorities=np.ones(known.criteria.size),
            inputs=known.inputs,
            step=c.plant_step,
            steps=c.controls * c.plant_steps,
            control_every=c.plant_steps,
            arbiter_every=c.plant_steps,
            moving=any(any(obstacle.velocity) for obstacle in scene.obstacles),
            exact=not (scene.noise.position or scene.noise.velocity or sensors),
            noise=noise,
            dead_from=math.inf,
            dead_until=math.inf,
            frozen=False,
            through_sensors=bool(sensors),
            sensors=sensor_model(sensors),
            outage_steps=np.array([step for step, _, _ in outages], np.int64),
            outage_sensors=np.array([sensor for _, sensor, _ in outages], np.int64),
            outage_losses=np.array([loss for _, _, loss in outages]),
            failed=np.array([failure.index - 1] if failure else [], np.int64),
            failure_steps=np.array([fails_at] if failure else [], np.int64),
            remaining=np.zeros(1 if failure else 0),
            tell=c.tell_failures,
            thrusters=self._vehicle.n_thrusters,
            bound=find_bound(LAWS[self.law].diagnostics),
            clock=self._clock.numbers,
        )

    def _allocator(self) -> Allocator:
        v = self._vehicle
        inverse = np.ascontiguousarray(np.linalg.pinv(v.thruster_matrix))
        return Allocator(inverse[None], v.thrust_min[None], v.thrust_max[None], True)

    def close(self) -> None:
        """Free the plant. May be called twice."""
        self._plant.close()

    def __enter__(self) -> SceneFlyer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
