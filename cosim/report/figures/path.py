"""Figures of the vehicle's path among the regions, in space and in planes."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path

from cosim.report.figures.axes_box import Box
from cosim.report.figures.labels import Labels
from cosim.report.figures.layout import (
    BOTTOM,
    LEFT,
    LEGEND_ROW,
    RIGHT,
    TOP,
    WIDTH,
    legend,
    legend_rows,
    new_figure,
    plain_numbers,
)
from cosim.report.figures.shape_outlines import cover, lines_of_shape
from cosim.report.figures.style import (
    BLACK,
    PATH_COLOR,
    FigureData,
    RegionInstance,
    features_of,
    region_instances,
)
from cosim.report.figures.trajectory import SampledPath, sample_path
from cosim.results.region_colors import GOAL_COLOR
from cosim.simulation.signals import Array

SIDE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # view of north and depth, looking west
ABOVE = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # view of north and east
_TALLEST = 7.6  # inches, maximum height of both planes together
_FAINT = 0.35  # opacity of a region where it began or ended
_GAP = 0.34  # inches between the planes
_NAMED = 8  # maximum number of regions that are labeled in space


def path_3d(data: FigureData) -> Figure:
    """Draw the path, regions and goal in space, as seen from the south-east and above."""
    sampled = sample_path(data)
    low, high = _extent(data, sampled)
    wide = np.maximum(high - low, 0.4 * (high - low).max())  # least relative extent of the box along an axis
    middle = (low + high) / 2.0
    low, high = middle - wide / 2.0, middle + wide / 2.0
    entries = _entries(data, sampled)
    top = TOP + LEGEND_ROW * legend_rows(list(entries))
    box = Box(low, high)
    height = box.scale_to(WIDTH - 0.2, 4.4)
    figure = new_figure(height + top)
    ax = figure.add_axes((0.1 / WIDTH, 0.0, 1.0 - 0.2 / WIDTH, height / (height + top)))
    labels = box.draw(ax)
    clip = Path(box.outline)
    few = len(data.scenario.regions) <= _NAMED  # labels of more regions could not be assigned
    for instance in region_instances(data):
        drawn_outline = _region(ax, instance, low, high, box.view, clip)
        if drawn_outline and not instance.faint and few:
            labels.request(instance.region.name, np.vstack(drawn_outline))
    for name, color, feature in features_of(data):
        ax.plot(*(box.view @ feature), "*", color=color, markersize=9)
        labels.request(name, (box.view @ feature)[None])
    floor = np.column_stack([sampled.points[:, :2], np.full(len(sampled.points), high[2])])
    ax.plot(*(floor @ box.view.T).T, color=BLACK, linewidth=0.8, alpha=0.25)
    _path(ax, data, sampled, box.view)
    labels.place(sampled.points @ box.view.T)
    legend(figure, entries)
    return figure


def path_plane(data: FigureData) -> Figure:
    """Draw the path and the outlines of the regions from the side and from above."""
    sampled = sample_path(data)
    low, high = _extent(data, sampled)
    side, above, along = high[2] - low[2], high[1] - low[1], high[0] - low[0]
    entries = _entries(data, sampled)
    top = TOP + LEGEND_ROW * legend_rows(list(entries)) + 0.16
    across = WIDTH - LEFT - RIGHT
    scale = min(across / along, _TALLEST / (side + above))  # inches a meter
    # a narrow picture shows more of the surroundings to fill the width
    padding = (across / scale - along) / 2.0
    low, high = low - np.array([padding, 0.0, 0.0]), high + np.array([padding, 0.0, 0.0])
    total = top + scale * (side + above) + _GAP + BOTTOM
    figure = new_figure(total)
    y = total - top
    for view, axis, title in ((SIDE, 2, "from the side, looking west"), (ABOVE, 1, "from above")):
        height = scale * (high - low)[axis]
        y -= height
        ax = figure.add_axes((LEFT / WIDTH, y / total, across / WIDTH, height / total))
        y -= _GAP
        plain_numbers(ax)
        ax.set_xlim(low[0], high[0])
        ax.set_ylim(
            high[axis], low[axis]
        )  # depth points down; and so does east, seen from above, with north to the right
        ax.set_title(title, fontsize=8, loc="left", pad=3)
        ax.tick_params(labelbottom=axis == 1, length=3)
        ax.set_ylabel("depth, NED z [m]" if axis == 2 else "east, NED y [m]")
        ax.yaxis.set_label_coords((0.17 - LEFT) / across, 0.5)
        labels = Labels(ax, scale, _frame(view @ low, view @ high))
        for instance in region_instances(data):
            drawn_outline = _region(ax, instance, low, high, view)
            if drawn_outline and not instance.faint:
                labels.request(instance.region.name, np.vstack(drawn_outline))
        for name, color, feature in features_of(data):
            ax.plot(*(view @ feature), "*", color=color, markersize=9)
            labels.request(name, (view @ feature)[None])
        _targets(ax, sampled, view)
        _path(ax, data, sampled, view)
        labels.place(sampled.points @ view.T)
    ax.set_xlabel("north, NED x [m]")
    ax.xaxis.set_label_coords(0.5, (0.17 - BOTTOM) / (scale * (high - low)[1]))
    legend(figure, entries)
    return figure


def _region(
    ax: Axes, instance: RegionInstance, low: Array, high: Array, view: Array, clip: Path | None = None
) -> list[Array]:
    """Draw a region in a view, in 3D with its edges; return its visible areas."""
    lines = lines_of_shape(instance.region.shape, low - instance.shift, high - instance.shift, view)
    if lines is None:
        return []
    areas, outline, edges = (
        [line + view @ instance.shift for line in part] for part in (lines.areas, lines.outline, lines.edges)
    )
    if clip is None and cover(areas, view @ low, view @ high):
        return []  # a region that covers the whole picture is not drawn
    alpha = _FAINT if instance.faint else 1.0
    whole = Path.make_compound_path(*(Path(area, closed=True) for area in areas))
    dashes = "-" if instance.region.keep == "out" else "--"
    drawn: list[Artist] = [
        ax.add_patch(
            PathPatch(whole, color=instance.color, alpha=(0.15 if clip is None else 0.08) * alpha, linewidth=0)
        ),
        *ax.plot(*_with_gaps(outline), color=instance.color, linewidth=1.1, linestyle=dashes, alpha=alpha),
    ]
    if clip is not None:
        if edges:
            drawn += ax.plot(*_with_gaps(edges), color=instance.color, linewidth=0.5, alpha=0.7 * alpha)
        for artist in drawn:
            artist.set_clip_path(clip, ax.transData)
    return areas


def _frame(low: Array, high: Array) -> Array:
    """Return the closed outline of a picture."""
    return np.array([low, [high[0], low[1]], high, [low[0], high[1]], low])


def _path(ax: Axes, data: FigureData, sampled: SampledPath, view: Array) -> None:
    """Draw the path, in the color of a criterion while one of its regions is active."""
    flat = sampled.points @ view.T
    ax.plot(*flat.T, color=PATH_COLOR, linewidth=1.6)
    for i, criterion in enumerate(data.scenario.criteria):
        there = sampled.active_criterion == i
        if there.any():
            there[:-1] |= there[1:]  # up to the beginning of the next piece
            ax.plot(*np.where(there[:, None], flat, np.nan).T, color=criterion.color, linewidth=2.4)
    if sampled.overlap.any():
        ax.plot(*np.where(sampled.overlap[:, None], flat, np.nan).T, color=BLACK, linewidth=3)
    ax.plot(*flat[0], "x", color=BLACK, mew=2, markersize=7)
    ax.plot(*flat[-1], "o", color=BLACK, markersize=4)


def _targets(ax: Axes, sampled: SampledPath, view: Array) -> None:
    """Draw the targets that were commanded before the last one, faint, with their numbers in order."""
    for i, (middle, radius) in enumerate(sampled.targets):
        center = view @ middle
        if radius > 0.0:
            turn = np.linspace(0.0, 2.0 * np.pi, 49)
            ax.plot(
                *(center[:, None] + radius * np.array([np.cos(turn), np.sin(turn)])),
                color=GOAL_COLOR, alpha=0.6, linewidth=0.9, linestyle="--",
            )  # fmt: skip
        ax.plot(*center, "D", color=GOAL_COLOR, alpha=0.6, markersize=3)
        ax.annotate(
            str(i + 1), (center[0], center[1]), (3, 3), textcoords="offset points", fontsize=7, color=GOAL_COLOR
        )


def _entries(data: FigureData, sampled: SampledPath) -> dict[str, Artist]:
    """Return the legend entries of a path figure, for elements that are drawn."""
    shown = {secondary.criterion for secondary in data.scenario.regions}
    entries: dict[str, Artist] = {}
    if data.scenario.has_goal:
        entries["goal"] = Patch(color=GOAL_COLOR, alpha=0.4)
    entries |= {c.name: Patch(color=c.color, alpha=0.4) for c in data.scenario.criteria if c.name in shown}
    entries["path"] = Line2D([], [], color=PATH_COLOR, linewidth=1.6)
    for i, criterion in enumerate(data.scenario.criteria):
        if (sampled.active_criterion == i).any():
            entries[f"gives way to {criterion.name}"] = Line2D([], [], color=criterion.color, linewidth=2.4)
    if sampled.overlap.any():
        entries["in the overlap"] = Line2D([], [], color=BLACK, linewidth=3)
    entries["start"] = Line2D([], [], color=BLACK, linestyle="", marker="x", mew=2)
    entries["end"] = Line2D([], [], color=BLACK, linestyle="", marker="o", markersize=4)
    if sampled.targets:
        entries["earlier targets"] = Line2D([], [], color=GOAL_COLOR, linestyle="", marker="D", markersize=3)
    return entries


def _with_gaps(lines: list[Array]) -> Array:
    """Join lines with NaN between them, shape (2, n)."""
    gap = np.full((1, 2), np.nan)
    joined: Array = np.vstack([part for line in lines for part in (line, gap)]).T
    return joined


def _extent(data: FigureData, sampled: SampledPath) -> tuple[Array, Array]:
    """Return the corners of a box around path, goal and near regions, with a margin."""
    path = sampled.points
    instances = list(region_instances(data))
    all_bounds = [np.array(instance.region.shape.bounds()) + instance.shift for instance in instances]
    goals = [
        np.where(np.isfinite(bounds), bounds, path[0])
        for instance, bounds in zip(instances, all_bounds, strict=True)
        if instance.region.name == "goal" and not instance.faint
    ]
    targets = [np.array([middle - radius, middle + radius]) for middle, radius in sampled.targets]
    points = np.vstack([path, *goals, *targets])  # infinite bounds of the goal are ignored
    low, high = points.min(axis=0), points.max(axis=0)
    size = (high - low).max()
    for instance, bounds in zip(instances, all_bounds, strict=True):  # include near regions
        near = (0.1 if instance.faint else 0.5) * size
        if np.isfinite(bounds).all() and (bounds[1] >= low - near).all() and (bounds[0] <= high + near).all():
            points = np.vstack([points, np.clip(bounds, low - near, high + near)])
    points = np.vstack([points, *(feature[None] for _, _, feature in features_of(data))])
    low, high = points.min(axis=0), points.max(axis=0)
    padding = np.maximum(0.06 * (high - low).max(), (1.2 - (high - low)) / 2.0)
    return low - padding, high + padding
