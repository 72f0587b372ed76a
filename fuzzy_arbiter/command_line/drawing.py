"""Draw a picture of a system, and write it as a file."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.command_line.evaluation import parse_sample
from fuzzy_arbiter.definition import System, variable_names
from fuzzy_arbiter.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# kinds of picture, each with its options
PICTURES: dict[str, tuple[str, ...]] = {
    "terms": ("--input", "--output", "--at"),
    "rules": ("--output", "--at"),
    "profile": ("--input", "--at"),
    "surface": ("--input", "--output", "--at", "--relief"),
    "decisions": ("--input", "--at"),
}
IMAGES = ("png", "svg", "pdf")


def draw(
    arbiter: Arbiter, kind: str, inputs: Sequence[str], outputs: Sequence[str], at: Sequence[str], relief: bool
) -> Figure:
    """Draw a picture."""
    from fuzzy_arbiter import pictures
    from fuzzy_arbiter.pictures.style import new_axes, require_matplotlib

    require_matplotlib()
    received: dict[str, Any] = {"--input": inputs, "--output": outputs, "--at": at, "--relief": relief}
    for option, value in received.items():
        if value and option not in PICTURES[kind]:
            raise InputError(f"{kind}: got {option}, expected none but {', '.join(PICTURES[kind])}")
    system = arbiter.system
    known = {"--input": variable_names(system.inputs), "--output": variable_names(system.outputs)}

    def names(option: str, count: int) -> Sequence[str]:
        chosen = received[option] or known[option][:count]
        if len(chosen) != count:
            raise InputError(f"{kind}: {len(chosen)} of {option}, expected {count} of {', '.join(known[option])}")
        return chosen

    values: Any = parse_sample(at, system) if at or kind == "rules" else {}
    if kind != "rules" and not isinstance(values, dict):
        raise InputError(f"--at {at[0]}: expected name=value")
    ax: Any
    match kind:
        case "terms":
            return _terms(arbiter, [*inputs, *outputs] or [*known["--input"], *known["--output"]], values)
        case "rules":
            ax = pictures.rules(arbiter, values, names("--output", 1)[0])
        case "profile":
            ax = pictures.profile(arbiter, names("--input", 1)[0], values)
        case "decisions":
            first, second = names("--input", 2)
            ax = pictures.decisions(arbiter, (first, second), values)
        case _:
            (first, second), (output,) = names("--input", 2), names("--output", 1)
            axes = new_axes(6.4, 5.2, projection="3d") if relief else None
            ax = pictures.surface(arbiter, output, (first, second), values, ax=axes)
    figure: Figure = ax.figure
    return figure


def middles(at: Sequence[str], system: System) -> list[str]:
    """Return the middle of each input that a sample of names leaves open."""
    if not all("=" in word for word in at):
        return []
    named = {word.rpartition("=")[0] for word in at}
    return [f"{v.name}={(v.universe[0] + v.universe[1]) / 2.0!r}" for v in system.inputs if v.name not in named]


def _terms(arbiter: Arbiter, names: Sequence[str], at: Mapping[str, float]) -> Figure:
    from matplotlib.figure import Figure

    from fuzzy_arbiter import pictures

    for name in at:
        if name not in names:
            raise InputError(f"--at {name}: its terms are not drawn, expected one of {', '.join(names)}")
    columns = 1 if len(names) <= 2 else 2
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(5.6 * columns, 2.6 * rows), layout="constrained")
    for i, name in enumerate(names):
        pictures.terms(arbiter, name, at.get(name), ax=figure.add_subplot(rows, columns, i + 1))
    return figure


def image(figure: Figure, suffix: str) -> bytes:
    """Encode a figure as an image file; equal figures give equal bytes."""
    import matplotlib as mpl
    from matplotlib.text import Text

    undated: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    out = io.BytesIO()
    for text in figure.findobj(Text):
        text.set_parse_math(False)  # a name with dollar signs is no formula
    with mpl.rc_context({"svg.hashsalt": "fuzzy_arbiter"}):
        figure.savefig(out, format=suffix, dpi=120, metadata=undated.get(suffix))
    return out.getvalue()
