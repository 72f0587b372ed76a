"""Shared code of all figures: data of the run, colors, style, and thinning of curves."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler

from controller.regions import Region
from controller.regions.region_set import of_attitude, shape_entry
from cosim.results.record import Rows
from cosim.results.region_colors import colors_of_regions
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array

# Okabe & Ito, safe for color blindness
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, RED, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
)  # fmt: skip
CYCLE = (BLUE, RED, GREEN, ORANGE, PURPLE, SKY, BLACK, YELLOW)
PATH_COLOR = BLUE

STYLE: Any = {
    "font.size": 9,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.prop_cycle": cycler(color=CYCLE),
    "legend.frameon": False,
    "lines.linewidth": 1.3,
    "svg.fonttype": "none",
    "svg.hashsalt": "subreach",
}

DPI = 160  # resolution of figures as PNG

POINTS = 1000  # number of points of a drawn curve, about the resolution of a figure's width


@dataclass(frozen=True)
class FigureData:
    """Data from which figures are drawn."""

    scenario: Scenario
    record: Rows  # selected rows of a long run
    summary: dict[str, Any]


@dataclass(frozen=True)
class NamedFigure:
    """A figure with its name and caption."""

    name: str
    caption: str
    figure: Figure

    def write(self, folder: Path, png: bool = False) -> str:
        """Write the figure into a folder as SVG, and as PNG if `png`; return the SVG."""
        svg = io.StringIO()
        self.figure.savefig(svg, format="svg", metadata={"Date": None})
        (folder / f"{self.name}.svg").write_text(svg.getvalue(), encoding="utf-8")
        if png:
            self.figure.savefig(folder / f"{self.name}.png", dpi=DPI)
        return svg.getvalue()


def thin(time: Array, signal: Array) -> tuple[Array, Array]:
    """Thin a signal to the minimum and the maximum value in each part of the time [s]."""
    n = len(time)
    if n <= 2 * POINTS:
        return time, signal
    part = -(-n // (POINTS // 2))
    whole = n // part * part
    lowest = np.where(np.isnan(signal), np.inf, signal)[:whole].reshape(-1, part).argmin(axis=1)
    highest = np.where(np.isnan(signal), -np.inf, signal)[:whole].reshape(-1, part).argmax(axis=1)
    starts = np.arange(0, whole, part)
    index = np.unique(np.concatenate([[0], starts + lowest, starts + highest, np.arange(whole, n)]))
    return time[index], signal[index]


def regions_of(scenario: Scenario) -> Iterator[tuple[Region, str]]:
    """Yield the goal and every secondary region with its color."""
    goal, *colors = colors_of_regions(scenario)
    if scenario.has_goal:
        yield scenario.goal_region, goal
    yield from zip((secondary.region for secondary in scenario.regions), colors, strict=True)


@dataclass(frozen=True)
class RegionInstance:
    """A region in space at one time."""

    region: Region
    color: str
    shift: Array  # (3,) m, NED, from the region's position in the scenario
    faint: bool  # True at the start or end of the region's motion


def region_instances(data: FigureData) -> Iterator[RegionInstance]:
    """Yield the goal at the end of the run, and each region at the time of its minimum clearance."""
    # A moving region is preceded by itself at the start and at the end, marked as faint. Regions of attitude have no
    # position and are skipped.
    dynamic = {secondary.region.name for secondary in data.scenario.regions if secondary.is_dynamic}
    for region, color in regions_of(data.scenario):
        if of_attitude(region.shape):
            continue
        shifts = shifts_of(data.record, region.name)
        clearance = data.record[f"{region.name}.clearance"]
        # NaN is not the least
        at = -1 if region.name == "goal" else int(np.argmin(np.where(np.isnan(clearance), np.inf, clearance)))
        if shifts.any() and region.name not in dynamic:
            yield RegionInstance(region, color, shifts[0], faint=True)
            yield RegionInstance(region, color, shifts[-1], faint=True)
        yield RegionInstance(region, color, shifts[at], faint=False)


def features_of(data: FigureData) -> Iterator[tuple[str, str, Array]]:
    """Yield name, color and final position [m, NED], shape (3,), of the feature of every visibility region."""
    for region, color in regions_of(data.scenario):
        cone = shape_entry(region.shape).cone
        feature = cone(region.shape).feature if cone else None
        if feature is not None:
            yield region.name, color, np.array(feature) + shifts_of(data.record, region.name)[-1]


def shifts_of(record: Rows, name: str) -> Array:
    """Return the shift of a region from its position in the scenario at each step, shape (steps, 3) [m, NED]."""
    if f"{name}.shift.x" not in record.units:
        return np.zeros((len(record), 3))
    return record.stack([f"{name}.shift.{axis}" for axis in "xyz"])
