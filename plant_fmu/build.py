"""Build FMU files: written atomically, the same bytes each time, and kept in a cache."""

from __future__ import annotations

import atexit
import contextlib
import errno
import functools
import logging
import os
import zipfile
import zlib
from pathlib import Path

import fmpy
import platformdirs

from plant_fmu.archive import require_writable, temporary_folder, write_archive
from plant_fmu.compiling import webassembly
from plant_fmu.compiling.compiler import FLAGS, cross_compiler, find_compiler
from plant_fmu.compiling.libraries import compiled_libraries, digest
from plant_fmu.compiling.platforms import NATIVE, Platform, cross_platforms, native_platform, without_wasm
from plant_fmu.compiling.prebuilt import prebuilt_files, prebuilt_libraries
from plant_fmu.compiling.sources import all_sources, build_description
from plant_fmu.compiling.universal import universal_library
from plant_fmu.component import Component
from plant_fmu.description import model_description, token
from plant_fmu.errors import BuildError
from plant_fmu.vehicle import Vehicle
from plant_fmu.vehicle_component import make_vehicle_component

log = logging.getLogger(__name__)

FMI_VERSIONS = (2, 3)


def require_version(fmi: int) -> None:
    """Require that a number is a version of FMI for which FMUs can be built; raise BuildError."""
    if type(fmi) is not int or fmi not in FMI_VERSIONS:
        raise BuildError(f"FMI version is {fmi!r}, expected 2 or 3")


def build_fmu(
    what: Vehicle | Component,
    fmi: int,
    out: str | Path,
    platforms: str = NATIVE,
    *,
    coupled: bool = False,
    arrays: bool = False,
    small: bool = False,
) -> Path:
    """Write the FMU of a vehicle, or of another component.

    Parameters
    ----------
    what : Vehicle or Component
        Vehicle, whose numbers become the start values of the FMU's parameters; or another component.
    fmi : int
        FMI version: 2 or 3; that of a vehicle is for co-simulation and model exchange in both.
    out : str or Path
        File to write; it is written atomically.
    platforms : str
        Platforms: ``native`` for this machine; ``all``, or FMI 3.0's names with commas between them, such as
        ``x86_64-linux,x86_64-windows``. Libraries that come with the package are taken where they fit. Else they are
        compiled, for this machine by whatever compiler is here, for others by that of the ziglang package. ``wasm``,
        alone or after a comma, adds a WebAssembly component to an FMU of FMI 3.0.
    coupled : bool
        True for a vehicle with inputs for currents, external forces and the like.
    arrays : bool
        True for a vehicle with arrays, such as ``thrust`` of 8, sensors on clocks, and event mode. FMI 3.0 alone.
    small : bool
        True for a vehicle that shows body and thrusters alone, some 60 variables, for co-simulation.

    Returns
    -------
    Path
        The written file, `out`.

    Raises
    ------
    BuildError
        If a platform is not known, there is no compiler, it fails, or `out` cannot be written; or arrays in FMI 2.0.

    Examples
    --------
    >>> from pathlib import Path
    >>> from plant_fmu import build_fmu, load_vehicle
    >>> build_fmu(load_vehicle("odin"), 3, Path("odin.fmu")).name
    'odin.fmu'
    """
    require_version(fmi)
    out = Path(out)
    if isinstance(what, Vehicle):
        component = make_vehicle_component(what, coupled=coupled, arrays=arrays, small=small)
    elif coupled or arrays or small:
        raise BuildError("coupled, arrays and small are for a vehicle, expected none of them with a component")
    else:
        component = what
    if fmi == 2 and any(v.array for v in component.variables):
        raise BuildError("FMI version is 2, expected 3 with arrays and clocks, which FMI 2.0 lacks")
    libraries_for, wasm = without_wasm(platforms)
    if wasm and fmi == 2:
        raise BuildError(
            "platform is 'wasm', expected FMI 3.0 with it: fmi-ls-wasm is a layered standard of that alone"
        )
    is_native = libraries_for == NATIVE
    targets = [native_platform()] if is_native else [] if libraries_for is None else cross_platforms(libraries_for)
    key = token(component, fmi)
    libraries = prebuilt_libraries(component, key, fmi, targets)
    if libraries is None:
        compilers = [(platform, find_compiler() if is_native else cross_compiler(platform)) for platform in targets]
        require_writable(out)
        libraries = compiled_libraries(component, key, fmi, compilers)
    wasm_members = webassembly.members(component, key) if wasm else {}
    write_archive(out, neutral_members(component, fmi) | _binaries(component, fmi, libraries) | wasm_members)
    return out


def cached_fmu(what: Vehicle | Component, fmi: int) -> Path:
    """Return the FMU of a vehicle or another component from the cache; build it first where it is missing."""
    require_version(fmi)
    name = f"{what.name}-fmi{fmi}-{_digest(what, fmi)[:16]}"
    path = Path(platformdirs.user_cache_dir("subreach")) / "fmu" / f"{name}-{_compiler_digest()}.fmu"
    if _is_intact(path):  # a damaged file is built again
        return path
    component = _component(what)
    if prebuilt_libraries(component, token(component, fmi), fmi, [native_platform()]) is None:
        try:
            find_compiler()  # so that a missing compiler is reported before anything is written
        except BuildError:
            for other in sorted(path.parent.glob(f"{name}-*.fmu")):
                if _is_intact(other):
                    return other
            raise
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not os.access(path.parent, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        log.warning("FMU cache %s: %s; building for this process alone", path.parent, error.strerror or error)
        path = _process_folder() / path.name
        if path.exists():
            return path
    return build_fmu(component, fmi, path)


def _is_intact(path: Path) -> bool:
    """Return True if a file exists and all its members have their checksums."""
    try:
        status = path.stat()
    except OSError:
        return False
    return _has_valid_checksums(path, status.st_mtime_ns, status.st_size)


@functools.lru_cache(maxsize=64)
def _has_valid_checksums(path: Path, written: int, size: int) -> bool:
    try:
        with zipfile.ZipFile(path) as archive:
            return archive.testzip() is None
    except (OSError, RuntimeError, ValueError, zipfile.BadZipFile, zlib.error, NotImplementedError):
        return False


@functools.lru_cache(maxsize=64)
def _digest(what: Vehicle | Component, fmi: int) -> str:
    """Return a digest of everything that an FMU for this machine is made from."""
    # The digest takes longer than loading an FMU, so a process computes it once for each vehicle.
    return digest(neutral_members(what, fmi), native_platform().name, *FLAGS, fmpy.__version__)


def _compiler_digest() -> str:
    """Return a digest of the compiler: each compiler makes other bytes of the same sources."""
    with contextlib.suppress(BuildError):
        return digest({}, *prebuilt_files(), *find_compiler())[:8]
    return digest({}, *prebuilt_files())[:8]


@functools.cache
def _process_folder() -> Path:
    """Return a temporary folder that is removed with the process."""
    stack = contextlib.ExitStack()
    atexit.register(stack.close)
    return stack.enter_context(temporary_folder("plant_fmu-"))


def _component(what: Vehicle | Component) -> Component:
    return make_vehicle_component(what) if isinstance(what, Vehicle) else what


def neutral_members(what: Vehicle | Component, fmi: int) -> dict[str, bytes]:
    """Return all members of an FMU but the binaries, by name in the archive."""
    component = _component(what)
    key = token(component, fmi)
    sources = all_sources(component, fmi, key)
    if fmi == 3:
        sources["buildDescription.xml"] = build_description(component).encode()
    return {
        **component.contents(fmi),
        **{f"sources/{name}": data for name, data in sources.items()},
        "modelDescription.xml": model_description(component, fmi, key).encode(),
    }


def _binaries(component: Component, fmi: int, libraries: list[tuple[Platform, bytes]]) -> dict[str, bytes]:
    """Return the libraries by name in the archive."""
    libraries_by_path: dict[str, list[bytes]] = {}
    for platform, library in libraries:
        for folder in platform.fmi2_names if fmi == 2 else (platform.name,):
            libraries_by_path.setdefault(f"binaries/{folder}/{component.name}{platform.suffix}", []).append(library)
    # FMI 2.0 has one place for the libraries of both Macs
    return {
        folder: copies[0] if len(copies) == 1 else universal_library(copies)
        for folder, copies in libraries_by_path.items()
    }
