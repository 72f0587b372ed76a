"""MCAP: signals as Protobuf messages, and the scene for Foxglove."""

from __future__ import annotations

from pathlib import Path

from cosim.export.excerpt import Excerpt
from cosim.export.format import Format


def write(excerpt: Excerpt, path: Path) -> list[Path]:
    """Write the file, as `cosim.export.mcap_writer.write`."""
    from cosim.export.mcap_writer import write as write_mcap

    return write_mcap(excerpt, path)


FORMAT = Format(
    write, needs=("foxglove-schemas-protobuf>=0.3", "mcap>=1.2", "mcap-protobuf-support>=0.5", "protobuf>=4.25")
)
