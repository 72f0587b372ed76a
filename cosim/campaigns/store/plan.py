"""Identity of a campaign: digests, versions, and differences of plans. A folder continues its own campaign only."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterator, Sequence
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import controller
import cosim
import fuzzy_arbiter
import plant_fmu

_SOURCES = (".py", ".c", ".h", ".toml")  # suffixes of files that count as sources
_LIBRARIES = ("subreach", "numpy", "pyarrow", "scipy")  # packages whose versions are part of a plan
SCENES, SWEEP = "scenes", "sweep"  # kinds of campaigns
_NAMED = 3  # maximum number of differences in a message


def versions() -> dict[str, str]:
    """Return the versions of Python and of the libraries on which rows depend."""
    return {"python": platform.python_version()} | {name: _version(name) for name in _LIBRARIES}


_version = cache(metadata.version)  # it searches files


@cache
def code_digest() -> str:
    """Return the SHA-256 of the sources of all packages."""
    digest = hashlib.sha256()
    for package in (fuzzy_arbiter, plant_fmu, controller, cosim):
        folder = Path(str(package.__file__)).parent
        for file in sorted(path for path in folder.rglob("*") if path.suffix in _SOURCES):
            digest.update(f"{folder.name}/{file.relative_to(folder).as_posix()}\n".encode() + file.read_bytes())
    return digest.hexdigest()


def difference(one: dict[str, Any], other: dict[str, Any]) -> str:
    """Describe the differences of two plans."""
    alone = next((key for key in ("kind", "law") if one.get(key) != other.get(key)), None)
    keys = [alone] if alone else sorted(one.keys() | other.keys())
    differences = list(_differences(one, other, keys))
    more = f"; and {len(differences) - _NAMED} more" if len(differences) > _NAMED else ""
    return "; ".join(differences[:_NAMED]) + more


def _differences(one: dict[Any, Any], other: dict[Any, Any], keys: Sequence[Any], prefix: str = "") -> Iterator[str]:
    for key in keys:
        a, b = one.get(key), other.get(key)
        if isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
            a, b = dict(enumerate(a)), dict(enumerate(b))
        if isinstance(a, dict) and isinstance(b, dict):
            yield from _differences(a, b, sorted(a.keys() | b.keys()), f"{prefix}{key}.")
        elif a != b:
            yield f"{prefix}{key} is {_short(a)}, now {_short(b)}"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 24 else f"{text[:10]}…"
