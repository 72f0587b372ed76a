"""Formats of logs, one module each, with a function ``read``.

To add a format, add a module to this folder, and its suffixes to `FORMATS`.

Imports: logs.cleaning, mavlink.wire, plant_fmu, simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cosim.logs.bag_storage import SUFFIXES
from cosim.logs.column_map import ColumnMap
from cosim.logs.formats import bag, dataflash, table, tlog, ulog
from cosim.logs.records import OnProgress
from cosim.logs.spool import LogContents

__all__ = ["FORMATS", "LogFormat"]


@dataclass(frozen=True)
class LogFormat:
    """A format of logs."""

    # ``read(path, columns, contents, on_progress)`` reads a log into `contents`; `columns` is None for self-describing
    # messages. It imports optional packages itself, and raises ImportLogError if the file is no such log
    read: Callable[[Path, ColumnMap | None, LogContents, OnProgress], None]
    takes_map: bool = False
    columns: Callable[[Path], Sequence[str]] | None = None  # columns of a table; None for messages
    needs: tuple[str, ...] = ()  # packages beyond the base installation, as requirements of pip


BAGS = LogFormat(bag.read, takes_map=True, needs=("mcap>=1.2", "rosbags>=0.11.6"))  # a log may be a folder of them
FORMATS = {  # by suffix, in small letters
    ".bin": LogFormat(dataflash.read), ".tlog": LogFormat(tlog.read), ".ulg": LogFormat(ulog.read),
    **dict.fromkeys((".csv", ".parquet"), LogFormat(table.read, takes_map=True, columns=table.column_names)),
    **dict.fromkeys(SUFFIXES, BAGS),
}  # fmt: skip
