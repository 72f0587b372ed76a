"""The goal and the regions of a run: where each is now, and what they say of a pose."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from controller import VehicleState
from controller.compiling.function import CompiledFunction
from controller.regions import Sphere, pack
from controller.regions.region_set import PackedRegions, evaluate_packed
from controller.regions.shape import Shape
from cosim.errors import CommandError, RunError
from cosim.scenario.scenario import Scenario
from cosim.scenario.tables import PARKED_POSITION, Vector3
from cosim.simulation.signals import Array

_AT_REST = (0.0, 0.0, 0.0)
_ROUNDING = 1e-6  # of a step


@dataclass(frozen=True)
class _Target:
    """A region to be reached."""

    packed: PackedRegions  # of this region alone
    middle: Array  # (3,) m, NED: of its shape as packed
    origin: Array  # (3,) m, NED: how far it would have been from there at time 0, had it always moved as it does now
    radius: float  # m, of a sphere; 0 for the shape of the scenario's goal


class RegionEvaluation(NamedTuple):
    """What goal and n regions say of a pose; the goal's come first."""

    values: Array  # (n + 1,) g
    gradients: Array  # (n + 1, 3) of g by position, world frame
    rotation_gradients: Array  # (n + 1, 3) of g by rotation, body frame [1/rad]
    clearances: Array  # (n + 1,) m, or rad of attitude


class RegionPlaces(NamedTuple):
    """All that is evaluated, where it is now."""

    goal: PackedRegions
    regions: PackedRegions


class RegionEnvironment:
    """Goal and regions, moved by their velocities, or from outside where the scenario calls them streamed.

    Parameters
    ----------
    scenario : Scenario
        Which regions.

    Attributes
    ----------
    regions : PackedRegions
        The n secondary ones, where they are now.
    """

    def __init__(self, scenario: Scenario) -> None:
        secondary = [region.region for region in scenario.regions]
        self.regions = pack(secondary)
        self._deviations = self.regions.deviations.copy()  # m, as the scenario has them
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
        self._seen = [i for i, region in enumerate(scenario.regions) if region.is_dynamic]
        # m, NED: where each would have been at time 0, had it always moved as it does now
        self._origins: Array = np.zeros((len(secondary), 3))
        self._evaluate_places = CompiledFunction(evaluate_places)

    @property
    def goal(self) -> PackedRegions:
        """The region to be reached alone, where it is now."""
        return self._target.packed

    def update_positions(self, time: float, shifts: Array) -> None:
        """Put all regions where they are at a time.

        Parameters
        ----------
        time : float
            [s].
        shifts : ndarray, shape (moving regions, 3)
            Receives how far each moving one is from where the scenario has it [m, NED].
        """
        if not self._moving:
            return
        for packed, origins in ((self.goal, self._target.origin), (self.regions, self._origins)):
            packed.move_to(time)
            packed.shifts[:] += origins
        for i, at in enumerate(self._moving):
            shifts[i] = self.regions.shifts[at - 1] if at else self.target - self._middle

    def doubt_positions(self, deviation: float) -> None:
        """Let every region's place be uncertain by a standard deviation [m] more, so that margins are wider."""
        np.hypot(self._deviations, deviation, out=self.regions.deviations)

    def empty_evaluation(self, values: Array, clearances: Array) -> RegionEvaluation:
        """Return room for what `evaluate` finds.

        Parameters
        ----------
        values, clearances : ndarray, shape (n + 1,)
            That are to be part of it.

        Returns
        -------
        RegionEvaluation
            All else zero.
        """
        n = len(self._names)
        return RegionEvaluation(values, np.zeros((n, 3)), np.zeros((n, 3)), clearances)

    def evaluate(self, state: VehicleState, evaluation: RegionEvaluation) -> None:
        """Evaluate goal and regions at a pose.

        Parameters
        ----------
        state : VehicleState
            Its position and attitude count.
        evaluation : RegionEvaluation
            Receives what they say.
        """
        self._evaluate_places(self._places, state, evaluation)

    def advance_goal(self, clearance: float, place: Array) -> None:
        """Let the goal go on to its next place, from the next step on, once the vehicle has stayed in it long enough.

        Parameters
        ----------
        clearance : float
            Of the goal at the true position, once a step [m].
        place : ndarray, shape (1,)
            Receives which place it is at, from 0; of a goal that stays where it is, shape (0,).
        """
        place[:] = self._place
        if self._place == len(self._then):
            return
        self._stayed = self._stayed + 1 if clearance >= 0.0 else 0
        if self._stayed > self._stay:
            self._target.origin[:] = self._then[self._place]
            self._place, self._stayed = self._place + 1, 0

    # ---- moved from outside ----

    def move(self, name: str, displacement: Array, velocity: Array, time: float) -> None:
        """Say where a streamed region is at a time, and how it goes on from there, as `Master.move_region` says.

        A RunError if it is none that can be moved, or a number is not finite.
        """
        if name not in self._streamed:
            known = ", ".join(self._streamed) or "none"
            raise RunError(f"region {name!r} cannot be moved, expected a streamed one: {known}")
        to, going = np.array(displacement, dtype=float), np.array(velocity, dtype=float)
        if to.shape != (3,) or going.shape != (3,) or not np.isfinite([to, going]).all():
            raise RunError(f"region {name!r}: moved to {to} m at {going} m/s, expected three finite numbers each")
        at = self._names.index(name)
        if at:
            self._carry(at - 1, to, going, time)
        else:
            self._reached.packed.velocities[0] = going
            self._reached.origin[:] = to - going * time

    def _carry(self, i: int, displacement: Array, velocity: Array, time: float) -> None:
        self.regions.velocities[i] = velocity
        self._origins[i] = displacement - velocity * time

    def add_obstacle(self, slot: int, position: Vector3, radius: float, velocity: Vector3, time: float) -> None:
        """Put an obstacle that came while running somewhere.

        Parameters
        ----------
        slot : int
            Which of them, from 0.
        position : tuple of float
            Of its centre [m, NED].
        radius : float
            [m].
        velocity : tuple of float
            From then on [m/s, NED].
        time : float
            [s].
        """
        i = self._seen[slot]
        self._reshape(self.regions, i, Sphere(PARKED_POSITION, radius))
        self._carry(i, np.subtract(position, PARKED_POSITION), np.array(velocity), time)

    def remove_obstacle(self, slot: int) -> None:
        """Take an obstacle away that came while running; `slot` counts them from 0."""
        self._carry(self._seen[slot], np.zeros(3), np.zeros(3), 0.0)

    def shift_region(self, name: str, by: Vector3) -> None:
        """Move a region, also of an obstacle that came, by so much [m, NED] from where it is.

        Raises
        ------
        CommandError
            If there is no such region, it is at no place, or it is an obstacle that has not come.
        """
        movable = [self._names[at] for at in self._moving if at]
        if name not in movable:
            raise CommandError(f"region is {name!r}, expected one of {', '.join(movable) or 'none'}")
        i = self._names.index(name) - 1
        if i in self._seen and not self._origins[i].any():
            raise CommandError(f"region is {name!r}: no such obstacle has come")
        self._origins[i] += by

    # ---- the target ----

    @property
    def target(self) -> Array:
        """Middle of the region to be reached, shape (3,) [m, NED]."""
        middle: Array = self._target.middle + self.goal.shifts[0]
        return middle

    @property
    def target_radius(self) -> float:
        """Radius of the region to be reached [m], 0 if it has the shape of the scenario's goal."""
        return self._target.radius

    def set_target(
        self, position: Vector3, radius: float | None, velocity: Vector3 = _AT_REST, time: float = 0.0
    ) -> None:
        """Put the region to be reached somewhere.

        Parameters
        ----------
        position : tuple of float
            Of its middle [m, NED].
        radius : float or None
            Of a sphere [m]; None for the shape of the scenario's goal.
        velocity : tuple of float
            From then on [m/s, NED].
        time : float
            [s].
        """
        target = self._new_target(radius, position)
        target.packed.velocities[0] = velocity
        target.origin[:] -= np.multiply(velocity, time)
        self._head_for(target)

    def save_target(self) -> None:
        """Remember the present target, for `restore_target`."""
        self._reached = self._target

    def restore_target(self) -> None:
        """Go back to the target that was remembered last; the scenario's goal, if none was."""
        self._head_for(self._reached)

    def _head_for(self, target: _Target) -> None:
        self._target = target
        self._places = self._places._replace(goal=target.packed)

    def _new_target(self, radius: float | None, position: Vector3) -> _Target:
        """Return a target at rest with its middle at a position, as a sphere or in the shape of the scenario's goal."""
        if radius is None:
            origin = np.subtract(position, self._middle)
            return _Target(pack([self._goal_region]), np.array(self._middle), origin, 0.0)
        sphere = dataclasses.replace(self._goal_region, shape=Sphere(position, radius))
        return _Target(pack([sphere]), np.array(position), np.zeros(3), radius)

    # ---- changed from outside ----

    def set_gain(self, name: str, gain: float) -> None:
        """Give a secondary region another gain."""
        self.regions.gains[self._names.index(name) - 1] = gain

    def set_shape(self, name: str, shape: Shape) -> None:
        """Give a region, or ``"goal"``, another shape of the same kind and size."""
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
    """Evaluate the goal into the first places, and the regions into those behind, in one call."""
    p, e, g, c = state.position, state.quaternion, found.values, found.clearances
    evaluate_packed(places.goal, p, e, g[:1], found.gradients[:1], found.rotation_gradients[:1], c[:1])
    evaluate_packed(places.regions, p, e, g[1:], found.gradients[1:], found.rotation_gradients[1:], c[1:])


def stay_steps(scenario: Scenario) -> int:
    """Return for how many steps the vehicle has to stay within the goal before that goes on."""
    return math.ceil(scenario.goal_stay / scenario.time.step - _ROUNDING)


def shape_center(shape: Shape) -> Vector3:
    """Return the point that moves with a shape, by which targets are placed.

    Parameters
    ----------
    shape : Shape
        In space.

    Returns
    -------
    tuple of float
        The middle of its upright box [m, NED]; along an axis on which it has one end, that end, and 0 where none.
    """
    middle = [0.0, 0.0, 0.0]
    for axis, (low, high) in enumerate(zip(*shape.bounds(), strict=True)):
        ends = [end for end in (low, high) if math.isfinite(end)]
        middle[axis] = sum(ends) / len(ends) if ends else 0.0
    return middle[0], middle[1], middle[2]
