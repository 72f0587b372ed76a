"""Export formats."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Format:
    """An export format."""

    # module with a function `write` that writes an excerpt of a run into a file, and returns the paths of the written
    # files, that file first; it is imported at its first use
    writer: str
    needs: tuple[str, ...] = ()  # packages beyond the base installation, as pip requirements
    beside: str = ""  # suffix of a second file; empty for none
    folder: frozenset[str] = frozenset()  # suffixes of the files of a format that is a folder
    fixed: tuple[str, ...] = ()  # selections that the format makes itself: signals, every, rate


_MCAP = ("foxglove-schemas-protobuf>=0.3", "mcap>=1.2", "mcap-protobuf-support>=0.5", "protobuf>=4.25")
FORMATS = {
    "csv": Format("cosim.export.csv_writer", beside=".units.csv"),
    "mcap": Format("cosim.export.mcap_writer", needs=_MCAP),
    "rrd": Format("cosim.export.rrd_writer", needs=("rerun-sdk>=0.31",)),
    "rosbag2": Format(
        "cosim.export.rosbag2_writer",
        needs=("rosbags>=0.11.6",),
        folder=frozenset({".db3", ".yaml"}),
        fixed=("signals",),
    ),
    "tlog": Format("cosim.export.tlog_writer", fixed=("signals", "every", "rate")),
}
