"""Ecos running a system structure, as its examples do."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from importlib import metadata
from typing import Any

if sys.platform == "linux":  # Ecos needs TBB, and does not find the library that pip installs
    for file in metadata.files("tbb") or []:
        if file.name == "libtbb.so.12":
            ctypes.CDLL(str(file.locate()), mode=ctypes.RTLD_GLOBAL)

from ecospy import EcosLib, EcosSimulation


def _opened(setup: dict[str, Any]) -> Any:
    EcosLib.set_log_level("err")
    simulation = EcosSimulation(ssp_path=setup["ssp"], step_size=setup["step"])
    if not simulation.init():
        raise RuntimeError(EcosLib.get_last_error())
    return simulation


def _step(simulation: Any, count: int) -> None:
    if not simulation.step(count) > 0.0:  # it returns the time
        raise RuntimeError(EcosLib.get_last_error())


def steps(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that runs a given number of steps in one call."""
    simulation = _opened(setup)
    return lambda count: _step(simulation, count)


def runs(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that makes a given number of whole runs, each with loading and unpacking."""
    whole = round(setup["duration"] / setup["step"])

    def work(count: int) -> None:
        for _ in range(count):
            with _opened(setup) as simulation:
                _step(simulation, whole)
                simulation.terminate()

    return work
