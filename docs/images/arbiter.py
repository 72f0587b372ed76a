"""Draws the pictures of docs/arbiter.md into the folder in which it is run: ``cd docs/images && python arbiter.py``."""

from __future__ import annotations

import io
import runpy
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from fuzzy_arbiter import Arbiter, Criterion, pictures, rising

SMOKE = Criterion("smoke", on="present", off="absent", membership=rising(0.5, 3.0))
AIR = Criterion("co2", on="stale", off="fresh", membership=rising(800.0, 1400.0))
ROOM = Criterion("temperature", on="hot", off="mild", membership=rising(24.0, 28.0))
PLACE = {"smoke": 1.25, "co2": 1280.0, "temperature": 26.0}
CHATTER = Path(__file__).parents[2] / "examples" / "chatter.py"
SHOWN = (
    "crisp",
    "ramp outside the border, 10 cm",
    "hysteresis, release 5 cm outside",
    "the same, and a ramp before it",
)
COLOURS = 128  # of a picture; fewer than it has, which halves the file


def main() -> None:
    """Draw all of them."""
    building = Arbiter([SMOKE, AIR, ROOM])
    save(pictures.terms(building, "co2", at=1280.0), "terms")
    save(pictures.rules(building, PLACE, "alpha_2"), "rules")
    save(pictures.surface(building, "alpha_2", ("smoke", "co2"), {"temperature": 26.0}), "surface")
    save(pictures.decisions(building, ("smoke", "co2"), {"temperature": 25.6}), "decisions")
    at = {"co2": 1280.0, "temperature": 25.2}
    save(next(iter(pictures.normalisations(building, "smoke", at).values())), "normalisations")
    save(forms(), "forms")
    save(chatter(), "chatter")


def forms() -> Axes:
    """Compare the hierarchical rules and the complete table, of two criteria."""
    figure = Figure(figsize=(8.2, 3.0), layout="constrained")
    criteria = (Criterion("a"), Criterion("b"))
    for ax, form in zip(figure.subplots(1, 2, sharey=True), ("hierarchical", "complete"), strict=True):
        pictures.profile(Arbiter(criteria, form=form), "b", {"a": 0.9}, ax=ax)  # type: ignore[arg-type]
        ax.set_title(f"{form}, a = 0.9", fontsize=10, pad=26)
        ax.get_legend().set_title("")
        ax.label_outer()
    return ax


def chatter() -> Axes:
    """Draw some of the ways of examples/chatter.py: the obstacle's weight, and how much all weights vary."""
    example = runpy.run_path(str(CHATTER))
    time, clearances = example["measured"]()
    figure = Figure(figsize=(8.2, 6.4), layout="constrained")
    top, *panels = figure.subplots(len(SHOWN) + 1, 1, sharex=True, height_ratios=[1.2, *(1 for _ in SHOWN)])
    top.plot(time, clearances[:, 0], color=pictures.COLOURS[0], linewidth=0.6)
    top.axhline(0.0, color="#999999", linewidth=0.8)
    top.set(ylim=(-0.05, 0.25), ylabel="clearance [m]")
    for ax, name in zip(panels, SHOWN, strict=True):
        weights = example["ways"]()[name](clearances, time)
        ax.plot(time, weights[:, 0], color=pictures.COLOURS[1], linewidth=0.8)
        ax.set_title(f"{name}: total variation {example['variation'](weights):.0f}", fontsize=10, loc="left")
        ax.set(ylim=(-0.05, 1.05), ylabel="weight")
    panels[-1].set(xlim=(0.0, 5.0), xlabel="time [s]")
    return panels[-1]


def save(ax: Axes, name: str) -> None:
    """Write the figure of some axes, with few colours."""
    out = io.BytesIO()
    ax.figure.savefig(out, format="png", dpi=100)
    image = Image.open(out).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    image.save(Path(f"arbiter-{name}.png"), optimize=True)


if __name__ == "__main__":
    main()
