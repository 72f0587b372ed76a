"""What all figures share: the run they draw from, colours, style, and curves with few enough points."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler
from numpy.typing import NDArray

from controller.regions import Region
from cosim.record import Record
from cosim.scenario import CRITERIA, Scenario
from cosim.signals import Array

# Okabe & Ito: told apart by colour-blind readers too
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, RED, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
)  # fmt: skip
CYCLE = (BLUE, RED, GREEN, ORANGE, PURPLE, SKY, BLACK, YELLOW)
CRITERION_COLOURS = dict(zip(CRITERIA, (RED, ORANGE, SKY), strict=True))
GOAL_COLOUR = GREEN
PATH_COLOUR = BLUE

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

DPI = 160  # of figures as PNG

POINTS = 1500  # of a drawn curve: about what a figure's width resolves


@dataclass(frozen=True)
class Story:
    """What the figures draw from."""

    scenario: Scenario
    record: Record
    summary: dict[str, Any]


@dataclass(frozen=True)
class Drawing:
    """A figure with its name and caption."""

    name: str
    caption: str
    figure: Figure

    def write(self, folder: Path) -> str:
        """Write it into a folder as SVG and as PNG, and return the SVG."""
        svg = io.StringIO()
        self.figure.savefig(svg, format="svg", metadata={"Date": None})
        (folder / f"{self.name}.svg").write_text(svg.getvalue(), encoding="utf-8")
        self.figure.savefig(folder / f"{self.name}.png", dpi=DPI)
        return svg.getvalue()


def thin(time: Array, *signals: Array) -> tuple[Array, ...]:
    """Return time and signals with few enough points to draw, of each part of the time the least and the greatest.

    Parameters
    ----------
    time : ndarray, shape (n,)
        [s].
    *signals : ndarray, shape (n,)
        On that time.

    Returns
    -------
    tuple of ndarray
        Time and signals, all of one length; extremes of every signal are kept.
    """
    n = len(time)
    if n <= 2 * POINTS:
        return (time, *signals)
    part = int(np.ceil(n / (POINTS / max(1, len(signals)))))
    keep = {0, n - 1}
    for start in range(0, n, part):
        for signal in signals:
            piece = signal[start : start + part]
            keep |= {start + int(np.argmin(piece)), start + int(np.argmax(piece))}
    index = np.array(sorted(keep))
    return (time[index], *(signal[index] for signal in signals))


def regions_of(scenario: Scenario) -> Iterator[tuple[Region, str]]:
    """Yield the goal and every secondary region with its colour.

    Parameters
    ----------
    scenario : Scenario
        What was run.

    Yields
    ------
    (Region, str)
        The goal first.
    """
    yield Region("goal", scenario.goal, "in"), GOAL_COLOUR
    for secondary in scenario.regions:
        yield secondary.region, CRITERION_COLOURS[secondary.criterion]


def overlap_of(story: Story) -> NDArray[np.bool_]:
    """Return when the scenario's regions overlapped about the vehicle, shape (steps,).

    Parameters
    ----------
    story : Story
        The run.

    Returns
    -------
    ndarray of bool
        True within the windows of the summary.
    """
    time = story.record["time"]
    inside = np.zeros(len(time), dtype=bool)
    for start, end in story.summary["intersection_windows"]:
        inside |= (time >= start) & (time <= end)
    return inside
