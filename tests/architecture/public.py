"""What is public, read from the sources with griffe; ``python -m tests.architecture.public`` writes it down anew."""

import importlib
import logging
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import griffe

from tests.architecture.modules import PACKAGES, ROOT

WRITTEN = Path(__file__).parents[1] / "data" / "public_api.txt"

# what these list as ``__all__``, or the names given here, is public; all else may change without a word
PUBLIC = {
    "controller": "",
    "controller.quaternion": "from_axis_angle rotation_matrix",
    "controller.regions": "",
    "cosim": "",
    "cosim.learning.region_env": "RegionEnv",
    "fuzzy_arbiter": "",
    "fuzzy_arbiter.criteria": "",
    "fuzzy_arbiter.export": "",
    "fuzzy_arbiter.formats": "fold_normalization load reads save writes",
    "fuzzy_arbiter.pictures": "",
    "fuzzy_arbiter.verification": "",
    "plant_fmu": "",
}


@cache
def packages() -> dict[str, griffe.Module]:
    """The four packages, as their sources have them."""
    logging.getLogger("griffe").setLevel(logging.ERROR)
    found = griffe.GriffeLoader(search_paths=[ROOT])
    for package in PACKAGES:
        found.load(package)
    return {package: found.modules_collection[package] for package in PACKAGES}


def modules(module: griffe.Module) -> Iterator[griffe.Module]:
    """A module and all below it."""
    yield module
    for inner in module.members.values():
        if isinstance(inner, griffe.Module):  # no alias of one
            yield from modules(inner)


def names() -> set[str]:
    """The full name of everything public, members of classes left out."""
    listed = set()
    for module, some in PUBLIC.items():
        listed |= {f"{module}.{name}" for name in some.split() or importlib.import_module(module).__all__}
    return listed


def target(name: str) -> griffe.Object:
    """What stands behind a public name, wherever it is defined."""
    package, _, rest = name.partition(".")
    found = packages()[package][rest]
    return found.final_target if found.is_alias else found


def members(cls: griffe.Class) -> Iterator[griffe.Object]:
    """The public members that a class itself defines, as they stand."""
    yield from (m for name, m in cls.members.items() if not (name.startswith("_") or m.is_alias or m.is_class))


def line(name: str, what: griffe.Object) -> str:
    """A public thing, its parameters and its type."""
    if isinstance(what, griffe.Function):
        return _signature(what, name) or f"{name}()"
    if isinstance(what, griffe.Class):
        bases = f" of {', '.join(map(str, what.bases))}" if what.bases else ""
        start = what.members.get("__init__")
        return (_signature(start, name) if isinstance(start, griffe.Function) else name) + bases
    return f"{name}: {what.annotation}" if what.annotation else name


def _signature(function: griffe.Function, name: str) -> str:
    shown = function.signature(name=name, return_type=function.name != "__init__")
    return shown.replace("(self, ", "(").replace("(cls, ", "(").replace("(self)", "()").replace("(cls)", "()")


def text() -> str:
    """All that is public, a line each."""
    lines = []
    for name in sorted(names()):
        what = target(name)
        lines.append(line(name, what))
        if isinstance(what, griffe.Class):
            lines += sorted(f"    {line(member.name, member)}" for member in members(what))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    WRITTEN.write_text(text())
