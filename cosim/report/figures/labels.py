"""Placement of labels at regions and features, without overlap of other labels or of the path."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.path import Path

from cosim.report.figures.layout import short
from cosim.simulation.signals import Array

_LETTER, _HIGH = 0.066, 0.130  # inches, width of a letter and height of a line at the size below
_MARK = 0.06  # inches, radius of a marker
_MAX_SHARE = 0.7  # fraction of the picture's width and height; larger areas get their label in a corner
_SIZE = 7
_COLOR = "#333333"
_CORNERS = np.array([[i, j] for i in (-1.0, 1.0) for j in (-1.0, 1.0)])


class Labels:
    """Collects labels and places them; scale [inch/m], frame (n, 2)."""

    def __init__(self, ax: Axes, scale: float, frame: Array) -> None:
        self._ax, self._scale, self._frame = ax, scale, frame
        self._requested: list[tuple[str, Array, Array, Path]] = []

    def request(self, name: str, outline: Array) -> None:
        """Request a label for an outline, or for a marker at a point; shape (n, 2) [m, in the picture]."""
        margin = _MARK / self._scale if len(outline) == 1 else 0.0
        self._requested.append((short(name), outline.min(axis=0) - margin, outline.max(axis=0) + margin, Path(outline)))

    def place(self, path: Array) -> None:
        """Place the labels that fit, those of small outlines first, clear of a path of shape (n, 2)."""
        floor, ceiling, frame = self._frame.min(axis=0), self._frame.max(axis=0), Path(self._frame)
        placed: list[tuple[Array, Array]] = []
        for name, low, high, outline in sorted(self._requested, key=lambda label: float(np.prod(label[2] - label[1]))):
            size = np.array([_LETTER * len(name), _HIGH]) / self._scale
            low, high = np.maximum(low, floor), np.minimum(high, ceiling)
            wide = bool((high - low > _MAX_SHARE * (ceiling - floor)).all())
            for middle in _candidates(low, high, size, wide):
                label_low, label_high = middle - size / 2.0, middle + size / 2.0
                corners = middle + size / 2.0 * _CORNERS
                if not frame.contains_points(corners).all() or (wide and not outline.contains_points(corners).all()):
                    continue
                if any((label_low < b).all() and (label_high > a).all() for a, b in placed):
                    continue
                if ((path > label_low) & (path < label_high)).all(axis=1).any():
                    continue
                placed.append((label_low, label_high))
                self._ax.text(middle[0], middle[1], name, fontsize=_SIZE, color=_COLOR, ha="center", va="center")
                break


def _candidates(low: Array, high: Array, size: Array, wide: bool) -> list[Array]:
    """Return centers for a label, best first: within, then beside; for a large outline in its corners only."""
    middle, half = (low + high) / 2.0, size / 2.0
    inner, outer = (high - low) / 2.0 - 1.1 * half, (high - low) / 2.0 + 1.2 * half
    corners = list(middle + inner * _CORNERS[::-1])
    if wide:
        return [*corners, *(middle + 0.6 * (corner - middle) for corner in corners)]
    beside = [middle + outer * side for side in ([0, 1], [0, -1], [1, 0], [-1, 0])]
    if (inner < 0.0).any():
        return beside
    return [middle, *corners, middle + inner * [0, 1], middle + inner * [0, -1], *beside]
