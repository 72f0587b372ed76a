"""The platforms that an FMU can hold binaries for: their names in FMI and in a compiler."""

from __future__ import annotations

import platform
from dataclasses import dataclass, replace

from plant_fmu.errors import BuildError

NATIVE = "native"
ALL = "all"
WASM = "wasm"  # not the platform of a library, but a component of fmi-ls-wasm


@dataclass(frozen=True)
class Platform:
    """One machine and operating system."""

    name: str  # folder in an FMI 3.0 FMU
    fmi2_names: tuple[str, ...]  # folders in an FMI 2.0 FMU
    target: str  # name in the ziglang package's compiler
    suffix: str  # suffix of shared libraries

    @property
    def system(self) -> str:
        """``linux``, ``windows`` or ``darwin``."""
        return self.name.partition("-")[2]


# glibc 2.17 and macOS 11 so that a library built on a newer system also loads on older ones; the gnu target of Windows
# takes its C library from Windows itself (UCRT).
# FMI 2.0 has FMI 3.0's names for 64-bit ARM. Older importers know no such names, and look for a Mac's in `darwin64`:
# that one is universal, for both processors. `linux64` is x86-64 to every tool.
PLATFORMS = {
    platform.name: platform
    for platform in (
        Platform("x86_64-linux", ("linux64",), "x86_64-linux-gnu.2.17", ".so"),
        Platform("aarch64-linux", ("aarch64-linux",), "aarch64-linux-gnu.2.17", ".so"),
        Platform("x86_64-windows", ("win64",), "x86_64-windows-gnu", ".dll"),
        Platform("x86_64-darwin", ("darwin64",), "x86_64-macos.11.0", ".dylib"),
        Platform("aarch64-darwin", ("darwin64", "aarch64-darwin"), "aarch64-macos.11.0", ".dylib"),
    )
}

# in an FMU for this machine alone, a library of 64-bit ARM is also in the folders of x86-64, where FMPy looks
_NATIVE_FMI2 = {"linux": "linux64", "windows": "win64", "darwin": "darwin64"}
# built only on such a machine
_ARM_WINDOWS = Platform("aarch64-windows", ("aarch64-windows",), "aarch64-windows-gnu", ".dll")


def native_platform() -> Platform:
    """Return this machine's platform."""
    machine = platform.machine().lower()
    machine, system = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine), platform.system().lower()
    if system not in _NATIVE_FMI2 or machine not in ("x86_64", "aarch64"):
        here = f"{platform.system()} on {platform.machine()}"
        raise BuildError(f"no FMU can be built here, {here}: expected Linux, Windows or macOS on x86_64 or aarch64")
    native = PLATFORMS.get(f"{machine}-{system}", _ARM_WINDOWS)
    return replace(native, fmi2_names=tuple(dict.fromkeys((_NATIVE_FMI2[system], *native.fmi2_names))))


def without_wasm(text: str) -> tuple[str | None, bool]:
    """Remove WebAssembly from a list of platforms, and return True if it was there."""
    names = [name.strip() for name in text.split(",")]
    if WASM not in names:
        return text, False
    others = [name for name in names if name != WASM]
    return ",".join(others) if others else None, True


def cross_platforms(text: str) -> list[Platform]:
    """Parse a list of platforms."""
    if text == ALL:
        return list(PLATFORMS.values())
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in PLATFORMS:
            known = ", ".join(PLATFORMS)
            raise BuildError(f"platform is {name!r}, expected {NATIVE}, {ALL} or some of {known}; beside these {WASM}")
    return [PLATFORMS[name] for name in PLATFORMS if name in names]
