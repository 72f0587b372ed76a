"""What makes a campaign the one that it is: a folder holds one, and goes on with no other."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import controller
import cosim
import fuzzy_arbiter
import plant_fmu
from cosim.scene_run import Conditions

_SOURCES = (".py", ".c", ".h", ".toml")
_LIBRARIES = ("subreach", "numba", "llvmlite", "numpy", "pyarrow", "scipy")
SCENES, SWEEP = "scenes", "sweep"  # kinds of campaigns
_NAMED = 3  # differences that a message names


@dataclass(frozen=True)
class Plan:
    """What every row of a campaign of scenes rests on."""

    law: str
    gains: dict[str, float]
    conditions: Conditions
    scenes: int
    scenes_sha256: str
    code_sha256: str  # of the sources of all packages: rows of different code are not mixed
    versions: dict[str, str]

    def table(self) -> dict[str, Any]:
        """Return it as a table for JSON."""
        return {"kind": SCENES} | asdict(self)


def plan_of(law: str, gains: Any, conditions: Conditions, scenes: int, digest: str) -> Plan:
    """Return the plan of a campaign with the code and the libraries that are here.

    Parameters
    ----------
    law : str
        One of those in `controller.LAWS`.
    gains : NamedTuple
        Of the law.
    conditions : Conditions
        How scenes are flown.
    scenes : int
        How many.
    digest : str
        Of the scenes.

    Returns
    -------
    Plan
        Any two that are equal give the same rows on the same machine.
    """
    return Plan(law, gains._asdict(), conditions, scenes, digest, code_digest(), versions())


def versions() -> dict[str, str]:
    """Return the versions of what rows depend on."""
    return {"python": platform.python_version()} | {name: _version(name) for name in _LIBRARIES}


_version = cache(metadata.version)  # which looks through files


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
    """Return in words where two plans differ.

    Parameters
    ----------
    one, other : dict
        The tables of a plan, as it stands in a folder, and as it is now.

    Returns
    -------
    str
        Such as ``"gains.k_p1 is 18.8, now 10.0"``, kind or law alone where they are others; "" where they are equal.
    """
    alone = next((key for key in ("kind", "law") if one.get(key) != other.get(key)), None)
    keys = [alone] if alone else sorted(one.keys() | other.keys())
    found = list(_differences(one, other, keys))
    more = f"; and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
    return "; ".join(found[:_NAMED]) + more


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
