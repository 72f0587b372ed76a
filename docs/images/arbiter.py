"""Draws the pictures of docs/arbiter.md into the folder in which it is run."""

from __future__ import annotations

import runpy
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from small import write

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


def main() -> None:
    """Draw all of them."""
    paper = Arbiter()
    save(paper_terms(paper), "paper-terms")
    save(paper_surfaces(paper), "paper-surface")
    building = Arbiter([SMOKE, AIR, ROOM])
    save(pictures.terms(building, "co2", at=1280.0), "terms")
    save(pictures.rules(building, PLACE, "alpha_2"), "rules")
    save(pictures.surface(building, "alpha_2", ("smoke", "co2"), {"temperature": 26.0}), "surface")
    save(pictures.decisions(building, ("smoke", "co2"), {"temperature": 25.6}), "decisions")
    at = {"co2": 1280.0, "temperature": 25.2}
    save(next(iter(pictures.normalizations(building, "smoke", at).values())), "normalizations")
    save(forms(), "forms")
    save(chatter(), "chatter")


def paper_terms(paper: Arbiter) -> Axes:
    """Draw the terms of the paper's inputs, and of one of its three like outputs."""
    figure = Figure(figsize=(9.6, 4.6), layout="constrained")
    for ax, name in zip(figure.subplots(2, 2).flat, ("obstacle", "shape", "depth", "alpha_1"), strict=True):
        pictures.terms(paper, name, ax=ax)
    return ax


def paper_surfaces(paper: Arbiter) -> Axes:
    """Draw the control surface of each of the paper's weights, over the two inputs that it varies most with."""
    figure = Figure(figsize=(12.4, 3.9), layout="constrained")
    over = {"alpha_1": ("obstacle", "shape"), "alpha_2": ("obstacle", "shape"), "alpha_3": ("shape", "depth")}
    fixed = {"alpha_1": {"depth": 0.0}, "alpha_2": {"depth": 0.0}, "alpha_3": {"obstacle": 0.0}}
    for ax, output in zip(figure.subplots(1, 3), over, strict=True):
        pictures.surface(paper, output, over[output], fixed[output], ax=ax)
    return ax


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
    """Write the figure of some axes."""
    write(ax.figure, Path(f"arbiter-{name}.png"))
