"""A picture of the thrusters' forces from above, from starboard and from behind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from plant_fmu.thruster_lines import ThrusterLine, thruster_lines
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class _View:
    """A direction of view; body axes are given by their indices in x, y, z."""

    title: str
    across: int  # axis that points to the right
    vertical: int  # axis that is drawn vertically
    down: bool  # the vertical axis points down
    eye: tuple[float, float, float]  # direction from the body toward the viewer


@dataclass(frozen=True, eq=False)
class _Push:
    """Thrusters with one position and one direction in a view."""

    position: Array  # (2,) m, in the view
    arrow: Array  # (2,) m, arrow in the direction of the force
    toward: float  # 1 toward the viewer, -1 away, 0 across
    numbers: str

    def along(self) -> Array:
        """Return points of the arrow."""
        return np.asarray(self.position + np.linspace(0.0, 1.0, 9)[:, None] * self.arrow)


_VIEWS = (
    _View("from above", 1, 0, False, (0.0, 0.0, -1.0)),
    _View("from starboard", 0, 2, True, (0.0, 1.0, 0.0)),
    _View("from behind", 1, 2, True, (-1.0, 0.0, 0.0)),
)
_AXES = ("x forward", "y to starboard", "z down")
_PUSH, _HULL, _WEIGHT, _BUOYANCY = "#0072b2", "#999999", "#d55e00", "#009e73"
_FLAT = 0.2  # component of a unit force in the plane of a view below which it is drawn as a dot or a cross
_SAME_POSITION = 1e-3  # distance within which points coincide, as a fraction of the vehicle's reach
# fractions of that reach: half a view, an arrow, the distance to a number, a letter
_HALF_VIEW, _ARROW, _TEXT_DISTANCE, _LETTER = 1.7, 0.42, 0.17, 0.06
_N_CANDIDATES = 16  # candidate positions of the numbers around an end of an arrow
_NOTE = (
    "An arrow is the force of a positive command; a dot points at you, a cross away from you. A vehicle's file has the "
    "thrusters' wrenches alone:\neach stands at the point of its line of action that is nearest to the body origin."
)


def thrusters(vehicle: Vehicle) -> Figure:
    """Return a picture of the thrusters' forces."""
    from matplotlib.figure import Figure

    lines = thruster_lines(vehicle)
    reach = max([0.05, vehicle.hull_radius, *(float(np.abs(line.nearest).max()) for line in lines)])
    figure = Figure(figsize=(12.0, 5.2), layout="constrained")
    figure.suptitle(f"{vehicle.title}: {vehicle.n_thrusters} thrusters", fontsize=12, x=0.02, ha="left")
    for ax, view in zip(figure.subplots(1, len(_VIEWS)), _VIEWS, strict=True):
        _draw_view(ax, view, vehicle, lines, reach)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=8, frameon=False, ncols=2, loc="outside upper right")
    without_force = [str(i + 1) for i, line in enumerate(lines) if not line.force.any()]
    footnote = f"\nThrusters that give only a moment are left out: {', '.join(without_force)}." if without_force else ""
    figure.supxlabel(_NOTE + footnote, fontsize=8, color="#555555")
    return figure


def _draw_view(ax: Axes, view: _View, vehicle: Vehicle, lines: list[ThrusterLine], reach: float) -> None:
    from matplotlib.patches import Circle

    plane = [view.across, view.vertical]
    if vehicle.hull_radius > 0.0:
        ax.add_patch(Circle((0.0, 0.0), vehicle.hull_radius, fill=False, edgecolor=_HULL, linestyle=":"))
    for point, color, marker, label in (
        (vehicle.r_G, _WEIGHT, "v", "center of gravity"),
        (vehicle.r_B, _BUOYANCY, "^", "center of buoyancy"),
    ):
        ax.plot(*point[plane], marker, color=color, markersize=5, fillstyle="none", label=label)
    pushes = [
        _Push(np.array(position), np.array(direction[:2]) * _ARROW * reach, direction[2], numbers)
        for position, members in _group_by_position(lines, plane, reach).items()
        for direction, numbers in _group_by_direction(lines, members, view).items()
    ]
    for push in pushes:
        _draw_push(ax, push)
    occupied = np.vstack([np.zeros((0, 2)), *(push.along() for push in pushes)])
    for push in pushes:
        width = _LETTER * reach * np.array([len(push.numbers) / 2.0, 0.0])
        position = _free_position(push, width, occupied, _TEXT_DISTANCE * reach)
        font: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 10, "fontweight": "bold"}
        ax.text(float(position[0]), float(position[1]), push.numbers, color=_PUSH, **font)
        occupied = np.vstack([occupied, position, position - width, position + width])
    limit = _HALF_VIEW * reach
    ax.set(xlim=(-limit, limit), ylim=(limit, -limit) if view.down else (-limit, limit), aspect="equal")
    ax.set_title(view.title, fontsize=10)
    ax.set_xlabel(f"{_AXES[view.across]} [m]", fontsize=9)
    ax.set_ylabel(f"{_AXES[view.vertical]} [m]", fontsize=9)
    ax.tick_params(labelsize=8)
    ax.grid(color="#e4e4e4", linewidth=0.6)
    ax.set_axisbelow(True)


def _group_by_position(
    lines: list[ThrusterLine], plane: list[int], reach: float
) -> dict[tuple[float, float], list[int]]:
    """Group the thrusters by their position in a view; thrusters behind each other share one."""
    groups: dict[tuple[float, float], list[int]] = {}
    for i, line in enumerate(lines):
        if not line.force.any():
            continue
        x, y = (float(component) for component in line.nearest[plane])
        near = (position for position in groups if abs(position[0] - x) + abs(position[1] - y) < _SAME_POSITION * reach)
        groups.setdefault(next(near, (x, y)), []).append(i)
    return groups


def _group_by_direction(
    lines: list[ThrusterLine], members: list[int], view: _View
) -> dict[tuple[float, float, float], str]:
    """Group thrusters by the direction of their force: (x, y, 0) in the plane of a view, or (0, 0, ±1) across it."""
    groups: dict[tuple[float, float, float], str] = {}
    for i in members:
        force = lines[i].force / np.linalg.norm(lines[i].force)
        x, y = (round(float(component), 3) for component in force[[view.across, view.vertical]])
        direction = (x, y, 0.0) if np.hypot(x, y) >= _FLAT else (0.0, 0.0, float(np.sign(force @ np.array(view.eye))))
        groups[direction] = f"{groups[direction]}, {i + 1}" if direction in groups else f"{i + 1}"
    return groups


def _draw_push(ax: Axes, push: _Push) -> None:
    position = (float(push.position[0]), float(push.position[1]))
    if push.toward:
        ax.plot(*position, "o", color=_PUSH, markersize=13, fillstyle="none", markeredgewidth=1.5)
        ax.plot(*position, "." if push.toward > 0.0 else "x", color=_PUSH, markersize=8)
    else:
        arrow = {"arrowstyle": "-|>", "color": _PUSH, "linewidth": 1.6, "shrinkA": 0.0, "shrinkB": 0.0}
        end = push.position + push.arrow
        ax.annotate("", xy=(float(end[0]), float(end[1])), xytext=position, arrowprops=arrow)
        ax.plot(*position, "o", color=_PUSH, markersize=4)


def _free_position(push: _Push, width: Array, occupied: Array, distance: float) -> Array:
    """Return the position for a push's numbers that is farthest from everything drawn."""
    angles = np.linspace(0.0, 2.0 * np.pi, _N_CANDIDATES, endpoint=False)
    around = distance * np.column_stack([np.cos(angles), np.sin(angles)])
    candidates = np.vstack([push.position + around, push.position + push.arrow + around])
    texts = np.stack([candidates - width, candidates, candidates + width], axis=1)
    gaps = np.linalg.norm(texts[:, :, None] - occupied, axis=3).min(axis=(1, 2))
    return np.asarray(candidates[int(np.argmax(np.round(gaps, 9)))])
