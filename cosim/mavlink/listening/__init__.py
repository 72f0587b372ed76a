"""Any vehicle's telemetry as a live table."""

from cosim.mavlink.listening.follow import follow
from cosim.mavlink.listening.picture import picture
from cosim.mavlink.listening.watch import Watch

__all__ = ["Watch", "follow", "picture"]
