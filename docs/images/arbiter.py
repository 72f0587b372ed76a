"""Draws the pictures of docs/arbiter.md into the folder in which it is run."""

from __future__ import annotations

import runpy
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from small import write

from fuzzy_arbiter import Arbiter, pictures, rising
from fuzzy_arbiter.criteria import Criterion

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
    building = Arbiter([SMOKE, AIR, ROOM])
    save(pictures.rules(building, PLACE, "co2"), "rules")
    save(pictures.decisions(building, ("smoke", "co2"), {"temperature": 25.6}), "decisions")
    save(chatter(), "chatter")


def chatter() -> Axes:
    """Draw some of the ways of examples/chatter.py: the obstacle's weight, and how much all weights vary."""
    example = runpy.run_path(str(CHATTER))
    time, clearances = example["measured"]()
    figure = Figure(figsize=(8.2, 6.4), layout="constrained")
    top, *panels = figure.subplots(len(SHOWN) + 1, 1, sharex=True, height_ratios=[1.2, *(1 for _ in SHOWN)])
    top.plot(time, clearances[:, 0], color=pictures.COLORS[0], linewidth=0.6)
    top.axhline(0.0, color="#999999", linewidth=0.8)
    top.set(ylim=(-0.05, 0.25), ylabel="clearance [m]")
    for ax, name in zip(panels, SHOWN, strict=True):
        weights = example["ways"]()[name](clearances, time)
        ax.plot(time, weights[:, 0], color=pictures.COLORS[1], linewidth=0.8)
        ax.set_title(f"{name}: total variation {example['variation'](weights):.0f}", fontsize=10, loc="left")
        ax.set(ylim=(-0.05, 1.05), ylabel="weight")
    panels[-1].set(xlim=(0.0, 5.0), xlabel="time [s]")
    return panels[-1]


def save(ax: Axes, name: str) -> None:
    """Write the figure of some axes."""
    write(ax.figure, Path(f"arbiter-{name}.png"))
