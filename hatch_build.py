"""The build backend: hatchling, with a hook that puts compiled libraries into wheels and source distributions.

With them vehicles' FMUs and the laws need no compiler where the package is used. A source distribution gets those of
all platforms, compiled by the ziglang package; a wheel that is built from it holds them too, and nothing is compiled
then. A wheel that is built from a checkout, as ``pip install ./fuzzy_arbiter .`` does, gets those of this machine
alone, compiled by ``cc`` where there is one, and its name says for which machine it is. An editable installation has
none and compiles when it must.

The arbiter is a distribution of its own, which `fuzzy_arbiter/pyproject.toml` describes.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling import build
from hatchling.build import *  # noqa: F403 the functions of PEP 517
from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# dependencies needed to compile the libraries
_BUILD_REQUIREMENTS = ("fmpy", "msgspec", "numpy", "platformdirs", "scipy", "tomli-w")
_COMPILE = """
import pathlib, sys
from plant_fmu.compiling.prebuilt import shipped_structures, write_prebuilt
from cosim.batch.shipped_functions import write_libraries
platforms, folder = sys.argv[1], pathlib.Path(sys.argv[2])
for package in ("plant_fmu", "controller"):
    (folder / package / "prebuilt").mkdir(parents=True)
for structure in shipped_structures():
    for fmi in (2, 3):
        write_prebuilt(structure, fmi, platforms, folder / "plant_fmu" / "prebuilt")
write_libraries(platforms, folder / "controller" / "prebuilt")
"""


class PrebuiltLibraries(BuildHookInterface):  # type: ignore[type-arg]
    """Adds ``plant_fmu/prebuilt`` and ``controller/prebuilt``."""

    PLUGIN_NAME = "custom"
    _folder: tempfile.TemporaryDirectory[str] | None = None

    def dependencies(self) -> list[str]:
        """Return what the build needs: what the package itself imports for the work, and a compiler."""
        if self._is_unpacked_sdist():
            return []
        core = self.metadata.core
        needed = [text for text in core.dependencies if text.startswith(_BUILD_REQUIREMENTS)]
        has_compiler = os.environ.get("CC") or shutil.which("cc")
        return needed if has_compiler and self._builds_wheel() else [*needed, *core.optional_dependencies["build"]]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile the libraries, unless this is an editable installation or they are there."""
        if version == "editable" or self._is_unpacked_sdist():
            return
        self._folder = tempfile.TemporaryDirectory(prefix="subreach-")
        folder = self._folder.name
        platforms = "native" if self._builds_wheel() else "all"
        subprocess.run([sys.executable, "-c", _COMPILE, platforms, folder], cwd=self.root, check=True)  # noqa: S603 - our own code
        for file in sorted(file for file in Path(folder).rglob("*") if file.is_file()):
            build_data["force_include"][str(file)] = file.relative_to(folder).as_posix()
        if self._builds_wheel():
            build_data |= {"pure_python": False, "infer_tag": True}

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the temporary folder."""
        if self._folder is not None:
            self._folder.cleanup()

    def _is_unpacked_sdist(self) -> bool:
        return (Path(self.root) / "PKG-INFO").is_file()

    def _builds_wheel(self) -> bool:
        return bool(self.target_name == "wheel")


def get_requires_for_build_editable(config_settings: dict[str, Any] | None = None) -> list[str]:
    """Return what an editable installation needs: no compiler."""
    for_wheel = build.get_requires_for_build_wheel(config_settings)
    return [text for text in build.get_requires_for_build_editable(config_settings) if text not in for_wheel]
