"""Axes of a box in parallel projection, seen from outside and above: far faces, scales, names of axes."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from matplotlib.ticker import MaxNLocator

from cosim.report.figures.labels import Labels
from cosim.report.figures.layout import format_tick
from cosim.report.figures.shape_outlines import hull_of
from cosim.simulation.signals import Array

_HEADING, _DOWN = np.deg2rad(-62.0), np.deg2rad(22.0)  # viewing direction: heading, and angle below the horizon
_LEFT, _BOTTOM, _ROUND = 0.62, 0.52, 0.12  # inches, margins for numbers and names, and at the other sides
_FACE, _GRID = "#f6f6f6", "#d8d8d8"


class Box:
    """A box between two corners, in parallel projection; low, high (3,) [m, NED]."""

    def __init__(self, low: Array, high: Array) -> None:
        self._low, self._high = low, high
        ahead, right = [np.cos(_HEADING), np.sin(_HEADING)], [-np.sin(_HEADING), np.cos(_HEADING)]
        # directions [NED] that point right and up in the picture
        self.view = np.array([[*right, 0.0], [*(np.sin(_DOWN) * np.array(ahead)), -np.cos(_DOWN)]])
        corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])
        self.outline = hull_of(corners, self.view)
        self._lower, self._upper = self.outline.min(axis=0), self.outline.max(axis=0)
        self._scale = 1.0  # inches a meter

    def scale_to(self, width: float, max_height: float) -> float:
        """Scale the box to a picture of a `width` and at most a `max_height`; return its height [inch]."""
        across, up = self._upper - self._lower
        self._scale = min((width - _LEFT - _ROUND) / across, (max_height - _BOTTOM - _ROUND) / up)
        self._aside = (width - _LEFT - _ROUND - self._scale * across) / 2.0  # inches
        return float(self._scale * up + _BOTTOM + _ROUND)

    def draw(self, ax: Axes) -> Labels:
        """Draw the box into axes of that size, and return the placer of labels in it."""
        scale, low, high = self._scale, self._low, self._high
        left, right = (_LEFT + self._aside) / scale, (_ROUND + self._aside) / scale
        ax.set_xlim(self._lower[0] - left, self._upper[0] + right)
        ax.set_ylim(self._lower[1] - _BOTTOM / scale, self._upper[1] + _ROUND / scale)
        ax.set_axis_off()
        # floor, northern and western face
        for across, at in ((2, high[2]), (0, high[0]), (1, low[1])):
            self._face(ax, across, at)
        near, west = np.array([low[0], high[1], high[2]]), np.array([low[0], low[1], high[2]])
        self._axis(ax, 0, near, np.array([0.35, -1.0]), "north, NED x [m]")
        self._axis(ax, 1, west, np.array([-0.5, -1.0]), "east, NED y [m]")
        self._axis(ax, 2, west, np.array([-1.0, 0.0]), "depth, NED z [m]")
        return Labels(ax, scale, self.outline)

    def _ticks(self, axis: int) -> Array:
        shown = np.zeros(3)
        shown[axis] = self._high[axis] - self._low[axis]
        inches = float(np.linalg.norm(self.view @ shown)) * self._scale
        values = MaxNLocator(max(2, min(6, int(inches / 0.42))), steps=[1, 2, 5, 10]).tick_values(
            float(self._low[axis]), float(self._high[axis])
        )
        ticks: Array = values[(values >= self._low[axis]) & (values <= self._high[axis])]
        return ticks

    def _face(self, ax: Axes, across: int, offset: float) -> None:
        u, v = (axis for axis in range(3) if axis != across)
        corners = np.empty((4, 3))
        corners[:, across] = offset
        corners[:, u] = self._low[u], self._high[u], self._high[u], self._low[u]
        corners[:, v] = self._low[v], self._low[v], self._high[v], self._high[v]
        ax.add_patch(Polygon(corners @ self.view.T, facecolor=_FACE, edgecolor=_GRID, linewidth=0.8))
        lines = []
        for along, other in ((u, v), (v, u)):
            for tick in self._ticks(along):
                line = np.empty((2, 3))
                line[:, across], line[:, along], line[:, other] = offset, tick, (self._low[other], self._high[other])
                lines += [line @ self.view.T, np.full((1, 2), np.nan)]
        if lines:
            ax.plot(*np.vstack(lines).T, color=_GRID, linewidth=0.5)

    def _axis(self, ax: Axes, axis: int, corner: Array, aside: Array, name: str) -> None:
        """Draw ticks and name of an axis along an edge; `aside` points away from the box in the picture."""
        aside = aside / np.linalg.norm(aside) / self._scale
        point = corner.copy()
        horizontal = "right" if axis else "center"
        for tick in self._ticks(axis):
            point[axis] = tick
            end = self.view @ point
            ax.plot(*np.column_stack([end, end + 0.04 * aside]), color="#555555", linewidth=0.6)
            x, y = end + 0.07 * aside
            ax.text(x, y, format_tick(tick), fontsize=8, ha=horizontal, va="center" if axis == 2 else "top")
        ends = np.array([corner, corner])
        ends[:, axis] = self._low[axis], self._high[axis]
        flat = ends @ self.view.T
        run = flat[1] - flat[0] if axis < 2 else flat[0] - flat[1]
        angle = np.rad2deg(np.arctan2(run[1], run[0]))
        x, y = flat.mean(axis=0) + 0.42 * aside
        ax.text(
            x, y, name, fontsize=8, rotation=angle, rotation_mode="anchor",
            ha="center", va="center",
        )  # fmt: skip
