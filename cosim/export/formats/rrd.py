"""RRD: signals and the scene for Rerun."""

from __future__ import annotations

from pathlib import Path

from cosim.export.excerpt import Excerpt
from cosim.export.format import Format


def write(excerpt: Excerpt, path: Path) -> list[Path]:
    """Write the file, as `cosim.export.rrd_writer.write`."""
    from cosim.export.rrd_writer import write as write_rrd

    return write_rrd(excerpt, path)


FORMAT = Format(write, needs=("rerun-sdk>=0.31",))
