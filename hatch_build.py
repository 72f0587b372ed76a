"""The build backend: hatchling, with a hook that puts compiled libraries into wheels and source distributions.

With them the FMUs of vehicles need no compiler where the package is used. They are compiled for all platforms, by the
ziglang package, when a wheel or a source distribution is built from a checkout. A source distribution holds them, so
that nothing is compiled when a wheel is built from one; an editable installation has none and compiles when it must.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling import build
from hatchling.build import *  # noqa: F403 the functions of PEP 517
from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_NEEDED = ("fmpy", "msgspec", "numpy", "platformdirs")  # of the dependencies, by what writes the libraries
_COMPILE = """
import pathlib, sys
from plant_fmu.prebuilt import shipped_structures, write_prebuilt
for structure in shipped_structures():
    for fmi in (2, 3):
        write_prebuilt(structure, fmi, pathlib.Path(sys.argv[1]))
"""


class PrebuiltLibraries(BuildHookInterface):  # type: ignore[type-arg]
    """Adds ``plant_fmu/prebuilt``."""

    PLUGIN_NAME = "custom"
    _folder: tempfile.TemporaryDirectory[str] | None = None

    def dependencies(self) -> list[str]:
        """Return what the build needs: a compiler, and what the package itself imports for the work."""
        if self._is_there():
            return []
        core = self.metadata.core
        needed = [text for text in core.dependencies if text.startswith(_NEEDED)]
        return [*needed, *core.optional_dependencies["build"]]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile the libraries, unless this is an editable installation or they are there."""
        if version == "editable" or self._is_there():
            return
        self._folder = tempfile.TemporaryDirectory(prefix="subreach-")
        folder = self._folder.name
        subprocess.run([sys.executable, "-c", _COMPILE, folder], cwd=self.root, check=True)  # noqa: S603 - our own code
        for file in sorted(Path(folder).iterdir()):
            build_data["force_include"][str(file)] = f"plant_fmu/prebuilt/{file.name}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Leave nothing behind."""
        if self._folder is not None:
            self._folder.cleanup()

    def _is_there(self) -> bool:
        return (Path(self.root) / "PKG-INFO").is_file()  # an unpacked source distribution


def get_requires_for_build_editable(config_settings: dict[str, Any] | None = None) -> list[str]:
    """Return what an editable installation needs: no compiler."""
    for_wheel = build.get_requires_for_build_wheel(config_settings)
    return [text for text in build.get_requires_for_build_editable(config_settings) if text not in for_wheel]
