"""TLOG: the run as a vehicle's telemetry, as `cosim mavlink stream` sends it."""

from __future__ import annotations

from pathlib import Path

from cosim.errors import ExportError
from cosim.export.excerpt import Excerpt
from cosim.mavlink.stream_record import stream_record
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.options import MavlinkOptions


def write(excerpt: Excerpt, path: Path) -> list[Path]:
    """Write the file."""
    done = stream_record(excerpt.run.folder, [Endpoint("tlog", path.name, path=str(path))], MavlinkOptions(), rate=None)
    if done.loss_reports:
        raise ExportError(f"--to tlog: not all was written: {'; '.join(done.loss_reports)}")
    return [path]
