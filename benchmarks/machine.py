"""The machine on which times are measured, and its load."""

from __future__ import annotations

import contextlib
import os
import platform
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

CALM = 0.6  # load average above which times are not reliable
_PACKAGES = ("numpy", "fmpy", "scikit-fuzzy", "pymavlink")


def processor() -> str:
    """Return the processor's name, as far as the system reports it, and the number of processors."""
    name = platform.processor() or platform.machine()
    with contextlib.suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        entries = dict(line.split(":", 1) for line in lines if ":" in line)
        info = {key.strip(): value.strip() for key, value in entries.items()}
        name = info.get("model name", name)
        if "cpu family" in info:
            name += f" (family {info['cpu family']}, model {info['model']})"
    return f"{name}, {os.cpu_count()} processors"


def load() -> float:
    """Return the load average over the last minute; NaN if the system does not report it."""
    try:
        return os.getloadavg()[0]
    except (AttributeError, OSError):
        return float("nan")


def versions() -> str:
    """Return the versions of Python and of the packages that this project uses."""
    versions = [f"Python {platform.python_version()}"]
    for package in _PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            versions.append(f"{package} {metadata.version(package)}")
    return ", ".join(versions)


def description(repeats: int) -> list[str]:
    """Return the heading of a table: processor, versions, repeats and load, a line each."""
    now = load()
    lines = [processor(), versions(), f"{repeats} repeats; load {now:.2f} before"]
    if now > CALM:
        lines.append(f"warning: the load is above {CALM}: others are at work here, so trust none of these figures")
    return lines


@contextlib.contextmanager
def pinned() -> Iterator[None]:
    """Keep this process, and those that it starts, on one processor in this block, if the system supports it."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
