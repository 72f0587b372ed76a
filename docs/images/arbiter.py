"""Draws the pictures of docs/arbiter.md into the folder in which it is run: ``cd docs/images && python arbiter.py``."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from fuzzy_arbiter import Arbiter, Criterion, HysteresisArbiter, falling, pictures, rising

SMOKE = Criterion("smoke", on="present", off="absent", membership=rising(0.5, 3.0))
AIR = Criterion("co2", on="stale", off="fresh", membership=rising(800.0, 1400.0))
ROOM = Criterion("temperature", on="hot", off="mild", membership=rising(24.0, 28.0))
PLACE = {"smoke": 1.25, "co2": 1280.0, "temperature": 26.0}
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


def approach() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times [s] and measured clearances [m] of somebody who touches a surface twice; the noise is 1 cm."""
    time = np.arange(0.0, 5.0, 1e-3)
    clearance = 0.15 + 0.15 * np.cos(2.0 * np.pi * time / 2.5)
    return time, clearance + np.random.default_rng(1).normal(0.0, 0.01, len(time))


def chatter() -> Axes:
    """Compare a crisp criterion, a ramp, and latches."""
    time, clearance = approach()
    samples = np.clip(clearance, 0.0, 0.3)[:, None]
    sharp = Arbiter([Criterion("clearance", membership=falling(0.0, 1e-9))], outside="clip")
    soft = Arbiter([Criterion("clearance", membership=falling(0.0, 0.1))], outside="clip")
    latched = HysteresisArbiter(soft, enter=0.9, release=0.2)
    figure = Figure(figsize=(8.2, 5.6), layout="constrained")
    top, *panels = figure.subplots(4, 1, sharex=True, height_ratios=[1.2, 1, 1, 1])
    top.plot(time, clearance, color=pictures.COLOURS[0], linewidth=0.6)
    top.axhline(0.0, color="#999999", linewidth=0.8)
    top.set_ylabel("clearance [m]")
    weights = {
        "crisp: the weight is 1 where the clearance is 0 or less": sharp.batch(samples),
        "ramp of 0.1 m outside": soft.batch(samples),
        "latches on the ramp: enter at 0.9, release at 0.2": latched.scan(samples, time),
    }
    for ax, (name, weight) in zip(panels, weights.items(), strict=True):
        ax.plot(time, weight[:, 0], color=pictures.COLOURS[1], linewidth=0.8)
        variation = np.abs(np.diff(weight[:, 0])).sum()
        ax.set_title(f"{name}; total variation {variation:.0f}", fontsize=10, loc="left")
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
