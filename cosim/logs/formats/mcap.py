"""Bags of ROS 2 in MCAP files, by mcap-ros2-support; a column map names topics and fields."""

from __future__ import annotations

import contextlib
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import ImportLogError
from cosim.logs.clocks import Clock
from cosim.logs.column_map import ColumnMap, TimeColumn
from cosim.logs.format import LogFormat, Moved
from cosim.logs.frames import UNITS
from cosim.logs.spool import LogContents
from plant_fmu.toml_tables import hint

_LARGEST = 1 << 28  # bytes of a record
_WAITING = 4096  # messages of a quantity that are written together
_PART = re.compile(r"\.?([A-Za-z_]\w*)|\[(\d+)\]")
_FAILURES = (
    ValueError,
    KeyError,
    IndexError,
    struct.error,
    UnicodeDecodeError,
    EOFError,
    OSError,
    AttributeError,
    RuntimeError,
)

Getter = Callable[[Any], float]


def read(path: Path, columns: ColumnMap | None, contents: LogContents, moved: Moved) -> None:
    """Read a bag, as specified by `LogFormat`; raise ImportLogError for another file, or a missing topic or field."""
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader
    from mcap_ros2.decoder import DecoderFactory
    from zstandard import ZstdError

    assert columns is not None
    nameless = next((name for name, mapped in columns.quantities.items() if not mapped.topic), None)
    if nameless is not None:
        raise ImportLogError(f"the map says no topic for [{nameless}], expected topic and columns")
    takers: dict[str, list[_Taker]] = {}
    for name, mapped in columns.quantities.items():
        takers.setdefault(mapped.topic, []).append(_Taker(columns, name, contents))
    total, clock, factory = max(1, path.stat().st_size), Clock(), DecoderFactory()
    topics: set[str] = set()
    with path.open("rb") as file:
        # sequentially: the index at its end is missing if the recorder was killed
        reader = NonSeekingReader(file, record_size_limit=_LARGEST)
        try:
            for schema, channel, message in reader.iter_messages(log_time_order=False):
                topics.add(channel.topic)
                if channel.topic not in takers:
                    contents.unread[channel.topic] += 1
                    continue
                decode = factory.decoder_for(channel.message_encoding, schema)
                if decode is None:
                    raise ImportLogError(f"{channel.topic}: encoding {channel.message_encoding!r}, expected 'cdr'")
                decoded, written = decode(message.data), clock.time(message.log_time * 1e-9)
                for taker in takers[channel.topic]:
                    taker.take(decoded, written)
                moved(file.tell() / total)
        except (McapError, ZstdError, *_FAILURES) as error:
            if not topics:
                raise ImportLogError(f"cannot be read as a bag: {error}") from error
            contents.remarks.append(f"The bag breaks off: {error or type(error).__name__}"[:200])
    missing = sorted(set(takers) - topics)
    if missing:
        raise ImportLogError(f"has no topic {missing[0]!r}, which the map names; {hint(missing[0], topics)}")
    for taker in (taker for several in takers.values() for taker in several):
        taker.flush()
    for _, by in clock.jumps:
        contents.remarks.append(f"The clock of the bag's writer jumps by {by:+.4g} s: it is taken as a pause of 1 s.")


class _Taker:
    """Read the fields of a quantity from messages."""

    def __init__(self, columns: ColumnMap, name: str, contents: LogContents) -> None:
        self._columns, self._name, self._contents = columns, name, contents
        self._mapped = columns.quantities[name]
        self._getters = [_getter(column, self._mapped.topic) for column in self._mapped.columns]
        time = columns.time_of(name)
        self._stamp = None if time is None else _stamp_getter(time, self._mapped.topic)
        self._clock = Clock()
        self._rows: list[list[float]] = []

    def take(self, message: Any, written: float) -> None:
        """Add a message."""
        at = written if self._stamp is None else self._clock.time(self._stamp(message))
        self._rows.append([at, *(get(message) for get in self._getters)])
        if len(self._rows) >= _WAITING:
            self.flush()

    def flush(self) -> None:
        """Write the collected samples."""
        if self._rows:
            rows = np.array(self._rows)
            self._rows = []
            self._columns.put(self._contents, self._name, rows[:, 0], rows[:, 1:])


def _walk(path: str, topic: str) -> Callable[[Any], Any]:
    """Return a function from a message to its field at a path, such as ``pose.position.x`` or ``data[3]``."""
    parts: list[str | int] = []
    at = 0
    while at < len(path):
        part = _PART.match(path, at)
        if part is None:
            raise ImportLogError(
                f"field {path!r} of {topic} is no path, expected one such as pose.position.x or data[3]"
            )
        parts.append(part[1] if part[1] is not None else int(part[2]))
        at = part.end()

    def find(message: Any) -> Any:
        for part in parts:
            try:
                message = message[part] if isinstance(part, int) else getattr(message, part)
            except (AttributeError, IndexError, TypeError) as error:
                fields = [name for name in getattr(message, "__slots__", ()) if not name.startswith("_")]
                known = f"; {hint(str(part), fields)}" if fields else ""
                raise ImportLogError(f"{topic} has no field {path!r}: nothing is at {part!r}{known}") from error
        return message

    return find


def _getter(path: str, topic: str) -> Getter:
    find = _walk(path, topic)

    def get(message: Any) -> float:
        value = find(message)
        with contextlib.suppress(TypeError, ValueError):
            return float(value)
        raise ImportLogError(f"{topic}: {path} is {type(value).__name__}, expected a number")

    return get


def _stamp_getter(time: TimeColumn, topic: str) -> Getter:
    """Return a function from a message to its own time [s]: a field of seconds and nanoseconds, or a number."""
    find = _walk(time.column, topic)

    def stamp(message: Any) -> float:
        value = find(message)
        if hasattr(value, "nanosec"):
            return float(value.sec + 1e-9 * value.nanosec)
        return float(value) * UNITS["s"].get(time.unit, 1.0)

    return stamp


FORMAT = LogFormat((".mcap",), read, mapped=True, needs=("mcap>=1.2", "mcap-ros2-support>=0.5"))
