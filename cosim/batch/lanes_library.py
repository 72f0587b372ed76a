"""Libraries compiled for this machine's processor, and the lanes of a vehicle: plant, paper's law and arbiter."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
import subprocess
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path

import platformdirs

from controller.compiling.library import is_whole, keep
from controller.regions.in_c import c_sources as law_sources
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.export import to_c
from plant_fmu.compiling.compiler import FLAGS, compile_library, find_compiler
from plant_fmu.compiling.platforms import native_platform
from plant_fmu.compiling.sources import c_sources, header
from plant_fmu.errors import BuildError
from plant_fmu.vehicle import Vehicle
from plant_fmu.vehicle_component import of_vehicle

_TOKEN = "lanes"  # noqa: S105 -- not a secret: instantiation token, which no model description repeats
_NARROW = ("-Wno-psabi",)  # only this library calls its functions with vectors
_FMI = ("fmi3.c", "fmi3_unsupported.c")  # sources that are left out, since there is no importer

# lanes per register, but at least four: vectors of two lanes take as long as those of four
_WIDTH = """#ifdef __AVX512F__
#define LANES 8
#else
#define LANES 4
#endif
"""
_STEP_SOURCES = ("plant.c", "actuators.c", "environment.c", "elementary.c")  # sources of the plant that a step needs


@functools.cache
def lanes_library(vehicle: Vehicle, flags: tuple[str, ...] = (), beside: Path | None = None) -> ctypes.CDLL:
    """Load the lanes library of a vehicle; compile it if it is not in the cache.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    flags : tuple of str, optional
        Further compiler flags, for measurements. With flags that change rounding, such as ``-ffp-contract=fast``, the
        results differ from the FMU's in the last bits.
    beside : Path, optional
        One more C file for the lanes.

    Returns
    -------
    CDLL
        Library with the functions of ``csrc/lanes.h``.

    Raises
    ------
    BuildError
        If there is no C compiler, or it fails.
    """
    files = _files(vehicle, beside)
    sources = [name for name in files if name.endswith(".c") and not name.startswith("many/")]
    return machine_library("lanes", vehicle.name, files, sources, (*_NARROW, *flags))


def machine_library(
    kind: str, name: str, files: Mapping[str, bytes], sources: Iterable[str], flags: Sequence[str] = ()
) -> ctypes.CDLL:
    """Load a library for this machine's processor; compile it if it is not in the cache.

    Parameters
    ----------
    kind : str
        Folder of the user's cache.
    name : str
        Beginning of the file's name, which a digest of all inputs of the compiler follows.
    files : mapping of str to bytes
        C files and headers, by names relative to one folder.
    sources : iterable of str
        Names of the files to compile.
    flags : sequence of str, optional
        Further compiler flags.

    Returns
    -------
    CDLL
        The library, loaded.

    Raises
    ------
    BuildError
        If there is no C compiler, or it fails.
    """
    compiler = find_compiler()
    flags = (*_tuned(compiler), *flags)
    made_from = hashlib.sha256(
        repr((native_platform().name, compiler, FLAGS, flags, _machine(compiler, flags))).encode()
    )
    for file, text in sorted(files.items()):
        made_from.update(f"\n{file} {len(text)}\n".encode() + text)
    name = f"{name}-{made_from.hexdigest()[:16]}{native_platform().suffix}"
    path = Path(platformdirs.user_cache_dir("subreach")) / kind / name
    if is_whole(path):
        return ctypes.CDLL(str(path))
    with tempfile.TemporaryDirectory(prefix=f"{kind}-", ignore_cleanup_errors=True) as scratch:
        folder = Path(scratch)
        for file, text in files.items():
            (folder / file).parent.mkdir(exist_ok=True)
            (folder / file).write_bytes(text)
        built = folder / name
        compile_library(compiler, native_platform(), [folder / file for file in sorted(sources)], [], built, flags)
        return ctypes.CDLL(str(keep(built, path.parent)))


def _files(vehicle: Vehicle, beside: Path | None = None) -> dict[str, bytes]:
    """Return the C files: for one vehicle in ``one/``, for several in ``many/``, and wrappers that compile those."""
    component = of_vehicle(vehicle)
    sources, own = c_sources(component, 3), _lanes_sources()
    for name in _FMI:
        del sources[name]
    one = {**sources, component.header: header(component, _TOKEN).encode(), "start.c": own["start.c"]}
    one |= {"lanes.h": own["lanes.h"], "arbiter.c": to_c(Arbiter().system).encode()}
    lanes = replace(component, name=f"{vehicle.name}_lanes")  # prefix of its functions
    many = {name: text for name, text in sources.items() if name.endswith(".h") or name in _STEP_SOURCES}
    many |= law_sources() | {name: text for name, text in own.items() if name != "start.c"}
    many |= {component.header: header(lanes, _TOKEN).encode(), "width.h": _WIDTH.encode()}
    if beside is not None:
        many[beside.name] = beside.read_bytes()
    files = {f"one/{name}": text for name, text in one.items()} | {f"many/{name}": text for name, text in many.items()}
    for name in (name for name in many if name.endswith(".c")):
        files[f"many_{name}"] = f'#include "many/width.h"\n#include "many/{name}"\n'.encode()
    return files


def _lanes_sources() -> dict[str, bytes]:
    found = resources.files("cosim.batch") / "csrc"
    return {file.name: file.read_bytes() for file in found.iterdir() if file.name.endswith((".c", ".h"))}


def _tuned(compiler: Sequence[str]) -> tuple[str, ...]:
    """Return the compiler flags that enable all instructions of this machine's processor."""
    return ("-mcpu=native",) if "ziglang" in compiler else ("-march=native",)


def _machine(compiler: Sequence[str], flags: Sequence[str]) -> str:
    """Return the macros that the compiler predefines, which identify it and the processor's instructions."""
    try:
        said = subprocess.run(  # noqa: S603 -- the compiler that the user has, and flags of ours
            [*compiler, *flags, "-dM", "-E", "-x", "c", os.devnull], capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError) as error:
        raise BuildError(f"C compiler {compiler[0]}: {error}") from error
    return said.stdout
