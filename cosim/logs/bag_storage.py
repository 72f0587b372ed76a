"""Readers of stored messages from ROS bags: MCAP, SQLite, and bags of ROS 1."""

from __future__ import annotations

import functools
import re
import sqlite3
from collections.abc import Iterator
from pathlib import Path

from cosim.errors import ImportLogError
from cosim.logs.bag_database import sqlite_messages
from cosim.logs.bag_records import BagRecords, McapRecords, RosbagRecords, StoredMessage
from cosim.logs.records import DAMAGE, OnProgress

MAX_DECODED = 1 << 20  # bytes, maximum size of a message that is decoded: its objects take up to a hundred times that
_MAX_TOPICS = 20_000
_NUMBER = re.compile(r"\d+")
SUFFIXES = (".mcap", ".db3", ".bag")
_RECORDS: dict[str, type[BagRecords]] = {".mcap": McapRecords, ".bag": RosbagRecords}


def bag_files(path: Path) -> list[Path]:
    """Return the files of a bag: the file itself, or the files of a recorder's folder in the order of their numbers."""
    if not path.is_dir():
        return [path]
    files = [file for file in path.iterdir() if file.suffix.lower() in SUFFIXES and file.is_file()]
    packed = next((file.name for file in path.iterdir() if file.suffix.lower() in (".zstd", ".zst")), None)
    if packed is not None:
        raise ImportLogError(f"holds {packed!r}, which is compressed as a whole; expected files of zstd -d")
    if not files:
        raise ImportLogError(f"is a folder without a bag, expected files that end in {', '.join(SUFFIXES)}")
    if len({file.suffix.lower() for file in files}) > 1:
        raise ImportLogError("is a folder of bags of two kinds, expected one bag")
    return sorted(files, key=_sort_key)


def _sort_key(file: Path) -> tuple[list[int], str]:
    """Return the sort key of a bag's file: the numbers in its name, such as of a part or a time, and its name."""
    return [int(number) for number in _NUMBER.findall(file.stem)], file.name


def stored_messages(path: Path, remarks: list[str], on_progress: OnProgress) -> Iterator[StoredMessage]:
    """Yield the messages of a bag in the order of its files and their storage."""
    files, topics = bag_files(path), set[str]()
    for k, file in enumerate(files):
        for message in _messages_of(file, remarks, functools.partial(_report, on_progress, k, len(files))):
            yield message
            topics.add(message.topic)
            if len(topics) > _MAX_TOPICS:
                raise ImportLogError(f"has more than {_MAX_TOPICS} topics")


def _report(on_progress: OnProgress, done: int, count: int, part: float) -> None:
    on_progress((done + part) / count)


def _messages_of(file: Path, remarks: list[str], on_progress: OnProgress) -> Iterator[StoredMessage]:
    kind, any_message = _RECORDS.get(file.suffix.lower()), False
    if kind is not None:
        records = kind(file, on_progress)
        for messages in records:
            for message in messages:
                any_message = True
                yield message
        if records.reason and not any_message:
            raise ImportLogError(f"cannot be read as a bag: {records.reason}")
        remarks += records.remarks(file.name)
        return
    try:
        for message in sqlite_messages(file, on_progress):
            any_message = True
            yield message
    except (sqlite3.Error, *DAMAGE) as error:
        if not any_message:
            raise ImportLogError(f"cannot be read as a bag: {error}") from error
        remarks.append(f"{file.name} breaks off: {error}"[:200])
