"""The user's options of a companion flight."""

from __future__ import annotations

from dataclasses import dataclass, field

from cosim.companion.frame_alignment import SceneOrigin
from cosim.companion.outputs import SteerBy
from cosim.companion.sticks import SticksBy
from cosim.mavlink.wire.options import ProfileName


@dataclass(frozen=True)
class CompanionOptions:
    """How the vehicle is steered, and what it must do for that.

    Examples
    --------
    >>> import cosim
    >>> cosim.CompanionOptions(dry_run=True).steer_by
    'sticks'
    """

    profile: ProfileName = "ardusub"
    # sticks: surge, sway, heave, yaw in STABILIZE; wrench: all six in MANUAL; velocity; attitude, with forces
    steer_by: SteerBy = "sticks"
    sticks_by: SticksBy = "manual-control"
    origin: SceneOrigin = field(default_factory=SceneOrigin)
    dry_run: bool = False  # compute and record, and send nothing
    arm: bool = False  # arm the vehicle; otherwise that is the pilot's
    pilot_gain: float = 0.5  # part of the greatest wrench that full sticks give; ArduSub's JS_GAIN_DEFAULT
    velocity_lag: float = 2.0  # s, of the autopilot's velocity loop, horizontally
    vertical_lag: float = 0.5  # s, likewise
    reckoning_error: float = 0.03  # part of the way by which a position without a fix may be off
    level_dive: float = 0.6  # m, depth of an ArduSub's dive after arming, before it is steered; 0 for none
    least_battery: float = 0.0  # percent, below which it is held
    timeout: float | None = None  # s, within which steering must begin
