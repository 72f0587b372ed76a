"""Bags of ROS 2 and ROS 1, decoded by rosbags; a column map names topics and fields."""

from __future__ import annotations

import contextlib
import re
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import ImportLogError
from cosim.logs.bag_records import StoredMessage
from cosim.logs.bag_storage import MAX_DECODED, bag_files, stored_messages
from cosim.logs.blueos import find_vehicle, read_recording
from cosim.logs.cleaning.clocks import Clock
from cosim.logs.column_map import ColumnMap
from cosim.logs.draft_map import missing_map
from cosim.logs.frames import UNITS
from cosim.logs.message_definitions import parse_definition, reachable_types
from cosim.logs.records import DAMAGE, OnProgress
from cosim.logs.spool import LogContents
from plant_fmu.toml_tables import hint

_MAX_FIELDS, _MAX_ELEMENTS = 64, 16  # listed of a topic and of an array, without a map
_BATCH_SIZE = 4096  # messages of a quantity that are written together
_PART = re.compile(r"\.?([A-Za-z_]\w*)|\[(\d+)\]")  # a field's name or an index in a path
_PATH = re.compile(f"({_PART.pattern})*")
_TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")  # types that definitions may omit

Getter = Callable[[Any], float]


def read(path: Path, columns: ColumnMap | None, contents: LogContents, on_progress: OnProgress) -> None:
    """Read a bag, as specified by `LogFormat`; raise ImportLogError for another file, or a missing topic or field."""
    if columns is None:
        recorded = all(file.suffix.lower() == ".mcap" for file in bag_files(path)) and find_vehicle(path)
        if recorded:
            read_recording(path, *recorded, contents, on_progress)
            return
        fields = _fields(path)
        if not fields:
            raise ImportLogError("holds no message, expected a bag with messages")
        raise missing_map(fields)
    without_topic = next((name for name, mapped in columns.quantities.items() if not mapped.topic), None)
    if without_topic is not None:
        raise ImportLogError(f"the map says no topic for [{without_topic}], expected topic and columns")
    readers: dict[str, list[_FieldReader]] = {}
    for name, mapped in columns.quantities.items():
        readers.setdefault(mapped.topic, []).append(_FieldReader(columns, name, contents))
    clock, decoder = Clock(), Decoder(columns.messages)
    topics: set[str] = set()
    for message in stored_messages(path, contents.remarks, on_progress):
        topics.add(message.topic)
        if message.topic not in readers:
            contents.unread[message.topic] += 1
            continue
        write_time = clock.time(message.time, message.topic)
        try:
            decoded = decoder.decode(message)
        except _undecodable():
            contents.unread[f"{message.topic} that cannot be decoded"] += 1
            continue
        for reader in readers[message.topic]:
            reader.add(decoded, write_time)
    missing = sorted(set(readers) - topics)
    if missing:
        raise ImportLogError(f"has no topic {missing[0]!r}, which the map names; {hint(missing[0], topics)}")
    for reader in (reader for group in readers.values() for reader in group):
        reader.flush()
    contents.remarks += clock.remarks("The clock of the bag's writer")


class Decoder:
    """Decode stored messages by their definitions: those of the bag, of a folder, or of ROS 2 Humble."""

    def __init__(self, folder: str) -> None:
        from rosbags.typesys import Stores, get_typestore

        self._standard = get_typestore(Stores.ROS2_HUMBLE).fielddefs
        self._own: dict[str, Any] = {}
        for path in sorted(Path(folder).rglob("*.msg")) if folder else ():
            package = path.parent.parent if path.parent.name == "msg" else path.parent
            try:
                self._own |= parse_definition(path.read_text("utf-8"), f"{package.name}/msg/{path.stem}", "ros2msg")
            except (ImportLogError, UnicodeDecodeError) as error:
                raise ImportLogError(f"messages: {path} is no message definition: {error}") from error
        self._decoders: dict[str, Callable[[bytes], Any]] = {}

    def decode(self, message: StoredMessage) -> Any:
        """Return a message with its fields as attributes."""
        if message.topic not in self._decoders:
            self._decoders[message.topic] = self._decoder(message)
        if len(message.data) > MAX_DECODED:
            raise ValueError("is too large")
        return self._decoders[message.topic](message.data)

    def _decoder(self, message: StoredMessage) -> Callable[[bytes], Any]:
        from rosbags.typesys import Stores, TypesysError, get_typestore

        if message.encoding not in ("cdr", "ros1"):
            raise ImportLogError(f"{message.topic}: encoding {message.encoding!r}, expected 'cdr'")
        types = self._standard | self._own
        if not message.definition and message.type not in types:
            raise ImportLogError(
                f"{message.topic} is of type {message.type}, which the bag does not define; expected in the map: "
                'messages = "FOLDER", which holds the .msg files of its package'
            )
        try:
            if message.definition:
                types = {name: self._standard[name] for name in _TIMES}
                types |= parse_definition(message.definition, message.type, message.language)
            reachable = reachable_types(types, message.type, 1 if message.encoding == "cdr" else 0)
            store = get_typestore(Stores.EMPTY)
            store.register(reachable)
            for name in reachable:  # else rosbags would make its code again for each message that it cannot decode
                store.get_msgdef(name)
        except ImportLogError as error:
            raise ImportLogError(f"{message.topic}: the definition of its type {error}") from error
        except (TypesysError, NameError, SyntaxError, *DAMAGE) as error:
            raise ImportLogError(f"{message.topic}: the definition of its type cannot be used: {error}") from error
        method = store.deserialize_ros1 if message.encoding == "ros1" else store.deserialize_cdr
        return lambda data: method(data, message.type)


class _FieldReader:
    """Read the fields of a quantity from messages."""

    def __init__(self, columns: ColumnMap, name: str, contents: LogContents) -> None:
        self._columns, self._name, self._contents = columns, name, contents
        mapped, time = columns.quantities[name], columns.time_of(name)
        self._getters = [_getter(column, mapped.topic, "a number", _number) for column in mapped.needs]
        self._mapped = mapped
        self._stamp = None
        if time is not None:
            factor = UNITS["s"].get(time.unit, 1.0)
            self._stamp = _getter(time.column, mapped.topic, "a time", lambda value: _seconds(value, factor))
        self._clock = Clock()
        self._rows: list[list[float]] = []

    def add(self, message: Any, write_time: float) -> None:
        """Add a message, written at a time [s]."""
        time = write_time if self._stamp is None else self._clock.time(self._stamp(message))
        self._rows.append([time, *(get(message) for get in self._getters)])
        if len(self._rows) >= _BATCH_SIZE:
            self.flush()

    def flush(self) -> None:
        """Write the collected samples."""
        if self._rows:
            rows = np.array(self._rows)
            self._rows = []
            values = rows[:, 1 : 1 + len(self._mapped.columns)]
            is_valid = self._mapped.is_valid(values, rows[:, -1] if self._mapped.valid else None)
            self._columns.put(self._contents, self._name, rows[:, 0], values, is_valid)


def _fields(path: Path) -> dict[str, dict[str, float]]:
    """Return the fields with numbers of each topic, with the messages per second."""
    counts, times, fields = Counter[str](), dict[str, list[float]](), dict[str, list[str]]()
    decoder = Decoder("")
    for message in stored_messages(path, [], lambda fraction: None):
        if message.topic not in fields:
            fields[message.topic] = []
            with contextlib.suppress(ImportLogError, *_undecodable()):
                fields[message.topic] = list(islice(_numbers(decoder.decode(message), ""), _MAX_FIELDS))
        counts[message.topic] += 1
        times.setdefault(message.topic, [message.time, message.time])[1] = message.time
    rates = {topic: (counts[topic] - 1) / max(end - start, 1e-9) for topic, (start, end) in times.items()}
    return {topic: dict.fromkeys(names, rates[topic]) for topic, names in fields.items()}


def _numbers(value: Any, path: str) -> Iterator[str]:
    """Yield the paths of the numbers of a message, without those of its header and its covariances."""
    if isinstance(value, int | float | np.number):
        yield path
    elif isinstance(value, list | tuple | np.ndarray):
        for i, element in enumerate(value[:_MAX_ELEMENTS]):
            yield from _numbers(element, f"{path}[{i}]")
    for name in getattr(value, "__dataclass_fields__", ()):
        if name not in ("header", "stamp") and "covariance" not in name and not name.startswith("_"):
            yield from _numbers(getattr(value, name), f"{path}.{name}".lstrip("."))


def _undecodable() -> tuple[type[Exception], ...]:
    """Return the exceptions of a message that cannot be decoded."""
    from rosbags.serde import SerdeError

    return (SerdeError, *DAMAGE)


def _getter(path: str, topic: str, what: str, convert: Getter) -> Getter:
    """Return a function from a message to its converted field at a path, such as ``pose.position.x`` or ``data[3]``."""
    if not _PATH.fullmatch(path):
        raise ImportLogError(f"field {path!r} of {topic} is no path, expected one such as pose.position.x or data[3]")
    parts = [name or int(index) for name, index in _PART.findall(path)]

    def get(message: Any) -> float:
        value = message
        for part in parts:
            try:
                value = value[part] if isinstance(part, int) else getattr(value, part)
            except (AttributeError, IndexError, TypeError) as error:
                fields = [name for name in getattr(value, "__dataclass_fields__", ()) if not name.startswith("_")]
                known = f"; {hint(str(part), fields)}" if fields else ""
                raise ImportLogError(f"{topic} has no field {path!r}: nothing is at {part!r}{known}") from error
        with contextlib.suppress(TypeError, ValueError, AttributeError):
            return convert(value)
        raise ImportLogError(f"{topic}: {path} is {type(value).__name__}, expected {what}")

    return get


def _number(value: Any) -> float:
    return float(value)


def _seconds(value: Any, factor: float) -> float:
    """Convert a field of seconds and nanoseconds, or a number with a factor, to seconds."""
    if hasattr(value, "nanosec"):
        return float(value.sec + 1e-9 * value.nanosec)
    return float(value) * factor
