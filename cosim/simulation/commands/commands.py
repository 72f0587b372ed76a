"""Commands to a running vehicle. Each is a frozen value, and one line of JSON in a log."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, Literal, get_args

import msgspec
import numpy as np

from cosim.errors import CommandError
from plant_fmu.errors import TableError
from plant_fmu.toml_tables import Finite, Table, decode, key

Mode = Literal["manual", "hold", "reach", "mission", "surface", "stabilize", "depth_hold"]

MODES: tuple[Mode, ...] = get_args(Mode)  # a mode's index is its number in the record
STICK_MODES: tuple[Mode, ...] = ("manual", "stabilize", "depth_hold")  # manual control by sticks, without the law

JSON = msgspec.json.Decoder(float_hook=float)  # 1e999 is inf, which the check of its key refuses
NOT_A_COMMAND = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)  # raised by msgspec for an invalid text

# maximum coordinates and displacements, radii, velocities, and fractions of the maximum force or moment
_Length = Annotated[float, key("", "m", ge=-1e5, le=1e5)]
_Radius = Annotated[float, key("", "m", gt=0.0, le=1e5)]
_Speed = Annotated[float, key("", "m/s", ge=-1e2, le=1e2)]
_Fraction = Annotated[float, key("", ge=-1.0, le=1.0)]
_Position = tuple[_Length, _Length, _Length]
_Velocity = tuple[_Speed, _Speed, _Speed]
_Fractions = tuple[_Fraction, _Fraction, _Fraction]
_UNIT = 1e-2  # maximum deviation of a quaternion's length from 1


def _tag(name: str) -> str:
    """Return the name of a command in a log: ``set_mode`` for `SetMode`."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()


class _Command(Table, frozen=True, tag_field="command", tag=_tag):
    """Base of all commands; in the log, the key ``command`` holds the command's name."""


class Arm(_Command, frozen=True):
    """Arm or disarm: enable the thrusters, or stop them."""

    armed: bool


class SetMode(_Command, frozen=True):
    """Change the mode."""

    # `manual`, `hold` the present position, `reach` the target region, follow the `mission`, `surface`, `stabilize`
    # (manual, attitude kept), or `depth_hold` (manual, attitude and depth kept).

    mode: Mode


class SetTarget(_Command, frozen=True):
    """Move the target region, and reach it."""

    # With a radius the target is a sphere about `position` [m, NED]; otherwise the scenario's goal region, moved so
    # that its center is there. It travels from there at `velocity` [m/s, NED].

    position: _Position  # m, NED
    radius: _Radius | None = None  # m
    velocity: _Velocity = (0.0, 0.0, 0.0)  # m/s, NED


class SetHeading(_Command, frozen=True):
    """Keep another attitude: level, with a heading [rad, from north to east]."""

    heading: Finite  # rad


class SetDepth(_Command, frozen=True):
    """Go to another depth and keep it, in the mode `depth_hold`, until the vertical stick moves."""

    depth: Finite  # m


class ManualControl(_Command, frozen=True):
    """Control manually: a fraction, from -1 to 1, of the maximum wrench along and about each body axis."""

    wrench: tuple[_Fraction, _Fraction, _Fraction, _Fraction, _Fraction, _Fraction]  # fractions, [-]
    by_gain: bool = True  # True: the pilot's gain scales the fractions


class SetAttitude(_Command, frozen=True):
    """Keep an attitude in the modes in which sticks steer, or with a force in place of the law while it reaches."""

    # Another mode, another target, or an attitude of None ends it.

    quaternion: tuple[float, float, float, float] | None  # unit quaternion from body to world, scalar first
    force: _Fractions | None = None  # fractions [-] of the maximum force along each body axis; None: the sticks'
    rate_down: _Speed | None = None  # m/s, of the depth, in place of a vertical force


class AddObstacle(_Command, frozen=True):
    """Keep out of a sphere about `position` [m, NED] that travels at `velocity` [m/s, NED]."""

    # The number of an obstacle that exists moves that obstacle.

    number: int
    position: _Position  # m, NED
    radius: _Radius  # m
    velocity: _Velocity = (0.0, 0.0, 0.0)  # m/s, NED


class RemoveObstacle(_Command, frozen=True):
    """Remove an obstacle that a command has added."""

    number: int


class ShiftRegion(_Command, frozen=True):
    """Move a region by the displacement `by` [m, NED]; its shape and velocity do not change."""

    region: str
    by: _Position  # m, NED


class ChangeSetting(_Command, frozen=True):
    """Change a number of the scenario during the run; `LiveSettings` lists the keys."""

    key: str
    value: Finite


class MissionItem(Table, frozen=True):
    """One item of a mission: a region to be reached, and how long to stay within it."""

    # An item without a position has no region: its commands are applied at once, and the target stays as it is.

    position: _Position | None  # m, NED
    radius: _Radius | None = None  # m, of a sphere; None: the scenario's goal region, moved there
    stay: Annotated[float, key("", "s", ge=0.0, le=1e9)] | None = (
        0.0  # s, within the region before the next item; None: forever
    )
    commands: tuple[SetHeading | ChangeSetting, ...] = ()  # applied when the item begins
    jump: Annotated[int, key("", ge=0)] | None = None  # index of the item that comes next instead, from 0
    times: Annotated[int, key("", ge=0)] | None = (
        None  # number of jumps, each time the mission is begun; None: no limit
    )


class SetMission(_Command, frozen=True):
    """Set the items of the mission, which the mode ``mission`` follows in order."""

    items: tuple[MissionItem, ...]


class SetCurrentItem(_Command, frozen=True):
    """Continue the mission with an item, from 0."""

    item: int


class Reset(_Command, frozen=True):
    """End this run, and begin it again from time 0."""


Command = (
    Arm
    | SetMode
    | SetTarget
    | SetHeading
    | SetDepth
    | ManualControl
    | SetAttitude
    | AddObstacle
    | RemoveObstacle
    | ShiftRegion
    | ChangeSetting
    | SetMission
    | SetCurrentItem
    | Reset
)


def validate_command(command: Command) -> Command:
    """Return a command with Python's numbers in place of NumPy's; raise a CommandError if one is out of range."""
    try:
        valid: Command = decode(msgspec.to_builtins(command, enc_hook=_to_builtin), type(command))
    except TableError as error:
        setting = f"{command.key}: " if isinstance(command, ChangeSetting) else ""
        raise CommandError(f"{setting}{error}") from error
    match valid:
        case SetAttitude(quaternion=q) if q is not None:
            _require(abs(math.hypot(*q) - 1.0) <= _UNIT, "quaternion", q, "four numbers of length 1")
        case SetMission():
            for item in valid.items:
                count = len(valid.items)
                _require(item.jump is None or item.jump < count, "jump", item.jump, f"0 to {count - 1}")
    return valid


def _to_builtin(value: Any) -> Any:
    """Convert a NumPy number or array; what JSON cannot hold becomes a text, which no number may be."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else repr(value)


def _require(ok: bool, key: str, received: object, expected: str) -> None:
    if not ok:
        raise CommandError(f"{key} is {received}, expected {expected}")
