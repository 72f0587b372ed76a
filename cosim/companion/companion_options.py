"""The user's options of a companion flight."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from cosim.companion.frame_alignment import SceneOrigin
from cosim.mavlink.wire.options import ProfileName
from cosim.simulation.commands.commands import Mode

SteerBy = Literal["sticks", "wrench", "velocity", "attitude"]
SticksBy = Literal["manual-control", "rc-override"]
_STEERING_MODES: dict[SteerBy, Mode] = {
    "sticks": "stabilize", "wrench": "manual", "velocity": "reach", "attitude": "reach",
}  # fmt: skip


@dataclass(frozen=True)
class CompanionOptions:
    """The output that steers the vehicle, the frame's origin, and the conditions of steering.

    Examples
    --------
    >>> import cosim
    >>> cosim.CompanionOptions(dry_run=True).steer_by
    'sticks'
    """

    profile: ProfileName = "ardusub"
    # sticks: surge, sway, heave, yaw in STABILIZE; wrench: all six axes in MANUAL; velocity; attitude, with forces
    steer_by: SteerBy = "sticks"
    sticks_by: SticksBy = "manual-control"
    origin: SceneOrigin = field(default_factory=SceneOrigin)
    dry_run: bool = False  # True to compute and record the law, and send no sticks, set-points, modes or arming
    arm: bool = False  # True to arm the vehicle; False leaves arming to the pilot
    pilot_gain: float = 0.5  # fraction of the maximum wrench that full sticks command; ArduSub's JS_GAIN_DEFAULT
    velocity_lag: float = 2.0  # s, horizontal lag of the autopilot's velocity loop
    vertical_lag: float = 0.5  # s, vertical lag of the autopilot's velocity loop
    reckoning_error: float = 0.03  # position error without a fix, as a fraction of the distance traveled
    level_dive: float = 0.6  # m, depth of an ArduSub's dive after arming, before it is steered; 0 for none
    least_battery: float = 0.0  # percent, remaining charge below which the vehicle is held
    timeout: float | None = None  # s, longest wait until steering begins; None: no limit
    # deg, global origin to set if the autopilot has none: where the vehicle was when it started
    global_origin: tuple[float, float] | None = None
    vehicle_system: int | None = None  # system id of the autopilot; None: the first one that is heard

    @property
    def uses_sticks(self) -> bool:
        """True if sticks are sent: to an ArduSub also with attitudes, whose set-points have no horizontal force."""
        return self.steer_by in ("sticks", "wrench") or (self.steer_by == "attitude" and self.profile == "ardusub")

    @property
    def steering_mode(self) -> Mode:
        """Mode in which the autopilot accepts the output."""
        with_depth = self.steer_by == "attitude" and self.profile == "ardusub"
        return "depth_hold" if with_depth else _STEERING_MODES[self.steer_by]
