"""Predictions of the plant's motion with exact sensitivities, in one compiled loop."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

from controller.compiling.library import cache_library, has_valid_checksum, is_trusted
from cosim.errors import IdentificationError
from cosim.simulation.signals import Array
from plant_fmu.archive import temporary_folder
from plant_fmu.compiling.compiler import FLAGS, compile_library, find_compiler
from plant_fmu.compiling.platforms import native_platform
from plant_fmu.compiling.sources import c_sources, header
from plant_fmu.errors import BuildError
from plant_fmu.variables import variables
from plant_fmu.vehicle import Vehicle
from plant_fmu.vehicle_component import make_vehicle_component

STATE_SIZE = 13  # position 3, quaternion 4, velocity 6
_TOKEN = "shooting"  # noqa: S105 -- no secret: instantiation token, which no model description needs to match
_FMI = ("fmi3.c", "fmi3_unsupported.c")
_FAST = "-ffp-contract=fast"  # takes three quarters of the time; the last bits differ from the FMU's
_INCLUDED = "tangent.c"  # source that shooting.c includes


class _Request(ctypes.Structure):
    """Structure Prediction of csrc/shooting.h."""

    _fields_ = (
        *((name, ctypes.c_int) for name in ("n_parameters", "n_steps", "n_directions", "n_inputs", "n_samples")),
        ("step", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in (
            "references", "values", "start", "wrench", "force", "start_tangents", "parameter_directions",
            "input_directions", "force_tangents", "wrench_tangents", "turns", "times", "states", "rates",
            "state_tangents", "work",
        )),
    )  # fmt: skip


@dataclass(frozen=True)
class Directions:
    """Directions of differentiation of a prediction: d changes of start, parameter, wrench or force."""

    start: Array  # (d, 13) derivative of the start state along each direction
    parameters: Sequence[str | None]  # (d,) name of the FMU's parameter that changes; None for none
    inputs: Sequence[int | None]  # (d,) index of the change in `wrench`; None for none
    force: Array  # (d, 3) N, NED, derivative of the constant force
    wrench: Array  # (n, steps, 2, 6) N, N m, body frame, derivatives of the wrench: mean and change over each step


@dataclass(frozen=True)
class Motion:
    """A predicted motion at n sample times, and its sensitivities along d directions."""

    states: Array  # (n, 13) position [m, NED], quaternion, velocity [m/s, rad/s, body frame]
    rates: Array  # (n, 13) time derivatives of the states
    tangents: Array  # (n, d, 13) derivatives of the states along the directions


class Shooter:
    """Predicts the motion of a vehicle from a start, by the FMU's equations and exact derivatives."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._references = {v.name: i for i, v in enumerate(variables(vehicle)) if v.role == "parameter"}
        self._predict: Any = _library(vehicle).shooting_predict
        self._predict.argtypes, self._predict.restype = [ctypes.POINTER(_Request)], ctypes.c_char_p

    def predict(
        self,
        parameters: Mapping[str, float],
        start: Array,
        wrench: Array,
        step: float,
        times: Array,
        directions: Directions | None = None,
        force: Array | None = None,
        turns: Array | None = None,
    ) -> Motion:
        """Predict the motion under a wrench that is linear over each step; start [m, NED]."""
        # Units of arguments: wrench [N, N m, body frame]; step [s]; times [s]; force [N, NED]; turns (steps + 1, 7):
        # quaternion and angular velocity [rad/s] at the ends of the steps, which then are not predicted
        along = directions or NO_DIRECTIONS
        d, n = len(along.parameters), len(times)
        references = [self._references[name] for name in parameters]
        directed = [-1 if name is None else self._references[name] for name in along.parameters]
        motion = Motion(np.empty((n, STATE_SIZE)), np.empty((n, STATE_SIZE)), np.empty((n, d, STATE_SIZE)))
        arrays: dict[str, NDArray[Any]] = {
            "references": np.array(references, np.uint32),
            "values": np.array([*parameters.values()], float),
            "start": np.ascontiguousarray(start, float),
            "wrench": np.ascontiguousarray(wrench, float).reshape(len(wrench), 2, 6),
            "force": np.zeros(3) if force is None else np.ascontiguousarray(force, float),
            "start_tangents": np.ascontiguousarray(along.start, float),
            "parameter_directions": np.array(directed, np.intc),
            "input_directions": np.array([-1 if i is None else i for i in along.inputs], np.intc),
            "force_tangents": np.ascontiguousarray(along.force, float),
            "wrench_tangents": np.ascontiguousarray(along.wrench, float).reshape(*along.wrench.shape[:2], 2, 6),
            "turns": np.empty(0) if turns is None else np.ascontiguousarray(turns, float),
            "times": np.ascontiguousarray(times, float),
            "states": motion.states,
            "rates": motion.rates,
            "state_tangents": motion.tangents,
            "work": np.empty((6, d, STATE_SIZE)),
        }
        request = _Request(len(references), len(wrench), d, len(along.wrench), n, step)
        for name, array in arrays.items():
            setattr(request, name, array.ctypes.data if name != "turns" or turns is not None else None)
        message = self._predict(ctypes.byref(request))
        if message:
            raise IdentificationError(f"prediction: {message.decode()}")
        return motion


NO_DIRECTIONS = Directions(np.empty((0, STATE_SIZE)), (), (), np.empty((0, 3)), np.empty((0, 0, 2, 6)))


@functools.cache
def _library(vehicle: Vehicle) -> ctypes.CDLL:
    """Load the library for this machine's processor; compile it if it is not in the user's cache."""
    component = make_vehicle_component(vehicle)
    own = resources.files("cosim.identification").joinpath("csrc")
    files = {name: text for name, text in c_sources(component, 3).items() if name not in _FMI}
    files |= {file.name: file.read_bytes() for file in own.iterdir() if file.name.endswith((".c", ".h"))}
    files[component.header] = header(component, _TOKEN).encode()
    compiler = find_compiler()
    flags = "-mcpu=native" if "ziglang" in compiler else "-march=native", _FAST  # all instructions of this processor
    made_from = hashlib.sha256(
        repr((native_platform().name, compiler, FLAGS, flags, _machine(compiler, flags))).encode()
    )
    for file, text in sorted(files.items()):
        made_from.update(f"\n{file} {len(text)}\n".encode() + text)
    name = f"{vehicle.name}-{made_from.hexdigest()[:16]}{native_platform().suffix}"
    path = Path(platformdirs.user_cache_dir("subreach")) / "shooting" / name
    if is_trusted(path.parent) and has_valid_checksum(path):
        return ctypes.CDLL(str(path))
    with temporary_folder("subreach-shooting-") as folder:
        for file, text in files.items():
            (folder / file).write_bytes(text)
        built = folder / name
        sources = [folder / file for file in sorted(files) if file.endswith(".c") and file != _INCLUDED]
        compile_library(compiler, native_platform(), sources, [], built, flags)
        return ctypes.CDLL(str(cache_library(built, path.parent)))


def _machine(compiler: Sequence[str], flags: Sequence[str]) -> str:
    """Return the macros that the compiler predefines, which identify it and the processor's instructions."""
    try:
        process = subprocess.run(  # noqa: S603 -- the compiler that the user has, and flags of ours
            [*compiler, *flags, "-dM", "-E", "-x", "c", os.devnull], capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError) as error:
        raise BuildError(f"C compiler {compiler[0]}: {error}") from error
    return process.stdout
