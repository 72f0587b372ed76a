"""The entry of a format of logs: all that the software knows of it, in one place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cosim.logs.column_map import ColumnMap
from cosim.logs.spool import LogContents

Moved = Callable[[float], None]  # gets how much of the log has been read, 0 to 1


@dataclass(frozen=True)
class LogFormat:
    """What a module of `cosim.logs.formats` says of its format, as ``FORMAT``.

    Parameters
    ----------
    suffixes : tuple of str
        Of its files, in small letters.
    read : callable
        ``read(path, columns, contents, moved)`` reads a log into `contents`; `columns` is None where messages say what
        they are, and `moved` gets how much has been read. It imports what the base installation does not bring, and
        raises ImportLogError if the file is no such log.
    mapped : bool
        Whether a column map says what its columns are; otherwise it takes none.
    needs : tuple of str
        What it imports beyond the base installation, as requirements of pip.
    """

    suffixes: tuple[str, ...]
    read: Callable[[Path, ColumnMap | None, LogContents, Moved], None]
    mapped: bool = False
    needs: tuple[str, ...] = ()
