"""Values of the ground station failsafe's settings, as in ArduSub's parameters."""

from __future__ import annotations

from cosim.mavlink.wire.options import LossAction

ACTIONS: tuple[LossAction, ...] = ("none", "warn", "disarm", "hold", "surface")  # by the value of FS_GCS_ENABLE
TIMEOUTS = (1.0, 120.0)  # s, of FS_GCS_TIMEOUT
