"""Libraries that come compiled with the package, so that an FMU can be made where there is no compiler."""

# The library of one vehicle differs from that of another with as many thrusters only in numbers: the start values of
# its variables and the token, which are in one table of the binary. A prebuilt library is compiled with stand-ins
# there, numbers that no vehicle has, and each vehicle's own are written over them. Its file is named by a digest of the
# exact sources, flags and headers that it is compiled from, so that a library of other sources is never used.

from __future__ import annotations

import math
import os
import struct
import sys
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from plant_fmu.archive import write_archive
from plant_fmu.compiling.compiler import cross_compiler, find_compiler
from plant_fmu.compiling.libraries import compiled_libraries, source_digest
from plant_fmu.compiling.platforms import NATIVE, Platform, cross_platforms, native_platform
from plant_fmu.compiling.signature import re_sign
from plant_fmu.component import Component
from plant_fmu.errors import BuildError
from plant_fmu.variables import Variable
from plant_fmu.vehicle import load_vehicle, shipped_vehicles
from plant_fmu.vehicle_component import make_vehicle_component

FOLDER = Path(__file__).parents[1] / "prebuilt"  # folder in a wheel; missing in a checkout
NAME = "prebuilt"  # prefix of the libraries' functions

STAND_IN = "{" + "-".join("0" * n for n in (8, 4, 4, 4, 12)) + "}"  # instead of a token
_ROLES_WITH_START = ("state", "input", "parameter")  # roles of variables with a start value
_ROW = struct.Struct("<4d")  # row of the table: start, min, max, nominal; every platform is little-endian


def prebuilt_files() -> list[str]:
    """Return the names of the prebuilt files in the package, which are digests of their sources."""
    return sorted(path.name for path in FOLDER.iterdir()) if FOLDER.is_dir() else []


def prebuilt_libraries(
    component: Component, token: str, fmi: int, platforms: Sequence[Platform]
) -> list[tuple[Platform, bytes]] | None:
    """Return a component's libraries from the prebuilt ones in the package."""
    if not FOLDER.is_dir() or not all(map(_can_load, platforms)):
        return None
    general = make_general_component(component)
    path = FOLDER / file_name(general, fmi)
    if not path.is_file():
        return None
    try:
        with zipfile.ZipFile(path) as archive:
            if not set(map(_member, platforms)) <= set(archive.namelist()):
                return None
            libraries = [(platform, archive.read(_member(platform))) for platform in platforms]
    except (OSError, zipfile.BadZipFile, zlib.error) as error:
        raise BuildError(f"{path}: damaged ({error}); install subreach anew") from error
    return [(platform, _patch(library, general, component, token)) for platform, library in libraries]


def shipped_structures() -> list[Component]:
    """Return the components that prebuilt libraries are compiled from."""
    vehicles = map(load_vehicle, shipped_vehicles())
    structures = [make_general_component(make_vehicle_component(vehicle)) for vehicle in vehicles]
    return list({structure.constants["N_THRUSTERS"]: structure for structure in structures}.values())


def write_prebuilt(structure: Component, fmi: int, platforms: str, folder: Path) -> Path:
    """Compile the prebuilt libraries of one structure."""
    if platforms == NATIVE:
        compilers = [(native_platform(), find_compiler())]
    else:
        compilers = [(platform, cross_compiler(platform)) for platform in cross_platforms(platforms)]
    libraries = compiled_libraries(structure, STAND_IN, fmi, compilers)
    out = folder / file_name(structure, fmi)
    write_archive(out, {_member(platform): library for platform, library in libraries})
    return out


def make_general_component(component: Component) -> Component:
    """Return the component of a prebuilt library: the same with a stand-in for each start value."""
    rows = tuple(
        replace(v, start=_stand_in(i)) if v.role in _ROLES_WITH_START else v for i, v in enumerate(component.variables)
    )
    return replace(component, name=NAME, variables=rows)


def _stand_in(i: int) -> float:
    return math.ldexp(1.0 + i / 2**20, -1000)  # about 1e-301: no quantity is as small


def file_name(general: Component, fmi: int) -> str:
    """Return the name of the file with prebuilt libraries."""
    return f"fmi{fmi}-{source_digest(general, STAND_IN, fmi)[:32]}.zip"


def _member(platform: Platform) -> str:
    return f"{platform.name}{platform.suffix}"


def _can_load(platform: Platform) -> bool:
    """Return True if a library that needs glibc can load: Linux may have another C library."""
    if platform.system != "linux" or not sys.platform.startswith("linux"):
        return True
    try:
        return (os.confstr("CS_GNU_LIBC_VERSION") or "").startswith("glibc")
    except (OSError, ValueError):
        return False


def _patch(library: bytes, general: Component, component: Component, token: str) -> bytes:
    """Return a library with a component's numbers and token in place of the stand-ins."""
    changes = [(STAND_IN.encode() + b"\0", token.encode() + b"\0")]
    for old_row, new_row in zip(general.variables, component.variables, strict=True):
        if old_row.role in _ROLES_WITH_START:
            changes.append((_row(old_row), _row(new_row)))
    patched = bytearray(library)
    for old, new in changes:
        if library.count(old) != 1 or len(old) != len(new):
            raise BuildError("a library that comes with subreach has another table of variables than expected")
        offset = library.index(old)
        patched[offset : offset + len(new)] = new
    return re_sign(bytes(patched))


def _row(v: Variable) -> bytes:
    return _ROW.pack(v.start, v.quantity.minimum, v.quantity.maximum, v.nominal)
