"""Sources of the instants of a run: the folder of a finished run or of one being recorded, or a live view."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import urlsplit

import msgspec
import numpy as np

from cosim.errors import RunError, TelemetryError
from cosim.live.viewer_messages import read_rows
from cosim.replay.header import header_of
from cosim.replay.view_columns import ViewColumns
from cosim.results.record import RECORD, STREAM, load_record
from cosim.results.required_columns import require_columns
from cosim.results.run_result import SCENARIO, SUMMARY, load_run
from cosim.results.wording import verdict
from cosim.scenario.criteria import MAX_CRITERIA
from cosim.scenario.scenario import load_scenario
from cosim.simulation.signals import Array

_FRAME = 0.1  # s of the wall clock, between snapshots
_FAST = 200  # number of snapshots of a run that is played back at full speed
_ROWS = 10_000  # maximum number of rows of a finished run
_FRESH = 5.0  # s; a run whose newest rows are older is not being recorded
_ANSWER = 5.0  # s, timeout of a connection to a live view
_MAX_SIZE = 1 << 26  # bytes of a message


class _Signal(msgspec.Struct):
    name: str


class _Criterion(msgspec.Struct):
    name: str
    color: Annotated[str, msgspec.Meta(pattern="^#[0-9A-Fa-f]{6}$")]


class _Region(msgspec.Struct):
    name: str
    criterion: str | None
    keep: str
    unit: str
    is_dynamic: bool


class _Rule(msgspec.Struct):
    label: str
    words: str


class _Truth(msgspec.Struct):
    estimate: tuple[float, float, float, float]


class _Header(msgspec.Struct):
    """The used part of a live view's header, which is validated since the server may be another program."""

    title: str
    law: str
    duration: float
    ramp: float
    criteria: Annotated[list[_Criterion], msgspec.Meta(max_length=MAX_CRITERIA)]
    regions: list[_Region]
    rules: list[_Rule]
    signals: list[_Signal]
    truth: _Truth


@dataclass(frozen=True)
class Snapshot:
    """A run at one instant."""

    header: dict[str, Any]
    row: Array | None  # (columns,), None before the first row
    note: str  # description of the row's source
    ended: tuple[str, str] | None = None  # status and verdict, once the run is over
    silent: bool = False  # True if the recording has no new rows

    def __getitem__(self, name: str) -> float:
        """Return the value of a signal; NaN if there is none."""
        names = [signal["name"] for signal in self.header["signals"]]
        return float(self.row[names.index(name)]) if self.row is not None and name in names else math.nan


def snapshots(what: str, rate: float | None = 1.0, once: bool = False) -> Iterator[Snapshot]:
    """Iterate over instants of a run until it is over."""
    if what.isdecimal() or "://" in what:
        running = _follow_live(_parse_endpoint(what))
    elif _is_being_recorded(path := Path(what)):
        running = _follow_recording(path)
    else:
        return _play_back(path, rate, once)
    if not once:
        return running
    settled = (snapshot for snapshot in running if snapshot.row is not None or snapshot.ended or snapshot.silent)
    return itertools.islice(settled, 1)


# ---- folders -------------------------------------------------------------------------------------------------------


def _play_back(path: Path, rate: float | None, once: bool) -> Iterator[Snapshot]:
    run = load_run(path)
    view_columns = ViewColumns(run.scenario, run.record.columns)
    record, steps = run.record, len(run.record)
    # a table needs no more rows than these, and all rows of a long run would not fit into memory
    rows = np.arange(steps - 1, -1, -max(1, steps // _ROWS))[::-1] if not once else np.array([steps - 1])
    picked = record.take(rows, [record.columns[i].name for i in view_columns.picked]).to_array()
    times, ending = picked[:, 0], (str(run.summary["status"]), verdict(run.summary))
    header = header_of(run.scenario, view_columns.columns)

    def snapshot(k: int, note: str, end: tuple[str, str] | None = None) -> Snapshot:
        return Snapshot(header, view_columns.compute_rows(picked[k : k + 1])[0], note, end)

    began, k = time.monotonic(), 0
    note = "replay" if rate is None else f"replay, {rate:g} times real time"
    while k < len(times) - 1:
        yield snapshot(k, note)
        if rate is None:
            k += max(1, len(times) // _FAST)
        else:
            time.sleep(_FRAME)
            k = int(np.searchsorted(times, times[0] + rate * (time.monotonic() - began), side="right")) - 1
    yield snapshot(len(times) - 1, "replay", ending)


def _is_being_recorded(path: Path) -> bool:
    """Return True if a run is being recorded in a folder."""
    if (path / RECORD).exists() or (path / SUMMARY).exists():
        return False
    with contextlib.suppress(FileNotFoundError):  # no run, or one that has just been completed
        stream = (path / STREAM).stat()
        return stream.st_size == 0 or time.time() - stream.st_mtime < _FRESH
    return False


def _follow_recording(path: Path) -> Iterator[Snapshot]:
    scenario = load_scenario(path / SCENARIO)
    header: dict[str, Any] = header_of(scenario, ())
    row: Array | None = None
    known, since = 0, time.monotonic()
    while not (path / SUMMARY).exists():
        record = None
        with contextlib.suppress(FileNotFoundError, RunError):  # no rows yet, or the run completes its record
            if (size := (path / STREAM).stat().st_size) > known:  # a stream is read from its start
                known, record = size, load_record(path)
        if record is not None and len(record):
            require_columns(scenario, record)
            view_columns = ViewColumns(scenario, record.columns)
            header = header_of(scenario, view_columns.columns)
            last = record.take([len(record) - 1]).to_array()
            since = time.monotonic()
            row = view_columns.compute_rows(last[:, view_columns.picked])[0]
        silent = time.monotonic() - since
        wait = f"no new rows for {silent:.0f} s: waiting, writing its report, or killed"
        fresh = silent < _FRESH
        yield Snapshot(header, row, "being recorded" if fresh else wait, silent=not fresh)
        time.sleep(_FRAME)
    yield from _play_back(path, None, once=True)


# ---- live ----------------------------------------------------------------------------------------------------------


def _parse_endpoint(what: str) -> tuple[str, int]:
    text = f"ws://127.0.0.1:{what}" if what.isdecimal() else what
    try:
        parts = urlsplit(text)
        scheme, host, port = parts.scheme, parts.hostname, parts.port
    except ValueError:
        scheme, host, port = "", None, None
    if scheme not in ("ws", "http") or not host or not port:
        raise TelemetryError(f"{what!r}: expected a run folder, PORT, or ws://HOST:PORT")
    return host, port


def _follow_live(endpoint: tuple[str, int]) -> Iterator[Snapshot]:
    from websockets.exceptions import WebSocketException
    from websockets.sync.client import connect

    url = f"ws://{endpoint[0]}:{endpoint[1]}/ws"
    header: dict[str, Any] | None = None
    try:
        # connecting by our own socket bypasses proxies
        reached = socket.create_connection(endpoint, timeout=_ANSWER)
        with connect(url, sock=reached, open_timeout=_ANSWER, max_size=_MAX_SIZE, compression=None) as connection:
            row: Array | None = None
            shown = -math.inf
            for message in connection:
                if isinstance(message, bytes):
                    if header is not None:
                        row = read_rows(message, len(header["signals"]))[-1]
                else:
                    content = json.loads(message)
                    if content["type"] == "header":
                        msgspec.convert(content["run"], _Header)
                        header, row = content["run"], None
                    elif content["type"] == "end" and header is not None:
                        yield Snapshot(header, row, f"live at {url}", (str(content["status"]), str(content["verdict"])))
                        if content["status"] != "reset":
                            return
                if header is not None and time.monotonic() - shown >= _FRAME:
                    shown = time.monotonic()
                    yield Snapshot(header, row, f"live at {url}")
    except (OSError, WebSocketException) as error:
        raise TelemetryError(f"{url}: {_reason(error)}") from error
    except (ValueError, LookupError, TypeError, RecursionError) as error:
        raise TelemetryError(f"{url}: is no live view of a run ({error})") from error
    raise TelemetryError(f"{url}: the connection has ended before the run")


def _reason(error: Exception) -> str:
    if isinstance(error, ConnectionRefusedError):
        return "cannot be watched: nothing answers there; is a run with --live going on, and is this its port?"
    text = getattr(error, "strerror", None) or str(error)
    return f"cannot be watched: {text}"
