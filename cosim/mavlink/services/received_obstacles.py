"""Obstacles that other systems detect: OBSTACLE_DISTANCE_3D."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from cosim.mavlink.services.service import Service
from cosim.mavlink.vehicle.row_layout import quaternion_to_euler
from cosim.mavlink.vehicle.vehicle_context import Result, Sender, VehicleContext
from cosim.scenario.region_tables import Vector3
from cosim.simulation.commands.commands import AddObstacle, RemoveObstacle

_MIN_MOVE = 0.05  # m, displacement below which no command is submitted
_REPLACE_TIMEOUT = 5.0  # s of the wall clock without a message, after which another obstacle may replace it
_LOCAL_NED, _BODY_FRD, _LOCAL_FRD = 1, 12, 20
_RADIUS = "commands.obstacle_radius"


@dataclass
class _AddedObstacle:
    """An obstacle that was added by a command."""

    position: Vector3  # m, NED
    radius: float  # m
    received: float  # s, wall clock at the last message about it


class ReceivedObstacles(Service):
    """Add each obstacle as a sphere to keep out of, about the received point."""

    # In LOCAL_FRD forward is the vehicle's heading at time 0.

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        self._first_yaw = quaternion_to_euler(context.scenario.initial.quaternion)[2]
        self.restart()

    def restart(self) -> None:
        """Forget all obstacles."""
        self._added: dict[int, _AddedObstacle] = {}

    def _receive_obstacle_distance_3d(self, sender: Sender, message: Any) -> None:
        context = self.context
        if self.rejects_commands():
            return
        position = self._position(message.frame, (message.x, message.y, message.z))
        if position is None:
            context.reject(f"obstacle in frame {message.frame}; expected 1, 12 or 20", "frame")
            return
        if not all(map(math.isfinite, position)):
            return
        number, radius = message.obstacle_id, context.settings[_RADIUS]
        added = self._added.get(number)
        if added is not None and added.radius == radius and math.dist(added.position, position) < _MIN_MOVE:
            added.received = context.now
            return
        if added is None and not self._has_room():
            context.reject(f"no room for obstacle {number}: there are {len(self._added)} already", "obstacle")
            return
        if context.submit(AddObstacle(number, position, radius)) == Result.ACCEPTED:
            self._added[number] = _AddedObstacle(position, radius, context.now)

    def _position(self, frame: int, point: Vector3) -> Vector3 | None:
        view = self.context.view
        if frame == _LOCAL_NED:
            return point
        if frame == _BODY_FRD:
            north, east, down = (a + b for a, b in zip(view.position_ned, view.to_world(point), strict=True))
            return north, east, down
        if frame == _LOCAL_FRD:
            sine, cosine = math.sin(self._first_yaw), math.cos(self._first_yaw)
            ahead, right, down = point
            return ahead * cosine - right * sine, ahead * sine + right * cosine, down
        return None

    def _has_room(self) -> bool:
        """Return True if one more fits; to make room, remove the obstacle silent for longest, if for over 5 s."""
        context = self.context
        if len(self._added) < context.scenario.commands.obstacles:
            return True
        if not self._added:
            return False
        oldest = min(self._added, key=lambda number: self._added[number].received)
        if context.now - self._added[oldest].received < _REPLACE_TIMEOUT:
            return False
        if context.submit(RemoveObstacle(oldest)) != Result.ACCEPTED:
            return False
        del self._added[oldest]
        return True
