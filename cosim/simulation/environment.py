"""The goal and the regions of a run: their present positions, and their evaluation at a pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from controller.regions import Region, Sphere, pack
from controller.regions.region_set import PackedRegions, RegionEvaluator, shape_center
from controller.regions.shape import Shape
from cosim.errors import CommandError, RunError
from cosim.scenario.region_tables import PARKED_POSITION, Vector3
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array
from cosim.step.region_positions import move_packed
from cosim.step.step_model import StepData

_SPHERE_NUMBERS = len(Sphere((0.0, 0.0, 0.0), 1.0).packed())
_AT_REST = (0.0, 0.0, 0.0)


@dataclass
class _Target:
    """A target region."""

    shape: Shape
    middle: Array  # (3,) m, NED: center of its shape as packed
    origin: Array  # (3,) m, NED: its shift from there, extrapolated to time 0 at its present velocity
    velocity: Array  # (3,) m/s, NED
    radius: float = 0.0  # m, radius of a sphere; 0 for the shape of the scenario's goal


class RegionEnvironment:
    """Goal and regions, moved by their velocities, or by `move` where the scenario has ``streamed = true``."""

    # It changes those of a step's `data` in place, or its own.

    def __init__(self, scenario: Scenario, data: StepData | None = None) -> None:
        secondary = [region.region for region in scenario.regions]
        self.goal = pack([scenario.goal_region]) if data is None else data.goal
        self.regions = pack(secondary) if data is None else data.regions
        # m, NED: shift of goal and regions, extrapolated to time 0 at their present velocities
        self._goal_origin: Array = np.zeros((1, 3)) if data is None else data.goal_origin
        self._goal_center: Array = np.zeros(3) if data is None else data.goal_center
        self._origins: Array = np.zeros((len(secondary), 3)) if data is None else data.region_origins
        self._deviations = self.regions.deviations.copy()  # m, standard deviations as in the scenario
        self._goal_shape, self._middle = scenario.goal, np.array(shape_center(scenario.goal))
        goal_velocity = np.array(scenario.goal_velocity, dtype=float)
        self._target = self._reached = _Target(scenario.goal, self._middle, np.zeros(3), goal_velocity)
        self._names = ["goal", *(region.name for region in secondary)]
        self._streamed = ["goal"] if scenario.goal_streamed else []
        self._streamed += [
            region.region.name for region in scenario.regions if region.streamed and not region.is_dynamic
        ]
        self._evaluators = RegionEvaluator(self.goal), RegionEvaluator(self.regions)
        self._moving = [self._names.index(name) for name in scenario.moving]
        self._dynamic = [i for i, region in enumerate(scenario.regions) if region.is_dynamic]

    def update_positions(self, time: float, shifts: Array) -> None:
        """Move all regions to their positions at a time; time [s], shifts (moving regions, 3) [m, NED]."""
        if not self._moving:
            return
        for packed, origins in ((self.goal, self._goal_origin), (self.regions, self._origins)):
            move_packed(packed, origins, time)
        for i, at in enumerate(self._moving):
            shifts[i] = self.regions.shifts[at - 1] if at else self.target - self._middle

    def inflate_position_uncertainty(self, deviation: float) -> None:
        """Add a standard deviation [m] to the position uncertainty of every region, which widens the margins."""
        np.hypot(self._deviations, deviation, out=self.regions.deviations)

    def evaluate(self, position: Array, quaternion: Array) -> tuple[Array, Array]:
        """Return values and clearances of goal and regions at a pose, shape (n + 1,) each; position [m, NED]."""
        goal, regions = (evaluator.evaluate(position, quaternion) for evaluator in self._evaluators)
        return np.concatenate((goal[0], regions[0])), np.concatenate((goal[3], regions[3]))

    # ---- moved from outside ----

    def move(self, name: str, displacement: Array, velocity: Array, time: float) -> None:
        """Set position and velocity of a streamed region at a time [s], as described in `Master.move_region`."""
        # Raise a RunError if the region is not streamed, or a number is not finite.
        if name not in self._streamed:
            known = ", ".join(self._streamed) or "none"
            raise RunError(f"region {name!r} cannot be moved, expected a streamed one: {known}")
        to, going = np.array(displacement, dtype=float), np.array(velocity, dtype=float)
        if to.shape != (3,) or going.shape != (3,) or not np.isfinite([to, going]).all():
            raise RunError(f"region {name!r}: moved to {to} m at {going} m/s, expected three finite numbers each")
        at = self._names.index(name)
        if at:
            self._set_motion(at - 1, to, going, time)
        else:
            self._reached.velocity, self._reached.origin = going, to - going * time
            if self._reached is self._target:
                self._load_target(time)

    def _set_motion(self, i: int, displacement: Array, velocity: Array, time: float) -> None:
        self.regions.velocities[i] = velocity
        self._origins[i] = displacement - velocity * time

    def add_obstacle(self, slot: int, position: Vector3, radius: float, velocity: Vector3, time: float) -> None:
        """Place an obstacle in a slot; position [m, NED], radius [m], velocity [m/s, NED], time [s]."""
        i = self._dynamic[slot]
        self._reshape(self.regions, i, Sphere(PARKED_POSITION, radius))
        self._set_motion(i, np.subtract(position, PARKED_POSITION), np.array(velocity), time)

    def remove_obstacle(self, slot: int) -> None:
        """Remove the obstacle in a slot, from 0."""
        self._set_motion(self._dynamic[slot], np.zeros(3), np.zeros(3), 0.0)

    def shift_region(self, name: str, by: Vector3) -> None:
        """Move a region, or an obstacle, by a displacement [m, NED]."""
        movable = [self._names[at] for at in self._moving if at]
        if name not in movable:
            raise CommandError(f"region is {name!r}, expected one of {', '.join(movable) or 'none'}")
        i = self._names.index(name) - 1
        if i in self._dynamic and not self._origins[i].any():
            raise CommandError(f"region is {name!r}: no such obstacle has been added")
        self._origins[i] += by

    # ---- the target ----

    @property
    def target(self) -> Array:
        """Center of the target region, shape (3,) [m, NED]."""
        middle: Array = self._target.middle + self.goal.shifts[0]
        return middle

    @property
    def target_radius(self) -> float:
        """Radius of the target region [m], 0 if it has the shape of the scenario's goal."""
        return self._target.radius

    def set_target(
        self, position: Vector3, radius: float | None, velocity: Vector3 = _AT_REST, time: float = 0.0
    ) -> None:
        """Set position, shape and velocity of the target region; position [m, NED], radius [m], velocity [m/s, NED]."""
        # Units of arguments: time [s]
        if radius is None:
            origin = np.subtract(position, self._middle)
            self._target = _Target(self._goal_shape, self._middle, origin, np.array(velocity))
        else:
            self._target = _Target(
                Sphere(position, radius), np.array(position), np.zeros(3), np.array(velocity), radius
            )
        self._target.origin -= np.multiply(velocity, time)
        self._load_target(time)

    def save_target(self) -> None:
        """Save the present target for `restore_target`."""
        self._reached = self._target

    def restore_target(self, time: float) -> None:
        """Restore the target that was saved last, at a time [s]; the scenario's goal, if none was."""
        self._target = self._reached
        self._load_target(time)

    def _load_target(self, time: float) -> None:
        """Write the target into the arrays of the goal, at its position at a time [s]."""
        self._load_shape()
        self.goal.velocities[0], self._goal_origin[0] = self._target.velocity, self._target.origin
        self._goal_center[:] = self._target.middle
        move_packed(self.goal, self._goal_origin, time)

    def _load_shape(self) -> None:
        numbers = self._target.shape.packed()
        self.goal.kinds[0], self.goal.offsets[1] = self._target.shape.kind, len(numbers)
        self.goal.numbers[: len(numbers)] = numbers

    # ---- changed from outside ----

    def set_gain(self, name: str, gain: float) -> None:
        """Set the gain of a secondary region."""
        self.regions.gains[self._names.index(name) - 1] = gain

    def set_shape(self, name: str, shape: Shape) -> None:
        """Set the shape of a region, or of ``"goal"``, to one of the same kind with as many numbers."""
        at = self._names.index(name)
        if at:
            self._reshape(self.regions, at - 1, shape)
            return
        self._goal_shape = shape
        for target in (self._reached, self._target):
            if not target.radius:
                target.shape = shape
        self._load_shape()

    @staticmethod
    def _reshape(regions: PackedRegions, i: int, shape: Shape) -> None:
        regions.numbers[regions.offsets[i] : regions.offsets[i + 1]] = shape.packed()


def pack_target(goal: Region) -> PackedRegions:
    """Pack a goal with space for a sphere in its place."""
    packed = pack([goal])
    return packed._replace(numbers=np.resize(packed.numbers, max(packed.numbers.size, _SPHERE_NUMBERS)))
