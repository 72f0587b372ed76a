"""The goal and the regions of a run: their present positions, and their evaluation at a pose."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from controller import VehicleState
from controller.compiling.function import CompiledFunction
from controller.regions import Sphere, pack
from controller.regions.region_set import PackedRegions, evaluate_packed, shape_entry
from controller.regions.shape import Shape
from cosim.errors import CommandError, RunError
from cosim.scenario.region_tables import PARKED_POSITION, Vector3
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array

_AT_REST = (0.0, 0.0, 0.0)
_ROUNDING = 1e-6  # tolerance of times, as a fraction of a step


@dataclass(frozen=True)
class _Target:
    """A target region."""

    packed: PackedRegions  # this region alone
    middle: Array  # (3,) m, NED: center of its shape as packed
    origin: Array  # (3,) m, NED: its shift from there, extrapolated to time 0 at its present velocity
    radius: float  # m, radius of a sphere; 0 for the shape of the scenario's goal


class RegionEvaluation(NamedTuple):
    """Values of goal and n regions at a pose; the goal's come first."""

    values: Array  # (n + 1,) g, above 0 where violated
    gradients: Array  # (n + 1, 3) derivative of g by position, world frame
    rotation_gradients: Array  # (n + 1, 3) derivative of g by rotation, body frame [1/rad]
    clearances: Array  # (n + 1,) distance left to each boundary: m, or rad of attitude


class RegionPlaces(NamedTuple):
    """Goal and regions at their present positions."""

    goal: PackedRegions
    regions: PackedRegions


class RegionEnvironment:
    """Goal and regions, moved by their velocities, or by `move` where the scenario has ``streamed = true``."""

    def __init__(self, scenario: Scenario) -> None:
        secondary = [region.region for region in scenario.regions]
        self.regions = pack(secondary)
        self._deviations = self.regions.deviations.copy()  # m, standard deviations as in the scenario
        self._goal_region, self._middle = scenario.goal_region, shape_center(scenario.goal)
        self._target = self._reached = self._new_target(None, self._middle)
        self._then = [np.subtract(place, self._middle) for place in scenario.goal_then]
        self._place, self._stay, self._stayed = 0, stay_steps(scenario), 0
        self._places = RegionPlaces(self.goal, self.regions)
        self._names = ["goal", *(region.name for region in secondary)]
        self._streamed = ["goal"] if scenario.goal_streamed else []
        self._streamed += [
            region.region.name for region in scenario.regions if region.streamed and not region.is_dynamic
        ]
        self._moving = [self._names.index(name) for name in scenario.moving]
        self._dynamic = [i for i, region in enumerate(scenario.regions) if region.is_dynamic]
        # m, NED: shift of each region, extrapolated to time 0 at its present velocity
        self._origins: Array = np.zeros((len(secondary), 3))
        self._evaluate_places = CompiledFunction(evaluate_places)

    @property
    def goal(self) -> PackedRegions:
        """The target region alone, at its present position."""
        return self._target.packed

    def update_positions(self, time: float, shifts: Array) -> None:
        """Move all regions to their positions at a time; time [s], shifts (moving regions, 3) [m, NED]."""
        if not self._moving:
            return
        for packed, origins in ((self.goal, self._target.origin), (self.regions, self._origins)):
            packed.move_to(time)
            packed.shifts[:] += origins
        for i, at in enumerate(self._moving):
            shifts[i] = self.regions.shifts[at - 1] if at else self.target - self._middle

    def inflate_position_uncertainty(self, deviation: float) -> None:
        """Add a standard deviation [m] to the position uncertainty of every region, which widens the margins."""
        np.hypot(self._deviations, deviation, out=self.regions.deviations)

    def empty_evaluation(self, values: Array, clearances: Array) -> RegionEvaluation:
        """Return an evaluation for `evaluate` to fill; values, clearances (n + 1,)."""
        n = len(self._names)
        return RegionEvaluation(values, np.zeros((n, 3)), np.zeros((n, 3)), clearances)

    def evaluate(self, state: VehicleState, evaluation: RegionEvaluation) -> None:
        """Evaluate goal and regions at a pose."""
        self._evaluate_places(self._places, state, evaluation)

    def clearances(self, position: Array, quaternion: Array) -> Array:
        """Return the clearances of goal and regions at a pose, shape (n + 1,) [m, rad of attitude]."""
        # with position [m, NED]
        n = len(self._names)
        found = self.empty_evaluation(np.zeros(n), np.zeros(n))
        self.evaluate(VehicleState(position, quaternion, np.zeros(6), np.zeros(0)), found)
        return found.clearances

    def advance_goal(self, clearance: float, place: Array) -> None:
        """Move the goal to its next place, from the next step on, once the vehicle has stayed in it long enough."""
        # with clearance [m]
        place[:] = self._place
        if self._place == len(self._then):
            return
        self._stayed = self._stayed + 1 if clearance >= 0.0 else 0
        if self._stayed > self._stay:
            self._target.origin[:] = self._then[self._place]
            self._place, self._stayed = self._place + 1, 0

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
            self._reached.packed.velocities[0] = going
            self._reached.origin[:] = to - going * time

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
        # with time [s]
        target = self._new_target(radius, position)
        target.packed.velocities[0] = velocity
        target.origin[:] -= np.multiply(velocity, time)
        self._use_target(target)

    def save_target(self) -> None:
        """Save the present target for `restore_target`."""
        self._reached = self._target

    def restore_target(self) -> None:
        """Restore the target that was saved last; the scenario's goal, if none was."""
        self._use_target(self._reached)

    def _use_target(self, target: _Target) -> None:
        self._target = target
        self._places = self._places._replace(goal=target.packed)

    def _new_target(self, radius: float | None, position: Vector3) -> _Target:
        """Return a target at rest with its center at a position, a sphere or with the shape of the scenario's goal."""
        if radius is None:
            origin = np.subtract(position, self._middle)
            return _Target(pack([self._goal_region]), np.array(self._middle), origin, 0.0)
        sphere = dataclasses.replace(self._goal_region, shape=Sphere(position, radius))
        return _Target(pack([sphere]), np.array(position), np.zeros(3), radius)

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
        self._goal_region = dataclasses.replace(self._goal_region, shape=shape)
        for target in (self._reached, self._target):
            if not target.radius:
                self._reshape(target.packed, 0, shape)

    @staticmethod
    def _reshape(regions: PackedRegions, i: int, shape: Shape) -> None:
        regions.numbers[regions.offsets[i] : regions.offsets[i + 1]] = shape.packed()


def evaluate_places(places: RegionPlaces, state: VehicleState, found: RegionEvaluation) -> None:
    """Evaluate the goal into the first elements, and the regions into those behind, in one call."""
    p, e, g, c = state.position, state.quaternion, found.values, found.clearances
    evaluate_packed(places.goal, p, e, g[:1], found.gradients[:1], found.rotation_gradients[:1], c[:1])
    evaluate_packed(places.regions, p, e, g[1:], found.gradients[1:], found.rotation_gradients[1:], c[1:])


def stay_steps(scenario: Scenario) -> int:
    """Return the number of steps that the vehicle has to stay in the goal before the goal moves to its next place."""
    return math.ceil(scenario.goal_stay / scenario.time.step - _ROUNDING)


def shape_center(shape: Shape) -> Vector3:
    """Return the center of a shape, the point by which targets are placed; returns [m, NED]."""
    center = shape_entry(shape).center
    if center is not None:
        return center(shape)
    middle = [0.0, 0.0, 0.0]
    for axis, (low, high) in enumerate(zip(*shape.bounds(), strict=True)):
        ends = [end for end in (low, high) if math.isfinite(end)]
        middle[axis] = sum(ends) / len(ends) if ends else 0.0
    return middle[0], middle[1], middle[2]
