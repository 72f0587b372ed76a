"""Options of the vehicle's MAVLink links."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

ProfileName = Literal["ardusub", "px4", "generic"]
LossAction = Literal["none", "warn", "hold", "surface", "disarm"]

PROFILES: tuple[ProfileName, ...] = get_args(ProfileName)
LOSS_ACTIONS: tuple[LossAction, ...] = get_args(LossAction)
COMPONENT_ID = 1  # MAV_COMP_ID_AUTOPILOT1, the only component that ground stations accept as a vehicle
ORIGIN = (55.9097, -3.3203)  # deg, default latitude and longitude of position 0


@dataclass(frozen=True)
class MavlinkOptions:
    """Profile, identity, origin, failsafe, and accepted input of the vehicle.

    Examples
    --------
    >>> import cosim
    >>> cosim.MavlinkOptions(commands=True).loss_action
    'warn'
    """

    profile: ProfileName = "generic"
    commands: bool = False  # accept commands, set-points, parameter and mission writes; otherwise refuse them
    key: bytes | None = None  # 32 bytes, signing key; unsigned input is then refused
    allowed_systems: frozenset[int] | None = None  # system ids that are accepted; None: all
    system_id: int = 1
    origin: tuple[float, float] = ORIGIN  # deg, latitude and longitude of position 0, at the surface
    loss_action: LossAction = "warn"  # when the commanding ground station falls silent
    loss_timeout: float = 5.0  # s of the wall clock
