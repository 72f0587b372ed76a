"""The entry of a format of logs: suffixes, reader, and requirements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cosim.logs.column_map import ColumnMap
from cosim.logs.spool import LogContents

Moved = Callable[[float], None]  # receives the fraction of the log read so far, 0 to 1


@dataclass(frozen=True)
class LogFormat:
    """A format of logs; each module of `cosim.logs.formats` has one as ``FORMAT``."""

    suffixes: tuple[str, ...]  # suffixes of its files, in small letters
    # ``read(path, columns, contents, moved)`` reads a log into `contents`; `columns` is None for self-describing
    # messages, and `moved` receives the fraction read so far. It imports optional packages itself, and raises
    # ImportLogError if the file is no such log
    read: Callable[[Path, ColumnMap | None, LogContents, Moved], None]
    mapped: bool = False  # true if it takes a column map
    folder: bool = False  # true if a log may be a folder of such files
    needs: tuple[str, ...] = ()  # packages beyond the base installation, as requirements of pip
