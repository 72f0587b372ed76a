"""The shared libraries of an FMU, compiled from its C sources."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

import fmpy

from plant_fmu.archive import temporary_folder
from plant_fmu.compiling.compiler import FLAGS, compile_library
from plant_fmu.compiling.platforms import Platform
from plant_fmu.compiling.sources import all_sources, compiled_files
from plant_fmu.component import Component

FMI_HEADERS = Path(fmpy.__file__).parent / "c-code"
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)


def compiled_libraries(
    component: Component, token: str, fmi: int, compilers: Sequence[tuple[Platform, list[str]]]
) -> list[tuple[Platform, bytes]]:
    """Compile a component for some platforms."""
    libraries = []
    with temporary_folder("plant_fmu-") as folder:
        for name, data in all_sources(component, fmi, token).items():
            (folder / name).write_bytes(data)
        files = [folder / file for file in compiled_files(component, fmi)]
        for platform, compiler in compilers:
            library = folder / platform.name / f"{component.name}{platform.suffix}"
            library.parent.mkdir()
            compile_library(compiler, platform, files, [folder, FMI_HEADERS], library)
            libraries.append((platform, library.read_bytes()))
    return libraries


def source_digest(component: Component, token: str, fmi: int) -> str:
    """Return a digest of the sources, headers and flags of libraries, independent of platform and compiler."""
    files = all_sources(component, fmi, token)
    for file in FMI_HEADERS.glob(f"fmi{fmi}*.h"):
        declared = _COMMENT.sub(" ", file.read_text(encoding="utf-8"))  # without what differs between releases of FMPy
        files[f"fmi/{file.name}"] = " ".join(declared.split()).encode()
    return digest(files, *FLAGS)


def digest(files: dict[str, bytes], *words: str) -> str:
    """Return a digest of files and words."""
    sha256 = hashlib.sha256(" ".join(words).encode())
    for name, data in sorted(files.items()):
        sha256.update(f"\n{name} {len(data)}\n".encode() + data)
    return sha256.hexdigest()
