"""Read definitions, describe them in words, and convert them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.errors import FormatError
from fuzzy_arbiter.files import write_atomic
from fuzzy_arbiter.hierarchy import prioritized
from fuzzy_arbiter.shapes import Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.term import Term

BUILT_IN = "section-vi"
EXPORTS = ("c", "py")


def load_system(file: str, block: str | None = None) -> System:
    """Return the system of a file, or the built-in one."""
    if file == BUILT_IN:
        return prioritized()
    from fuzzy_arbiter.formats import load

    return load(file, block)


def require_suffix(out: str, expected: Sequence[str]) -> str:
    """Return a file's suffix; require that it is one of the known ones."""
    suffix = Path(out).suffix[1:].lower()
    if suffix not in expected:
        raise FormatError(f"{out}: suffix is {Path(out).suffix!r}, expected .{', .'.join(expected)}")
    return suffix


def describe(arbiter: Arbiter) -> str:
    """Format a system in words: variables, terms, rules, norms, engine."""
    system = arbiter.system
    lines = [system.name, ""]
    for heading, variables in (("inputs", system.inputs), ("outputs", system.outputs)):
        lines.append(heading)
        for v in variables:
            low, high = v.universe
            default = ("no default" if v.default is None else f"default {v.default!r}") if isinstance(v, Output) else ""
            lines.append(f"  {v.name} in [{low!r}, {high!r}]{', ' if default else ''}{default}")
            width = max(map(len, v.term_names), default=0)
            lines += [f"    {term.name:{width}}  {_numbers(term)}" for term in v.terms]
    lines += ["", "rules", *(f"  {line}" for line in str(system).splitlines()), ""]
    norms = ["conjunction", "disjunction", "implication", "outside", "points"]
    norms[3:3] = ["normalization"] if system.normalization != "none" else []
    lines += [f"{name:14} {getattr(system, name)}" for name in norms]
    return "\n".join([*lines, f"{'engine':14} {arbiter.engine}: {arbiter.engine_reason}"])


def _numbers(term: Term) -> str:
    """Format the numbers of a term: its points, or its kind and parameters."""
    shape = term.shape
    if isinstance(shape, Shape):
        return " ".join(f"({x!r}, {degree!r})" for x, degree in shape.points)
    from fuzzy_arbiter.formats.fll_terms import parts_of

    kind, numbers, text = parts_of(shape)
    height = f", height {shape.height!r}" if isinstance(shape, Curve) and shape.height != 1.0 else ""
    words = "" if kind in ("constant", "formula") else f"{kind} "
    return f"{words}{text or ' '.join(map(repr, numbers))}{height}"


def convert(file: str, out: str, native: bool, block: str | None = None) -> None:
    """Write a system in another format, or as source code."""
    from fuzzy_arbiter.formats import FORMATS, fold_normalization, save

    suffix = require_suffix(out, (*FORMATS, *EXPORTS))
    system = load_system(file, block)
    if native:
        system = fold_normalization(system)
    if suffix not in EXPORTS:
        save(system, out)
        return
    from fuzzy_arbiter.export import to_c, to_python

    write_atomic(out, (to_c if suffix == "c" else to_python)(system).encode())
