"""Flies the inspection with four criteria, as shipped and otherwise; its paths and weights go where it is run."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from small import write

from cosim.results.region_colors import GOAL_COLOR
from cosim.results.run_result import Run
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

FLIGHTS = {  # as labels have it: changes, color, dashes
    "as shipped": ((), "#000000", "-"),
    "visibility first": (("criteria.visibility.order=0",), "#0072B2", "--"),
    "without its pull": (("regions.view.gain=0",), "#7C8A94", ":"),
}
_INSTANTS = (0.0, 20.0, 40.0, 60.0, 80.0)  # s, at which the cone is drawn


def main() -> None:
    """Draw it."""
    figure = Figure(figsize=(8.0, 6.2), layout="constrained")
    above, over_time = figure.subplots(2, 1, height_ratios=[1.1, 1.0])
    with tempfile.TemporaryDirectory() as scratch:
        for i, (label, (changes, color, dashes)) in enumerate(FLIGHTS.items()):
            scenario = load_scenario("inspection-visibility", changes)
            run = run_scenario(scenario, Path(scratch) / str(i), report=False)
            above.plot(run.record["position.x"], run.record["position.y"], dashes, color=color, label=label)
            if not changes:
                _regions(above, run)
                _weights(over_time, run)
    above.set(xlabel="north [m]", ylabel="east [m]", ylim=(4.7, 0.0), xlim=(-2.4, 15.0), aspect="equal")
    above.legend(frameon=False, fontsize=8, loc="lower right")
    write(figure, Path("criteria-inspection.png"))


def _regions(ax: Axes, run: Run) -> None:
    scenario = run.scenario
    colors = {criterion.name: criterion.color for criterion in scenario.criteria}
    pillar, risers, _, view = (secondary.region for secondary in scenario.regions)
    for region, criterion in ((pillar, "obstacle"), (risers, "shape")):
        ax.add_patch(Circle(region.shape.start[:2], region.shape.radius, color=colors[criterion], alpha=0.35, lw=0))
        ax.annotate(region.name, region.shape.start[:2], ha="center", va="center", fontsize=8)
    cone = view.shape
    turns = np.linspace(-cone.half_angle, cone.half_angle, 25)
    outline = np.vstack([[0.0, 0.0], cone.range * np.column_stack([np.sin(turns), -np.cos(turns)]), [0.0, 0.0]])
    for time in _INSTANTS:
        moved = outline + np.array(cone.feature[:2]) + time * np.array(view.velocity[:2])
        ax.fill(*moved.T, color=colors["visibility"], alpha=0.22, lw=0)
        ax.annotate(f"{time:g} s", moved[0], (0, -9), textcoords="offset points", ha="center", fontsize=7)


def _weights(ax: Axes, run: Run) -> None:
    time, names = run.record["time"], run.scenario.criterion_names
    weights = np.column_stack([run.record[f"weight.{name}"] for name in names])
    leads = np.where(weights.max(axis=1) > 0.0, weights.argmax(axis=1), len(names))
    for i, criterion in enumerate(run.scenario.criteria):
        ax.plot(time, weights[:, i], color=criterion.color, label=criterion.name)
        ax.fill_between(time, -0.13, -0.05, where=leads == i, color=criterion.color, lw=0)
    ax.fill_between(time, -0.13, -0.05, where=leads == len(names), color=GOAL_COLOR, lw=0, label="goal alone")
    ax.set(xlabel="time [s]", ylabel="weight; below: who leads", xlim=(0.0, 80.0), ylim=(-0.15, 1.08))
    ax.legend(frameon=False, fontsize=8, ncols=5, loc="upper center", bbox_to_anchor=(0.5, 1.16))
