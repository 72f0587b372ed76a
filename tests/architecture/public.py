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
    "fuzzy_arbiter": "",
    "fuzzy_arbiter.export": "",
    "fuzzy_arbiter.formats": "fold_normalization load reads save writes",
    "fuzzy_arbiter.pictures": "",
    "fuzzy_arbiter.terms": "",
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
        return f"{name}{_parameters(what)} -> {what.returns or 'None'}"
    if isinstance(what, griffe.Class):
        bases = f" of {', '.join(map(str, what.bases))}" if what.bases else ""
        start = what.members.get("__init__")
        return f"{name}{_parameters(start) if isinstance(start, griffe.Function) else ''}{bases}"
    return f"{name}: {what.annotation}" if what.annotation else name


def _parameters(function: griffe.Function) -> str:
    shown = [p for p in function.parameters if p.name not in ("self", "cls")]
    parts, kind = [], griffe.ParameterKind
    for i, p in enumerate(shown):
        if p.kind is kind.keyword_only and not any(
            q.kind in (kind.keyword_only, kind.var_positional) for q in shown[:i]
        ):
            parts.append("*")
        star = {kind.var_positional: "*", kind.var_keyword: "**"}.get(p.kind, "")
        default = f" = {p.default}" if p.default is not None and not star else ""
        parts.append(f"{star}{p.name}: {p.annotation}{default}" if p.annotation else f"{star}{p.name}{default}")
        if p.kind is kind.positional_only and all(q.kind is not kind.positional_only for q in shown[i + 1 :]):
            parts.append("/")
    return f"({', '.join(parts)})"


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
