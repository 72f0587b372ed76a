"""What a micro-service is: the messages and the commands that it handles, and what it does as time goes on."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext
from cosim.mavlink.wire.encode import whole
from cosim.scenario.tables import Vector3

Handler = Callable[[Sender, Any], None]

_E7, _E4 = 1e-7, 1e-4
_GLOBAL = (0, 5)  # MAV_FRAME_GLOBAL, GLOBAL_INT
_RELATIVE = (3, 6)  # MAV_FRAME_GLOBAL_RELATIVE_ALT, and its INT
_LOCAL_NED = 1


@dataclass(frozen=True)
class Call:
    """A command, whichever message it came in.

    Attributes
    ----------
    numbers : tuple of float
        Parameters 1 to 7; those that a client leaves out are NaN, or 0.
    frame : int
        MAV_FRAME of 5 to 7; global, where the message does not say.
    """

    sender: Sender
    number: int
    numbers: tuple[float, ...]
    frame: int

    def __getitem__(self, i: int) -> float:
        """Return parameter `i`, from 1."""
        return self.numbers[i - 1]

    def whole(self, i: int) -> int | None:
        """Return parameter `i`, from 1, as an integer, or None if it is no finite number."""
        return whole(self.numbers[i - 1])


Command = Callable[[Call], int]  # returns MAV_RESULT


class Service:
    """A micro-service.

    Parameters
    ----------
    context : VehicleContext
        Whom it serves.

    Attributes
    ----------
    messages : mapping of str to callable
        What it does with the messages of a name.
    commands : mapping of int to callable
        What it does for a MAV_CMD.
    """

    messages: Mapping[str, Handler]
    commands: Mapping[int, Command]

    def __init__(self, context: VehicleContext) -> None:
        self.context = context
        self.messages = {}
        self.commands = {}

    def tick(self) -> None:
        """Do what goes by the wall clock, `context.now`."""

    def on_snapshot(self) -> None:
        """Do what a new snapshot asks for."""

    def restart(self) -> None:
        """Forget what belongs to a run, as at its beginning."""


def place_of(context: VehicleContext, frame: int, x: float, y: float, z: float) -> Vector3 | None:
    """Return a place that a station names as a position [m, NED]; NaN where it is not finite.

    Parameters
    ----------
    context : VehicleContext
        Where the globe's frame is.
    frame : int
        MAV_FRAME.
    x, y, z : float
        Latitude and longitude [deg] and altitude [m], over the sea or over home; or north, east, down [m].

    Returns
    -------
    tuple of float or None
        None for a frame that is not known here.
    """
    if frame == _LOCAL_NED:
        position = x, y, z
    elif frame in _GLOBAL:
        position = context.frame.to_local(x, y, z)
    elif frame in _RELATIVE:
        north, east, _ = context.frame.to_local(x, y, 0.0)
        position = north, east, -z  # home is at the surface
    else:
        return None
    north, east, down = (v if math.isfinite(v) else math.nan for v in position)
    return north, east, down


def unscaled(frame: int, x: int, y: int) -> tuple[float, float]:
    """Return the integers of a place as degrees, or as metres in a local frame."""
    scale = _E4 if frame == _LOCAL_NED else _E7
    return x * scale, y * scale
