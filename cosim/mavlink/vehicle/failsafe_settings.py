"""What can be said of the watch over the ground station, numbered as ArduSub's parameters have it."""

from __future__ import annotations

from cosim.mavlink.wire.options import LossAction

ACTIONS: tuple[LossAction, ...] = ("none", "warn", "disarm", "hold", "surface")  # by the value of FS_GCS_ENABLE
TIMEOUTS = (1.0, 120.0)  # s, of FS_GCS_TIMEOUT
