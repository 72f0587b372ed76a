"""Which log of a run is of which format, and holds which quantities of the column map."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatch
from pathlib import Path

from cosim.errors import ImportLogError
from cosim.logs.column_map import ColumnMap, MappedQuantity, read_map
from cosim.logs.formats import BAGS, FORMATS, LogFormat

_OTHER_FILES = {  # first bytes of files that are no logs
    b"version https://git-lfs": "is a pointer of Git LFS, expected the log itself: git lfs pull",
    b"<!doctype html": "is a web page, expected a log: download the file itself",
    b"<html": "is a web page, expected a log: download the file itself",
    b"pk\x03\x04": "is a zip archive, expected a log: unpack it",
    b"\x1f\x8b": "is compressed by gzip, expected a log: gunzip it",
    b"7z\xbc\xaf": "is a 7z archive, expected a log: unpack it",
}


def format_of(path: Path) -> LogFormat:
    """Return the format of a log by its suffix; raise ImportLogError with the reason for what is none."""
    if path.is_dir():
        return BAGS
    form = FORMATS.get(path.suffix.lower())
    if form is None:
        raise ImportLogError(f"ends in {path.suffix!r}, expected one of {', '.join(sorted(FORMATS))}")
    if not path.is_file():
        raise ImportLogError("is a device, expected a file" if path.exists() else "no such file")
    with path.open("rb") as file:
        head = file.read(64).lower()
    if not head:
        raise ImportLogError("is empty, expected a log")
    for mark, reason in _OTHER_FILES.items():
        if head.lstrip().startswith(mark):
            raise ImportLogError(reason)
    return form


def assign_quantities(paths: Sequence[Path], map_file: Path | None) -> list[tuple[Path, ColumnMap | None]]:
    """Return each log with its part of the column map, None for one that needs no map."""
    if map_file is None:
        return [(path, None) for path in paths]
    logs = {path: format_of(path) for path in paths}
    names: dict[Path, set[str]] = {path: set() for path, form in logs.items() if form.takes_map}
    if not names:
        raise ImportLogError("a column map is given, expected none: its messages say what they are")
    columns = read_map(map_file)
    for quantity, mapped in columns.quantities.items():
        names.setdefault(_log_of(quantity, mapped, paths[0], [*names]), set()).add(quantity)
    idle = next((path for path, own in names.items() if not own), None)
    if idle is not None:
        raise ImportLogError(f"no table of the map has its columns in {idle.name}, expected some in each log")
    others = [(path, None) for path, form in logs.items() if not form.takes_map]
    return [*others, *((path, columns.only(own)) for path, own in names.items())]


def _log_of(quantity: str, mapped: MappedQuantity, first: Path, logs: Sequence[Path]) -> Path:
    """Return the log that holds a quantity: by its table's pattern, also beside the first log, or by its columns."""
    if mapped.file:
        matches = [path for path in logs if fnmatch(path.name.lower(), mapped.file.lower())]
        if not matches:
            matches = [path for path in first.parent.iterdir() if fnmatch(path.name.lower(), mapped.file.lower())]
        if len(matches) != 1:
            listed = ", ".join(sorted(path.name for path in matches)[:3]) or "none"
            raise ImportLogError(
                f"[{quantity}] has file = {mapped.file!r}, expected the name of one log (got {listed})"
            )
        return matches[0]
    for path in logs if len(logs) > 1 else ():
        readable = format_of(path).columns
        if bool(mapped.topic) == (readable is None) and (readable is None or {*mapped.needs} <= {*readable(path)}):
            return path
    return logs[0]
