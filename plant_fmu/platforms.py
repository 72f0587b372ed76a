"""The platforms that an FMU can hold binaries for: their names in FMI, and what a compiler calls them."""

from __future__ import annotations

import platform
from dataclasses import dataclass, replace

from plant_fmu.errors import BuildError

NATIVE = "native"
ALL = "all"


@dataclass(frozen=True)
class Platform:
    """One machine and operating system."""

    name: str  # of the folder in an FMI 3.0 FMU
    fmi2_name: str  # of the folder in an FMI 2.0 FMU
    target: str  # of the ziglang package's compiler
    suffix: str  # of shared libraries

    @property
    def system(self) -> str:
        """``linux``, ``windows`` or ``darwin``."""
        return self.name.partition("-")[2]


# glibc 2.17 and macOS 11 so that a library built on a newer system also loads on older ones; the gnu target of Windows
# takes its C library from Windows itself (UCRT).
# FMI 2.0 names no 64-bit ARM. On a Mac its one name serves both processors; on Linux FMI 3.0's name is used,
# since `linux64` is x86-64 to every tool.
PLATFORMS = {
    name: Platform(name, *rest)
    for name, *rest in (
        ("x86_64-linux", "linux64", "x86_64-linux-gnu.2.17", ".so"),
        ("aarch64-linux", "aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
        ("x86_64-windows", "win64", "x86_64-windows-gnu", ".dll"),
        ("x86_64-darwin", "darwin64", "x86_64-macos.11.0", ".dylib"),
        ("aarch64-darwin", "darwin64", "aarch64-macos.11.0", ".dylib"),
    )
}

# alone on its machine a library lies where FMPy looks there: 64-bit ARM in the folders of x86-64
_NATIVE_FMI2 = {"linux": "linux64", "windows": "win64", "darwin": "darwin64"}
_ARM_WINDOWS = Platform("aarch64-windows", "win64", "aarch64-windows-gnu", ".dll")  # built where it is at home only


def native_platform() -> Platform:
    """Return this machine's platform.

    Returns
    -------
    Platform
        With the FMI 2.0 name under which importers on this machine look.

    Raises
    ------
    BuildError
        If FMI has no name for this machine.
    """
    machine = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}.get(
        platform.machine().lower()
    )
    system = {"Linux": "linux", "Windows": "windows", "Darwin": "darwin"}.get(platform.system())
    if system is None or machine is None:
        place = f"{platform.system()} on {platform.machine()}"
        raise BuildError(f"no FMU can be built here, {place}: expected Linux, Windows or macOS on x86_64 or aarch64")
    here = PLATFORMS.get(f"{machine}-{system}", _ARM_WINDOWS)
    return replace(here, fmi2_name=_NATIVE_FMI2[system])


def cross_platforms(text: str) -> list[Platform]:
    """Return the platforms that a text names.

    Parameters
    ----------
    text : str
        ``all``, or names of FMI 3.0 with commas between them.

    Returns
    -------
    list of Platform
        Each once, in the order of `PLATFORMS`.

    Raises
    ------
    BuildError
        If a name is not known.
    """
    if text == ALL:
        return list(PLATFORMS.values())
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in PLATFORMS:
            known = ", ".join(PLATFORMS)
            raise BuildError(f"platform is {name!r}, expected {NATIVE} or {ALL} alone, or some of {known}")
    return [PLATFORMS[name] for name in PLATFORMS if name in names]
