"""Applies commands to a running vehicle: arming, modes, manual control, target region, obstacles and missions."""

from __future__ import annotations

import logging
import math
from typing import assert_never

import numpy as np

from controller import VehicleState
from controller.driven_axes import undriven_axes
from cosim.errors import CommandError
from cosim.scenario.scenario import Scenario
from cosim.simulation.actuation_limits import ActuationLimits
from cosim.simulation.commands import commands as cmd
from cosim.simulation.commands.mission_executor import MissionExecutor
from cosim.simulation.commands.obstacle_slots import ObstacleSlots
from cosim.simulation.commands.settings import LiveSettings
from cosim.simulation.commands.stick_stabilizer import StickStabilizer
from cosim.simulation.environment import RegionEnvironment
from cosim.simulation.signals import Array
from plant_fmu import Vehicle

log = logging.getLogger(__name__)


class CommandHandler:
    """Applies commands, and moves the target region from one mission item to the next; out (7,) [m, NED]."""

    def __init__(
        self,
        scenario: Scenario,
        environment: RegionEnvironment,
        limits: ActuationLimits,
        state: VehicleState,
        out: Array,
    ) -> None:
        self.settings = LiveSettings(scenario)
        self.armed, self.mode = not scenario.commands.await_arm, "reach"
        self.heading: float | None = None  # desired heading [rad], None until one is commanded
        self.control_regained = self.turned = self.changed = self.reset = False
        self._environment, self._limits, self._state, self._out = environment, limits, state, out
        vehicle = scenario.vehicle
        # maximum wrench along and about each axis, which a full stick commands
        self._greatest_wrench = greatest_wrench(vehicle)
        self._manual: Array = np.zeros(6)
        self._by_gain = True  # True if the pilot's gain scales the sticks
        self._attitude: cmd.SetAttitude | None = None
        self._stabilizer = StickStabilizer(vehicle, state, scenario.time.control, self._greatest_wrench)
        self._mission = MissionExecutor()
        self._slots = ObstacleSlots(scenario.commands.obstacles)

    @property
    def automatic_control(self) -> bool:
        """True if the law computes the forces; otherwise `wrench` does."""
        return self.armed and self.mode not in cmd.STICK_MODES and not self._commanded_force

    @property
    def _commanded_force(self) -> bool:
        """True if an attitude with a force is commanded in the law's place."""
        return self.mode == "reach" and self._attitude is not None and self._attitude.force is not None

    def wrench(self) -> Array:
        """Return the wrench by the sticks for a control period, shape (6,) [N, N m], body frame; 0 unless armed."""
        if not self.armed:
            return np.zeros(6)
        gain = self.settings["commands.pilot_gain"] if self._by_gain else 1.0
        if self.mode == "manual":
            wrench: Array = gain * self._manual * self._greatest_wrench
            return wrench
        sticks, attitude, rate = self._manual, self._attitude, None
        if attitude is not None and attitude.force is not None:
            sticks, gain, rate = np.array([*attitude.force, 0.0, 0.0, 0.0]), 1.0, attitude.rate_down
        return self._stabilizer.wrench(sticks, gain, self.mode == "depth_hold", rate)

    def apply(self, command: cmd.Command, time: float) -> None:
        """Apply a command at the beginning of a step; one that is invalid is logged and changes nothing; time [s]."""
        was_automatic = self.automatic_control
        try:
            self._dispatch(command, time)
        except CommandError as error:
            log.warning("%s: %s", type(command).__name__.lower(), error)
        self.control_regained |= self.automatic_control and not was_automatic

    def _dispatch(self, command: cmd.Command, time: float) -> None:
        match command:
            case cmd.Arm():
                self.armed = command.armed
                self._release()
            case cmd.SetMode():
                self._set_mode(command.mode, time)
            case cmd.SetTarget():
                self._environment.set_target(command.position, command.radius, command.velocity, time)
                self._environment.save_target()
                self.mode = "reach"
                self._release()
            case cmd.SetHeading():
                self.heading, self.turned = command.heading, True
            case cmd.SetDepth():
                self._stabilizer.target_depth = command.depth
            case cmd.ManualControl():
                self._manual[:], self._by_gain = command.wrench, command.by_gain
            case cmd.SetAttitude():
                if self._attitude is None:
                    self._stabilizer.begin()
                self._attitude = command if command.quaternion is not None else None
                self._stabilizer.attitude = None if command.quaternion is None else np.array(command.quaternion)
            case cmd.AddObstacle() | cmd.RemoveObstacle() | cmd.ShiftRegion():
                self._move_regions(command, time)
            case cmd.ChangeSetting():
                self.settings.change(command.key, command.value)
                self.changed = True
                self._apply_setting(command.key)
            case cmd.SetMission():
                self._mission.set_items(command.items)
                if self.mode == "mission":
                    self._set_mode("hold", time)
            case cmd.SetCurrentItem():
                self._mission.begin(command.item)
                if self.mode == "mission":
                    self._resume(time)
            case cmd.Reset():
                self.reset = True
            case _:
                assert_never(command)

    def _move_regions(self, command: cmd.AddObstacle | cmd.RemoveObstacle | cmd.ShiftRegion, time: float) -> None:
        match command:
            case cmd.AddObstacle():
                slot = self._slots.assign(command.number)
                self._environment.add_obstacle(slot, command.position, command.radius, command.velocity, time)
            case cmd.RemoveObstacle():
                left = self._slots.release(command.number)
                if left is not None:
                    self._environment.remove_obstacle(left)
            case cmd.ShiftRegion():
                self._environment.shift_region(command.region, command.by)

    def mark_applied(self) -> None:
        """Clear `control_regained`, `turned` and `changed`, once the master has applied them."""
        self.control_regained = self.turned = self.changed = False

    def _apply_setting(self, key: str) -> None:
        """Apply a changed setting to regions or actuation; gains of the law and the arbiter's ramp are the master's."""
        settings, region = self.settings, self.settings.region_of(key)
        if region is not None and key.endswith(".gain"):
            self._environment.set_gain(region, settings[key])
        elif region is not None:
            self._environment.set_shape(region, settings.shapes[region])
        elif key in settings.of_plant:
            self._limits.set(settings.of_plant[key], settings[key])

    def _set_mode(self, mode: cmd.Mode, time: float) -> None:
        north, east, down = (float(x) for x in self._state.position)
        radius = self.settings["commands.hold_radius"]
        if mode in ("hold", "surface") and not all(map(math.isfinite, (north, east, down))):
            raise CommandError(f"mode {mode} needs a position, and none is known")
        if mode == "mission" and not self._mission.items:
            raise CommandError("mode mission: there is no mission")
        self.mode = mode
        self._release()
        match mode:
            case "hold":
                self._environment.set_target((north, east, down), radius)
            case "surface":
                self._environment.set_target((north, east, self.settings["commands.surface_depth"]), radius)
            case "reach":
                self._environment.restore_target(time)
            case "mission":
                self._mission.enter(max(self._mission.at, 0))
                self._resume(time)

    def _release(self) -> None:
        """Clear sticks and attitude; the stabilizer keeps the present heading and depth, and levels."""
        self._manual[:], self._attitude = 0.0, None
        self._stabilizer.begin()

    def _resume(self, time: float) -> None:
        """Continue the present mission item from the vehicle's present position."""
        region, item = self._mission.region(), self._mission.items[self._mission.at]
        if region is not None and region is not item:
            self._set_target_of(region)
        self._begin(item, time)

    def _begin(self, item: cmd.MissionItem, time: float) -> None:
        self._set_target_of(item)
        for command in item.commands:
            self.apply(command, time)

    def _set_target_of(self, item: cmd.MissionItem) -> None:
        if item.position is not None:
            self._environment.set_target(item.position, item.radius)

    def update(self, time: float, clearance: float) -> bool:
        """Write the outputs, and begin the next mission item once the present one is done; time [s], clearance [m]."""
        following = None
        if self.armed and self.mode == "mission":
            following = self._mission.following(time, clearance)
        if following is not None:
            self._begin(self._mission.enter(following), time)
        self._out[0], self._out[1], self._out[2] = self.armed, cmd.MODES.index(self.mode), self._mission.at
        self._out[3:6], self._out[6] = self._environment.target, self._environment.target_radius
        return following is not None


def greatest_wrench(vehicle: Vehicle) -> Array:
    """Return the maximum wrench along and about each axis, in both directions, by least-norm allocation [N, N m]."""
    inverse = np.linalg.pinv(vehicle.thruster_matrix)
    limit = np.minimum(-vehicle.thrust_min, vehicle.thrust_max)
    result = np.zeros(6)
    undriven = undriven_axes(vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max)
    for axis in set(range(6)).difference(undriven):
        share = np.abs(inverse[:, axis])
        used = share > 1e-9 * max(1e-300, float(np.max(np.abs(inverse))))
        if np.any(used):
            result[axis] = float(np.min(limit[used] / share[used]))
    return result
