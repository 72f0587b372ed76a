"""libcosim running a system structure."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Callable
from typing import Any

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level

_TICKS = 10**9  # ticks per second: libcosim counts time in nanoseconds


def _unpack_ssp(setup: dict[str, Any]) -> tempfile.TemporaryDirectory[str]:
    """Unpack the system structure into a folder, the input of libcosim, which exists as long as the result."""
    folder = tempfile.TemporaryDirectory()
    with zipfile.ZipFile(setup["ssp"]) as archive:
        archive.extractall(folder.name)
    return folder


def _open_execution(folder: str, setup: dict[str, Any]) -> Any:
    log_output_level(CosimLogLevel.ERROR)
    return CosimExecution.from_ssp_file(folder, round(setup["step"] * _TICKS))


def _step(execution: Any, count: int) -> None:
    if not execution.step(count):
        raise RuntimeError(f"stopped: {execution.status()}")


def steps(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that runs a given number of steps in one call."""
    folder = _unpack_ssp(setup)
    execution = _open_execution(folder.name, setup)
    return lambda count, _=folder: _step(execution, count)  # type: ignore[misc]


def runs(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that makes a given number of whole runs, each with loading, from unpacked files."""
    folder, whole = _unpack_ssp(setup), round(setup["duration"] / setup["step"])

    def work(count: int) -> None:
        for _ in range(count):
            _step(_open_execution(folder.name, setup), whole)

    return work
