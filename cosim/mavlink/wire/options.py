"""What a user says of the vehicle's MAVLink side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

ProfileName = Literal["ardusub", "px4", "generic"]
LossAction = Literal["none", "warn", "hold", "surface", "disarm"]

PROFILES: tuple[ProfileName, ...] = get_args(ProfileName)
LOSS_ACTIONS: tuple[LossAction, ...] = get_args(LossAction)
ORIGIN = (55.9097, -3.3203)  # deg, latitude and longitude of position 0 where nothing else is said


@dataclass(frozen=True)
class MavlinkOptions:
    """How the vehicle shows itself, and whom it heeds.

    Examples
    --------
    >>> import cosim
    >>> cosim.MavlinkOptions(commands=True).loss_action
    'warn'
    """

    profile: ProfileName = "generic"
    commands: bool = False  # heed commands, set-points, parameter and mission writes; otherwise they are refused
    key: bytes | None = None  # 32 bytes, to sign with; then whatever comes must be signed with it too
    allowed_systems: frozenset[int] | None = None  # system ids that are heeded; None: all
    system_id: int = 1
    origin: tuple[float, float] = ORIGIN  # deg, latitude and longitude of position 0, at the surface
    loss_action: LossAction = "warn"  # when the ground station that commands falls silent
    loss_timeout: float = 5.0  # s of the wall clock
