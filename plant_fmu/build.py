"""FMU files: made whole or not at all, the same bytes each time, and kept in a cache."""

from __future__ import annotations

import atexit
import errno
import functools
import hashlib
import logging
import os
import shutil
import tempfile
import zipfile
from pathlib import Path

import fmpy
import platformdirs

from plant_fmu.archive import require_place, write_archive
from plant_fmu.compiler import FLAGS, compile_library, cross_compiler, find_compiler
from plant_fmu.component import Component, of_vehicle
from plant_fmu.description import model_description, token
from plant_fmu.errors import BuildError
from plant_fmu.platforms import NATIVE, Platform, cross_platforms, native_platform
from plant_fmu.sources import build_description, c_sources, compiled_files, header
from plant_fmu.universal import universal_library
from plant_fmu.vehicle import Vehicle

log = logging.getLogger(__name__)

FMI_VERSIONS = (2, 3)

_FMI_HEADERS = Path(fmpy.__file__).parent / "c-code"


def require_version(fmi: int) -> None:
    """Refuse, with a BuildError, what is no version of FMI that an FMU can be built for."""
    if type(fmi) is not int or fmi not in FMI_VERSIONS:
        raise BuildError(f"FMI version is {fmi!r}, expected 2 or 3")


def build_fmu(what: Vehicle | Component, fmi: int, out: Path, platforms: str = NATIVE) -> Path:
    """Write the FMU of a vehicle, or of another component.

    Parameters
    ----------
    what : Vehicle or Component
        The vehicle, whose numbers become the start values of the FMU's parameters; or what else the FMU is to be of.
    fmi : int
        2 for FMI 2.0, 3 for FMI 3.0, both of a vehicle for co-simulation and model exchange.
    out : Path
        The file to write; it appears whole or not at all.
    platforms : str
        ``native`` for this machine, by whatever compiler is here; ``all``, or FMI 3.0's names with commas between them,
        such as ``x86_64-linux,x86_64-windows``, by the compiler of the ziglang package.

    Returns
    -------
    Path
        `out`.

    Raises
    ------
    BuildError
        If a platform is not known, there is no compiler, it fails, or `out` cannot be written.
    """
    require_version(fmi)
    out = Path(out)
    if platforms == NATIVE:
        compilers = [(native_platform(), find_compiler())]
    else:
        compilers = [(platform, cross_compiler(platform)) for platform in cross_platforms(platforms)]
    require_place(out)
    write_archive(out, _members(_component(what), fmi, compilers))
    return out


def cached_fmu(what: Vehicle | Component, fmi: int) -> Path:
    """Return the FMU of a vehicle or another component from the cache, building it first where it is not there.

    Parameters
    ----------
    what : Vehicle or Component
        As for `build_fmu`.
    fmi : int
        2 or 3.

    Returns
    -------
    Path
        The file; what it is made from is part of its name. It lies in the user's cache folder or, where that cannot be
        made, in one that goes with the process.

    Raises
    ------
    BuildError
        As `build_fmu`.
    """
    require_version(fmi)
    component, digest = _component(what), _digest(what, fmi)[:16]
    path = Path(platformdirs.user_cache_dir("subreach")) / "fmu" / f"{component.name}-fmi{fmi}-{digest}.fmu"
    if zipfile.is_zipfile(path):  # one that was damaged is built anew
        return path
    find_compiler()  # so that a missing compiler is said before anything is written
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not os.access(path.parent, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        log.warning("FMU cache %s: %s; building for this process alone", path.parent, error.strerror or error)
        path = _own_folder() / path.name
        if path.exists():
            return path
    return build_fmu(component, fmi, path)


@functools.lru_cache(maxsize=64)
def _digest(what: Vehicle | Component, fmi: int) -> str:
    """Return what names an FMU of this machine by all that it is made from.

    To write all of that down takes longer than to load an FMU, so a process does it once for each vehicle.
    """
    made_from = hashlib.sha256(" ".join((native_platform().name, *FLAGS, fmpy.__version__)).encode())
    for name, data in sorted(neutral_members(what, fmi).items()):
        made_from.update(f"\n{name} {len(data)}\n".encode() + data)
    return made_from.hexdigest()


@functools.cache
def _own_folder() -> Path:
    """Return a folder that goes with the process."""
    folder = tempfile.mkdtemp(prefix="plant_fmu-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def _component(what: Vehicle | Component) -> Component:
    return of_vehicle(what) if isinstance(what, Vehicle) else what


def neutral_members(what: Vehicle | Component, fmi: int) -> dict[str, bytes]:
    """Return all that goes into an FMU but the binaries, by name in the archive."""
    component = _component(what)
    key = token(component, fmi)
    sources = c_sources(component, fmi) | {component.header: header(component, key).encode()}
    if fmi == 3:
        sources["buildDescription.xml"] = build_description(component).encode()
    return {
        **component.contents(fmi),
        **{f"sources/{name}": data for name, data in sources.items()},
        "modelDescription.xml": model_description(component, fmi, key).encode(),
    }


def _members(component: Component, fmi: int, compilers: list[tuple[Platform, list[str]]]) -> dict[str, bytes]:
    """Return all that goes into an FMU, its sources compiled for each platform, by name in the archive."""
    members = neutral_members(component, fmi)
    libraries: dict[str, list[bytes]] = {}
    with tempfile.TemporaryDirectory(prefix="plant_fmu-") as scratch:
        folder = Path(scratch)
        for member, data in members.items():
            if member.startswith("sources/"):
                (folder / Path(member).name).write_bytes(data)
        files = [folder / file for file in compiled_files(component, fmi)]
        for platform, compiler in compilers:
            library = folder / platform.name / f"{component.name}{platform.suffix}"
            library.parent.mkdir()
            compile_library(compiler, platform, files, [folder, _FMI_HEADERS], library)
            for place in platform.fmi2_names if fmi == 2 else (platform.name,):
                libraries.setdefault(f"binaries/{place}/{library.name}", []).append(library.read_bytes())
    # FMI 2.0 has one place for the libraries of both Macs
    return members | {
        place: found[0] if len(found) == 1 else universal_library(found) for place, found in libraries.items()
    }
