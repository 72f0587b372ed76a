"""The helm of a running vehicle: armed or not, by hand or by the law, and where the target region is."""

from __future__ import annotations

import logging
import math
from typing import assert_never

import numpy as np

from controller import VehicleState
from cosim.errors import OrderError
from cosim.scenario.scenario import Scenario
from cosim.scenario.tables import Vector3
from cosim.simulation.actuators import Actuators
from cosim.simulation.commands.commands import (
    MODES,
    Aim,
    Arm,
    Begin,
    Change,
    Face,
    Forget,
    Item,
    Mission,
    Mode,
    Move,
    Obstacle,
    Order,
    Reset,
    Steer,
    Sticks,
)
from cosim.simulation.commands.mission_executor import Course
from cosim.simulation.commands.obstacle_slots import Slots
from cosim.simulation.commands.settings import LiveSettings
from cosim.simulation.environment import Surroundings
from cosim.simulation.signals import Array

__all__ = ["MODES", "Helm", "Mode"]

log = logging.getLogger(__name__)


class Helm:
    """Follows orders, and carries the target region from one item of a mission to the next.

    Parameters
    ----------
    scenario : Scenario
        What is run; its commands are enabled.
    surroundings : Surroundings
        Whose target and obstacles are moved.
    actuators : Actuators
        Whose limits are changed.
    state : VehicleState
        The vehicle as the law is told.
    out : ndarray, shape (7,)
        Receives armed, mode, item of the mission (-1 for none), and the target's middle [m, NED] and radius [m].

    Attributes
    ----------
    settings : LiveSettings
        The numbers as they are now.
    armed : bool
        Whether the thrusters may work.
    mode : Mode
        Who steers, and whither.
    heading : float or None
        Heading to be kept [rad], once one is ordered.
    took_over, turned, changed : bool
        Whether the law steers from now on and did not before, another heading was ordered, and settings were changed,
        since `heeded`.
    reset : bool
        Whether the run is to begin again.
    """

    def __init__(
        self,
        scenario: Scenario,
        surroundings: Surroundings,
        actuators: Actuators,
        state: VehicleState,
        out: Array,
    ) -> None:
        self.settings = LiveSettings(scenario)
        self.armed, self.mode = not scenario.commands.await_arm, "reach"
        self.heading: float | None = None
        self.took_over = self.turned = self.changed = self.reset = False
        self._surroundings, self._actuators, self._state, self._out = surroundings, actuators, state, out
        vehicle = scenario.vehicle
        # greatest wrench along and about each axis, which full sticks are parts of
        self._reach = greatest_wrench(vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max)
        self._sticks: Array = np.zeros(6)
        self._course = Course()
        self._slots = Slots(scenario.commands.obstacles)

    @property
    def law_steers(self) -> bool:
        """Whether the law says what the thrusters do; otherwise `wrench` does."""
        return self.armed and self.mode != "manual"

    @property
    def wrench(self) -> Array:
        """What the sticks ask for, shape (6,) [N, N m], body frame; nothing unless armed."""
        gain = self.settings["commands.pilot_gain"] if self.armed else 0.0
        wrench: Array = gain * self._sticks * self._reach
        return wrench

    def follow(self, order: Order, time: float) -> None:
        """Follow an order, at the beginning of a step; what cannot be followed is logged and changes nothing.

        Parameters
        ----------
        order : Order
            Any.
        time : float
            Of the step [s].
        """
        steered = self.law_steers
        try:
            self._follow(order, time)
        except OrderError as error:
            log.warning("%s: %s", type(order).__name__.lower(), error)
        self.took_over |= self.law_steers and not steered

    def _follow(self, order: Order, time: float) -> None:
        match order:
            case Arm():
                self.armed = order.armed
                self._sticks[:] = 0.0
            case Steer():
                self._steer(order.mode, time)
            case Aim():
                self._surroundings.aim(order.position, order.radius, order.velocity, time)
                self._surroundings.keep_target()
                self.mode = "reach"
            case Face():
                self.heading, self.turned = order.heading, True
            case Sticks():
                self._sticks[:] = order.wrench
            case Obstacle():
                slot = self._slots.take(order.number)
                self._surroundings.place(slot, order.position, order.radius, order.velocity, time)
            case Forget():
                left = self._slots.leave(order.number)
                if left is not None:
                    self._surroundings.forget(left)
            case Move():
                self._surroundings.displace(order.region, order.by)
            case Change():
                self.settings.change(order.key, order.value)
                self.changed = True
                self._apply(order.key)
            case Mission():
                self._course.take(order.items)
                if self.mode == "mission":
                    self._steer("hold", time)
            case Begin():
                self._course.begin(order.item)
                if self.mode == "mission":
                    self._resume(time)
            case Reset():
                self.reset = True
            case _:
                assert_never(order)

    def heeded(self) -> None:
        """Note that whoever steps the run has taken over what is new."""
        self.took_over = self.turned = self.changed = False

    def _apply(self, key: str) -> None:
        """Bring a changed setting to regions and actuators; the law's gains and the arbiter's ramp the master takes."""
        settings, region = self.settings, self.settings.region_of(key)
        if region is not None and key.endswith(".gain"):
            self._surroundings.set_gain(region, settings[key])
        elif region is not None:
            self._surroundings.set_shape(region, settings.shapes[region])
        elif key in settings.of_plant:
            self._actuators.limit(settings.of_plant[key], settings[key])

    def _steer(self, mode: Mode, time: float) -> None:
        here: Vector3 = (float(self._state.position[0]), float(self._state.position[1]), float(self._state.position[2]))
        radius = self.settings["commands.hold_radius"]
        if mode in ("hold", "surface") and not all(map(math.isfinite, here)):
            raise OrderError(f"mode {mode} needs a position, and none is known")
        if mode == "mission" and not self._course.items:
            raise OrderError("mode mission: there is no mission")
        self.mode = mode
        self._sticks[:] = 0.0
        match mode:
            case "hold":
                self._surroundings.aim(here, radius)
            case "surface":
                up = (here[0], here[1], self.settings["commands.surface_depth"])
                self._surroundings.aim(up, radius)
            case "reach":
                self._surroundings.aim_as_before()
            case "mission":
                self._course.enter(max(self._course.at, 0))
                self._resume(time)

    def _resume(self, time: float) -> None:
        """Go on with the present item of the mission, from wherever the vehicle is."""
        region, item = self._course.region(), self._course.items[self._course.at]
        if region is not None and region is not item:
            self._aim_at(region)
        self._begin(item, time)

    def _begin(self, item: Item, time: float) -> None:
        self._aim_at(item)
        for order in item.orders:
            self.follow(order, time)

    def _aim_at(self, item: Item) -> None:
        if item.position is not None:
            self._surroundings.aim(item.position, item.radius)

    def watch(self, time: float, clearance: float) -> bool:
        """Write how things stand, and go on with the mission once its region was reached.

        Parameters
        ----------
        time : float
            Of the step [s].
        clearance : float
            Of the target region, as the law is told [m]; 0 or above within it.

        Returns
        -------
        bool
            Whether another item is under way now; what it changed is for `heeded` to note.
        """
        following = None
        if self.armed and self.mode == "mission":
            following = self._course.following(time, clearance)
        if following is not None:
            self._begin(self._course.enter(following), time)
        self._out[0], self._out[1], self._out[2] = self.armed, MODES.index(self.mode), self._course.at
        self._out[3:6], self._out[6] = self._surroundings.target, self._surroundings.target_radius
        return following is not None


def greatest_wrench(matrix: Array, lower: Array, upper: Array) -> Array:
    """Return the greatest wrench along and about each axis alone that the least thruster forces give, both ways.

    Parameters
    ----------
    matrix : ndarray, shape (6, m)
        Body wrench of one newton of each thruster.
    lower, upper : ndarray, shape (m,)
        Limits of each thruster [N].

    Returns
    -------
    ndarray, shape (6,)
        [N, N m]; 0 about an axis that the thrusters cannot turn.
    """
    inverse = np.linalg.pinv(matrix)
    limit = np.minimum(-lower, upper)
    result = np.zeros(6)
    for axis in range(6):
        share = np.abs(inverse[:, axis])
        used = share > 1e-9 * max(1e-300, float(np.max(np.abs(inverse))))
        if np.any(used):
            result[axis] = float(np.min(limit[used] / share[used]))
    return result
