"""A scored scene, flown by a law, with the plant's FMU loaded once for many."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller import LAWS
from cosim.errors import RunError
from cosim.flight import OUTPUTS, Allocator, Score, Setup, flight_of
from cosim.native import Clock
from cosim.scene import Scene, Told, plant_values, told
from cosim.vehicle_model import vehicle_model
from plant_fmu import Plant
from plant_fmu.vehicle import load_vehicle

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


class SceneFlyer:
    """One law and one plant, for scene after scene.

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
    """

    def __init__(self, law: str, conditions: Conditions | None = None, gains: Any = None) -> None:
        if law not in LAWS:
            raise RunError(f"law is {law!r}, expected one of {', '.join(sorted(LAWS))}")
        self.law = law
        self.conditions = conditions or Conditions()
        self.gains = LAWS[law].gains_type() if gains is None else gains
        self._vehicle = load_vehicle("odin")
        self._model = vehicle_model(self._vehicle)
        self._law(0)  # says now what it cannot work with
        self._clock = Clock()
        self._flight = flight_of(law)
        self._plant = Plant(self._vehicle)

    def fly(self, scene: Scene, trace: bool = False) -> tuple[Score, NDArray[np.float64]]:
        """Fly one scene.

        Parameters
        ----------
        scene : Scene
            Any.
        trace : bool
            Whether to keep what happened, see `cosim.flight`.

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
        plant, known = self._plant, told(scene)
        law = self._law(known.regions.kinds.size)
        plant.reset()
        plant.set(plant_values(scene, self._vehicle, c.plant_step))
        plant.initialise()
        thrusts = [f"thrust[{i + 1}]" for i in range(m)]
        forces = [f"thruster_force[{i + 1}]" for i in range(m)]
        native = plant.native(thrusts, (*OUTPUTS, *forces))
        effectiveness = plant.native([f"thrust_effectiveness[{i + 1}]" for i in range(m)], ())
        setup = self._setup(scene, known)
        rows = np.zeros((setup.controls, 19 + m + law.report.size) if trace else (0, 0))
        score = self._flight(setup, native, effectiveness, self._allocator(), law.gains, law.memory, rows)
        return score, rows

    def _law(self, n_regions: int) -> Any:
        return LAWS[self.law].for_vehicle(self._model, self.gains, np.array(LEVEL), self.conditions.control, n_regions)

    def _setup(self, scene: Scene, known: Told) -> Setup:
        c, failure = self.conditions, scene.failed_thruster
        noise = np.random.default_rng([scene.seed, 1]).standard_normal((c.controls, 6))
        noise[:, :3] *= scene.noise.position
        noise[:, 3:] *= scene.noise.velocity
        return Setup(
            goal=known.goal,
            regions=known.regions,
            criteria=known.criteria,
            ramp=c.ramp,
            controls=c.controls,
            plant_steps=c.plant_steps,
            plant_step=c.plant_step,
            settled_steps=math.ceil(c.settled / c.plant_step - _ROUNDING),
            noise=noise,
            failed=failure.index - 1 if failure else -1,
            failure_control=math.ceil(min(failure.time, c.duration) / c.control) if failure else -1,
            tell=c.tell_failures,
            clock=self._clock.numbers,
        )

    def _allocator(self) -> Allocator:
        v = self._vehicle
        return Allocator(np.ascontiguousarray(np.linalg.pinv(v.thruster_matrix)), v.thrust_min, v.thrust_max, True)

    def close(self) -> None:
        """Free the plant. May be called twice."""
        self._plant.close()

    def __enter__(self) -> SceneFlyer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
