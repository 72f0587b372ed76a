"""libcosim running a system structure."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Callable
from typing import Any

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level

_TICKS = 10**9  # ticks per second: libcosim counts time in nanoseconds


def _unpacked(setup: dict[str, Any]) -> str:
    """Return the folder of the unpacked system structure, the input of libcosim."""
    folder = tempfile.mkdtemp()
    with zipfile.ZipFile(setup["ssp"]) as archive:
        archive.extractall(folder)
    return folder


def _opened(folder: str, setup: dict[str, Any]) -> Any:
    log_output_level(CosimLogLevel.ERROR)
    return CosimExecution.from_ssp_file(folder, round(setup["step"] * _TICKS))


def _step(execution: Any, count: int) -> None:
    if not execution.step(count):
        raise RuntimeError(f"stopped: {execution.status()}")


def steps(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that runs a given number of steps in one call."""
    execution = _opened(_unpacked(setup), setup)
    return lambda count: _step(execution, count)


def runs(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that makes a given number of whole runs, each with loading, from unpacked files."""
    folder, whole = _unpacked(setup), round(setup["duration"] / setup["step"])

    def work(count: int) -> None:
        for _ in range(count):
            _step(_opened(folder, setup), whole)

    return work
