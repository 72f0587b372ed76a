"""Live table of a vehicle's telemetry.

The ground's side of a link, for `cosim mavlink listen`.

Imports: mavlink.wire.
"""

from cosim.mavlink.listening.follow import follow
from cosim.mavlink.listening.table_text import format_table
from cosim.mavlink.listening.telemetry_table import TelemetryTable

__all__ = ["TelemetryTable", "follow", "format_table"]
