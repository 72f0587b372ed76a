"""Databases of bags, of which nothing but plain tables is read, with bounded work."""

from __future__ import annotations

import contextlib
import re
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cosim.errors import ImportLogError
from cosim.logs.bag_records import StoredMessage
from cosim.logs.decompression import MAX_PART, Decompressor
from cosim.logs.records import OnProgress

_LIMITS = {  # as SQLite advises for files from others, sqlite.org/security.html
    sqlite3.SQLITE_LIMIT_LENGTH: MAX_PART,
    sqlite3.SQLITE_LIMIT_SQL_LENGTH: 100_000,
    sqlite3.SQLITE_LIMIT_COLUMN: 100,
    sqlite3.SQLITE_LIMIT_EXPR_DEPTH: 10,
    sqlite3.SQLITE_LIMIT_COMPOUND_SELECT: 3,
    sqlite3.SQLITE_LIMIT_VDBE_OP: 25_000,
    sqlite3.SQLITE_LIMIT_FUNCTION_ARG: 8,
    sqlite3.SQLITE_LIMIT_ATTACHED: 0,
    sqlite3.SQLITE_LIMIT_LIKE_PATTERN_LENGTH: 50,
    sqlite3.SQLITE_LIMIT_VARIABLE_NUMBER: 10,
    sqlite3.SQLITE_LIMIT_TRIGGER_DEPTH: 1,
}
_PRAGMAS = ("trusted_schema = OFF", "query_only = ON", "cell_size_check = ON", "mmap_size = 0")
_PLAIN = re.compile(r"CREATE\s+(TABLE|(UNIQUE\s+)?INDEX)\b", re.IGNORECASE)
_STEPS = 10_000  # instructions between two calls of the handler
_STEPS_PER_BYTE = 10  # maximum number of instructions for each byte of the file, beyond a million
_ZSTANDARD = b"\x28\xb5\x2f\xfd"  # first bytes of compressed data, RFC 8878
_ROW_SIZE = 8  # bytes, minimum size of a row in a file


class BagDatabase:
    """A database that is read row by row; see `open_database`."""

    def __init__(self, database: sqlite3.Connection, size: int) -> None:
        self._database, self._size, self._read = database, size, 0
        self._calls = (1_000_000 + _STEPS_PER_BYTE * size) // _STEPS
        database.set_progress_handler(self._count, _STEPS)
        for limit, value in _LIMITS.items():
            database.setlimit(limit, value)
        for pragma in _PRAGMAS:
            database.execute(f"PRAGMA {pragma}")
        self.tables: set[str] = set()
        for kind, name, text in self.rows("SELECT type, name, coalesce(sql, '') FROM sqlite_master", str, str, str):
            if kind not in ("table", "index") or (text and not _PLAIN.match(text)):
                raise ImportLogError(f"has the {kind} {name!r}, which is no plain table, expected a bag of ROS 2")
            if kind == "table":
                self.tables.add(name)
        for name in self.tables & {"topics", "messages", "message_definitions"}:
            query = "SELECT name, type, pk, hidden FROM pragma_table_xinfo(?)"
            for column, kind, key, hidden in self._database.execute(query, (name,)):
                if hidden or ((name, column) == ("messages", "id") and (kind.upper(), key) != ("INTEGER", 1)):
                    raise ImportLogError(f"has the column {column!r} of {name}, which no recorder writes")

    def _count(self) -> bool:
        """Count a call of the handler; return True to interrupt the database."""
        self._calls -= 1
        return self._calls < 0

    def rows(self, query: str, *types: type) -> Iterator[tuple[Any, ...]]:
        """Yield the rows of a query, whose values have the given types."""
        for row in self._database.execute(query):
            for value, kind in zip(row, types, strict=True):
                if not isinstance(value, kind):
                    raise ValueError(f"a row has {type(value).__name__}, expected {kind.__name__}")
            self._read += _ROW_SIZE + sum(len(value) for value in row if not isinstance(value, int))
            if self._read > self._size:
                raise ImportLogError("has rows that are larger than the file")
            yield row


@contextlib.contextmanager
def open_database(path: Path) -> Iterator[BagDatabase]:
    """Open a database for reading."""
    # a recorder that was killed leaves a journal, which a file opened as immutable would not show
    journal = path.with_name(f"{path.name}-wal")
    address = f"{path.resolve().as_uri()}?mode=ro" + ("" if journal.exists() else "&immutable=1")
    size = path.stat().st_size + (journal.stat().st_size if journal.exists() else 0)
    with contextlib.closing(sqlite3.connect(address, uri=True)) as database:
        yield BagDatabase(database, size)


def sqlite_messages(path: Path, on_progress: OnProgress) -> Iterator[StoredMessage]:
    """Yield the messages of a bag of SQLite."""
    total, read = path.stat().st_size, 0
    parts = Decompressor(total)
    with open_database(path) as database:
        if not database.tables >= {"topics", "messages"}:
            raise ImportLogError("is a database without topics and messages, expected a bag of ROS 2")
        texts: dict[str, tuple[str, str]] = {}
        if "message_definitions" in database.tables:
            query = "SELECT topic_type, encoded_message_definition, encoding FROM message_definitions"
            texts = {name: (text, language) for name, text, language in database.rows(query, str, str, str)}
        topics = {
            key: (topic, _three_parts(kind), *texts.get(kind, ("", "")), encoding)
            for key, topic, kind, encoding in database.rows(
                "SELECT id, name, type, serialization_format FROM topics", int, str, str, str
            )
        }
        query = "SELECT topic_id, timestamp, data FROM messages ORDER BY id"
        for topic, stamp, data in database.rows(query, int, int, bytes):
            if topic not in topics:
                raise ValueError(f"a message has topic number {topic!r}, expected one of {sorted(topics)}")
            read += len(data)
            if data.startswith(_ZSTANDARD):  # the recorder has compressed each message
                data = parts.decompress("zstd", data)
            on_progress(min(1.0, read / total))
            yield StoredMessage(*topics[topic], data, stamp * 1e-9)


def _three_parts(kind: str) -> str:
    """Return a type's name with its part ``msg``, which early recorders omit."""
    return kind.replace("/", "/msg/") if kind.count("/") == 1 else kind
