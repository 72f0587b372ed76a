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
from importlib import resources
from pathlib import Path

import fmpy
import platformdirs

from plant_fmu.compiler import FLAGS, compile_library, find_compiler, library_suffix, native_platform
from plant_fmu.description import header, model_description, token
from plant_fmu.errors import BuildError
from plant_fmu.vehicle import Vehicle

log = logging.getLogger(__name__)

FMI_VERSIONS = (2, 3)

_ZIP_DATE = (1980, 1, 1, 0, 0, 0)
# FMI 2.0 names no aarch64: FMPy looks in these folders there, and other tools take them for x86_64
_FMI2_PLATFORMS = {
    "x86_64-linux": "linux64",
    "x86_64-windows": "win64",
    "x86_64-darwin": "darwin64",
    "aarch64-linux": "linux64",
    "aarch64-windows": "win64",
    "aarch64-darwin": "darwin64",
}


def build_fmu(vehicle: Vehicle, fmi: int, out: Path) -> Path:
    """Write the FMU of a vehicle.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle, whose numbers become the start values of the FMU's parameters.
    fmi : int
        2 for FMI 2.0, 3 for FMI 3.0, both for co-simulation.
    out : Path
        The file to write; it appears whole or not at all.

    Returns
    -------
    Path
        `out`.

    Raises
    ------
    BuildError
        If there is no compiler, it fails, or `out` cannot be written.
    """
    if fmi not in FMI_VERSIONS:
        raise BuildError(f"FMI version is {fmi!r}, expected 2 or 3")
    out = Path(out)
    place = native_platform()
    with tempfile.TemporaryDirectory(prefix="plant_fmu-") as scratch:
        folder = Path(scratch)
        sources = _write_sources(folder, vehicle, fmi)
        library = folder / f"{vehicle.name}{library_suffix()}"
        compile_library(sources, [folder, Path(fmpy.__file__).parent / "c-code"], library)
        binaries = _FMI2_PLATFORMS[place] if fmi == 2 else place
        content = {
            "modelDescription.xml": _description(vehicle, fmi).encode(),
            f"binaries/{binaries}/{library.name}": library.read_bytes(),
        }
    _write_zip(out, content)
    return out


def cached_fmu(vehicle: Vehicle, fmi: int) -> Path:
    """Return the FMU of a vehicle from the cache, building it first where it is not there.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
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
    made_from = _description(vehicle, fmi).encode() + " ".join((native_platform(), *FLAGS, fmpy.__version__)).encode()
    digest = hashlib.sha256(made_from).hexdigest()[:16]
    path = Path(platformdirs.user_cache_dir("subreach")) / "fmu" / f"{vehicle.name}-fmi{fmi}-{digest}.fmu"
    if path.exists():
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
    return build_fmu(vehicle, fmi, path)


@functools.cache
def _own_folder() -> Path:
    """Return a folder that goes with the process."""
    folder = tempfile.mkdtemp(prefix="plant_fmu-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def _description(vehicle: Vehicle, fmi: int) -> str:
    return model_description(vehicle, fmi, token(vehicle, fmi, _source_bytes()))


def _sources(fmi: int | None = None) -> list[resources.abc.Traversable]:
    """Return the C files of one FMI version, or of both."""
    other = {2: "fmi3.c", 3: "fmi2.c"}.get(fmi or 0)
    folder = resources.files("plant_fmu") / "csrc"
    return sorted(
        (f for f in folder.iterdir() if f.name[-2:] in (".c", ".h") and f.name != other), key=lambda f: f.name
    )


def _source_bytes() -> bytes:
    return b"".join(file.read_bytes() for file in _sources())


def _write_sources(folder: Path, vehicle: Vehicle, fmi: int) -> list[Path]:
    """Lay out the C files and the generated header; return the files to compile."""
    for file in _sources(fmi):
        (folder / file.name).write_bytes(file.read_bytes())
    (folder / "vehicle.h").write_text(header(vehicle, token(vehicle, fmi, _source_bytes())), encoding="utf-8")
    return sorted(folder.glob("*.c"))


def _write_zip(out: Path, content: dict[str, bytes]) -> None:
    if out.is_dir() or (out.exists() and not out.is_file()):
        raise BuildError(f"{out}: exists and is no file; expected the name of a new one")
    try:
        with tempfile.NamedTemporaryFile(dir=out.parent, prefix=f".{out.name}-", delete=False) as scratch:
            pass
    except OSError as error:
        raise BuildError(f"{out}: {error.strerror or error}") from error
    try:
        with zipfile.ZipFile(scratch.name, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in sorted(content.items()):
                info = zipfile.ZipInfo(name, _ZIP_DATE)
                info.compress_type = zipfile.ZIP_DEFLATED
                info.external_attr = 0o644 << 16
                archive.writestr(info, data)
        os.chmod(scratch.name, 0o644)
        os.replace(scratch.name, out)
    except OSError as error:
        raise BuildError(f"{out}: {error.strerror or error}") from error
    finally:
        Path(scratch.name).unlink(missing_ok=True)
