"""Where the vehicle went: its path among the regions, in space and in the planes."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from controller.regions import Region, clearances_at
from cosim.drawing import (
    BLACK,
    PATH_COLOUR,
    POINTS,
    Place,
    Story,
    features_of,
    labels_of,
    legend_columns,
    overlap_of,
    places_of,
)
from cosim.signals import Array

_GRID = 140  # points a side, where outlines of regions are searched
_SLICES = 41  # along the line of sight
_TALLEST = 10.0  # inches
_FAINT = 0.35  # opacity of a region where it began or ended


def path_3d(story: Story) -> Figure:
    """Draw the path, regions and goal in space."""
    record = story.record
    figure = Figure(figsize=(6.8, 4.6))
    ax: Any = figure.add_axes((0.0, 0.07, 1.0, 0.86), projection="3d")
    low, high = _extent(story)
    wide = np.maximum(high - low, 0.4 * (high - low).max())  # a flat path still gets a box with some depth
    middle = (low + high) / 2.0
    low, high = middle - wide / 2.0, middle + wide / 2.0
    rng = np.random.default_rng(0)
    for place in places_of(story):
        points = _surface_points(place, low, high, rng)
        if points.size:
            alpha = _FAINT if place.faint else 0.45
            ax.scatter(*points.T, s=3.0, color=place.colour, alpha=alpha, linewidths=0, rasterized=True)
    for name, colour, feature in features_of(story):
        ax.plot(*feature[:, None], "*", color=colour, markersize=9, label=name)
    for label, colour in _legend_of(story):
        ax.plot([], [], [], "o", color=colour, label=label)
    path = record.stack(["position.x", "position.y", "position.z"])
    ax.plot(*_thin_path(path).T, color=PATH_COLOUR, label="path")
    ax.plot(*path[0][:, None], marker="x", color=BLACK, markersize=8, mew=2, linestyle="none", label="X start")
    overlap = overlap_of(story)
    if overlap.any():
        inside = path[overlap]
        ax.plot(*inside.T, color=BLACK, linewidth=3, label="I overlap")
        ax.text(*(inside[len(inside) // 2] + [0.0, 0.0, -0.12 * wide[2]]), "I", fontweight="bold", ha="center")
    ax.set(xlabel="north x [m]", ylabel="east y [m]", zlabel="depth z [m]")
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_zlim(high[2], low[2])
    ax.yaxis.set_major_locator(MaxNLocator(4))
    ax.set_box_aspect(wide)
    ax.view_init(elev=20, azim=-70)
    figure.legend(loc="upper center", ncols=legend_columns(ax.get_legend_handles_labels()[1]))
    return figure


def path_plane(story: Story) -> Figure:
    """Draw the path and the silhouettes of the regions in the vertical and the horizontal plane."""
    record = story.record
    low, high = _extent(story)
    side, top = high[2] - low[2], high[1] - low[1]
    height = min(2.0 + 6.0 * (side + top) / (high[0] - low[0]), _TALLEST)
    figure = Figure(figsize=(6.8, height), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True, height_ratios=[side, top])
    for ax, vertical, other, label in zip(axes, (2, 1), (1, 2), ("depth z [m]", "east y [m]"), strict=True):
        u, v = np.linspace(low[0], high[0], _GRID), np.linspace(low[vertical], high[vertical], _GRID)
        for place in places_of(story):
            inside = _silhouette(place, u, v, vertical, np.linspace(low[other], high[other], _SLICES))
            if inside.max() > 0.0 > inside.min():
                alpha, colours = (_FAINT if place.faint else 1.0), [place.colour]
                ax.contourf(u, v, inside, levels=[0.0, np.inf], colors=colours, alpha=0.15 * alpha)
                dashes = "solid" if place.region.keep == "out" else "dashed"
                ax.contour(u, v, inside, levels=[0.0], colors=colours, linewidths=1.2, linestyles=dashes, alpha=alpha)
        for _, colour, feature in features_of(story):
            ax.plot(feature[0], feature[vertical], "*", color=colour, markersize=9)
        ax.plot(*_thin_path(record.stack(["position.x", f"position.{'xyz'[vertical]}"])).T, color=PATH_COLOUR)
        ax.plot(record["position.x"][0], record[f"position.{'xyz'[vertical]}"][0], "x", color=BLACK, mew=2)
        ax.set_ylabel(label)
        ax.set_xlim(low[0], high[0])
        ax.set_ylim(low[vertical], high[vertical])
        ax.set_aspect("equal")
        overlap = overlap_of(story)
        if overlap.any():
            x, w = record["position.x"][overlap], record[f"position.{'xyz'[vertical]}"][overlap]
            ax.plot(x, w, color=BLACK, linewidth=3)
    axes[0].invert_yaxis()
    axes[1].set_xlabel("north x [m]")
    for label, colour in _legend_of(story):
        axes[0].plot([], [], "s", color=colour, alpha=0.5, label=label)
    for name, colour, _ in features_of(story):
        axes[0].plot([], [], "*", color=colour, markersize=9, label=name)
    axes[0].plot([], [], color=PATH_COLOUR, label="path")
    axes[0].plot([], [], "x", color=BLACK, mew=2, label="start")
    if overlap_of(story).any():
        axes[0].plot([], [], color=BLACK, linewidth=3, label="overlap")
    figure.legend(loc="outside upper center", ncols=legend_columns(axes[0].get_legend_handles_labels()[1]))
    return figure


def _legend_of(story: Story) -> list[tuple[str, str]]:
    """Return a label and its colour for each region in space, or for each colour where there are many."""
    regions = [(place.region, place.colour) for place in places_of(story) if not place.faint]
    labels = labels_of(regions)
    return [(labels[region.name], colour) for region, colour in regions if region.name in labels]


def _extent(story: Story) -> tuple[Array, Array]:
    """Return the corners of a box about the path and the goal, with some room."""
    path = story.record.stack(["position.x", "position.y", "position.z"])
    all_bounds = [(p.region.name, np.array(p.region.shape.bounds()) + p.shift) for p in places_of(story) if not p.faint]
    goals = [np.where(np.isfinite(b), b, path[0]) for name, b in all_bounds if name == "goal"]
    points = np.vstack([path, *goals])  # an endless goal needs no room
    low, high = points.min(axis=0), points.max(axis=0)
    near = 0.5 * (high - low).max()
    for _, bounds in all_bounds:  # with the regions that are not far away
        if np.isfinite(bounds).all() and (bounds[1] >= low - near).all() and (bounds[0] <= high + near).all():
            points = np.vstack([points, np.clip(bounds, low - near, high + near)])
    points = np.vstack([points, *(feature[None] for _, _, feature in features_of(story))])
    low, high = points.min(axis=0), points.max(axis=0)
    room = np.maximum(0.06 * (high - low).max(), (1.2 - (high - low)) / 2.0)
    return low - room, high + room


def _silhouette(place: Place, u: Array, v: Array, vertical: int, across: Array) -> Array:
    """Return how deep each line of sight goes into the shape, shape (len(v), len(u)); below 0 it misses."""
    other = 3 - vertical
    points = np.empty((len(across), len(v), len(u), 3))
    points[..., 0] = u
    points[..., vertical] = v[:, None]
    points[..., other] = across[:, None, None]
    kept_in = Region(place.region.name, place.region.shape, "in")
    inside = clearances_at(points.reshape(-1, 3) - place.shift, kept_in)
    return np.asarray(inside.reshape(points.shape[:-1]).max(axis=0))


def _surface_points(place: Place, low: Array, high: Array, rng: np.random.Generator, n: int = 20000) -> Array:
    """Return points near the region's surface within the box, at most some hundreds."""
    lowest, highest = (np.array(corner) + place.shift for corner in place.region.shape.bounds())
    low, high = np.maximum(low, lowest - 0.1), np.minimum(high, highest + 0.1)
    if (low >= high).any():
        return np.empty((0, 3))
    points = rng.uniform(low, high, (n, 3))
    distance = np.abs(clearances_at(points - place.shift, place.region))
    nearest = np.argsort(distance)[:700]
    found: Array = points[nearest[distance[nearest] < 0.02 * (high - low).max()]]
    return found


def _thin_path(path: Array) -> Array:
    """Return about as many points of a path as a figure resolves, evenly spaced along its length."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    wanted = np.searchsorted(length, np.linspace(0.0, length[-1], POINTS))
    thinned: Array = path[np.unique(np.minimum(wanted, len(path) - 1))]
    return thinned
