"""The figures of a run, in the order of its report: those of the paper, and further ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import matplotlib as mpl
from matplotlib.figure import Figure

from cosim.report.figures import forces as of_forces
from cosim.report.figures import path as in_space
from cosim.report.figures import time_series as over_time
from cosim.report.figures.layout import FIGURE_STYLE
from cosim.report.figures.style import FigureData, NamedFigure
from cosim.report.figures.trajectory import is_known, targets_of

_AFTER = {figure: f" (after Fig. {figure})" for figure in ("5a", "5b", "7")}  # captions' references to the paper


def drawings(data: FigureData) -> Iterator[NamedFigure]:
    """Yield every figure for which the run has data."""
    for name, caption, draw in _figures(data):
        with mpl.rc_context(FIGURE_STYLE):
            yield NamedFigure(name, caption, draw(data))


def _figures(data: FigureData) -> Iterator[tuple[str, str, Callable[[FigureData], Figure]]]:
    """Yield name, caption, and drawing function of each figure."""
    moving_note = ""
    if data.scenario.moving:
        moving_note = (
            " What moved is faint where it began and ended; regions are full where they were when the vehicle had "
            "minimum clearance to them."
        )
    if targets_of(data):
        moving_note += " Diamonds: the targets before the last one, numbered as they were commanded."
    way = "" if data.scenario.log else "; the path is in a criterion's color while the arbiter gives way to its regions"
    after = dict.fromkeys(("5a", "5b", "7"), "") if data.scenario.log else _AFTER
    outlines = ", with outlines of the regions: full to be kept out of, dashed to be kept within"
    if not (data.scenario.has_goal or data.scenario.regions):
        outlines = ""
    if is_known(data):
        yield (
            "path-3d",
            f"Path in space{after['5a']}, seen from the south-east{way}. Gray: its shadow on the deepest plane.",
            in_space.path_3d,
        )
        yield (
            "path-plane",
            f"Path from the side and from above{after['5b']}{outlines}{way}.{moving_note}",
            in_space.path_plane,
        )
    judged, imported = data.scenario.has_goal, bool(data.scenario.log)
    if judged:
        yield (
            "position-error",
            "Position error: distance from the middle of the goal over √3 (after Fig. 6; the quantity is assumed).",
            over_time.position_error,
        )
    yield "attitude", f"Attitude{after['7']}: Euler angles from NED to the body frame.", over_time.attitude
    if data.summary["intersection_windows"]:
        yield (
            "weights-overlap",
            "Normalized weights around each overlap of regions (after Fig. 8; assumed).",
            over_time.weights_overlap,
        )
    if not imported:
        yield "weights", f"Memberships and weights of the criteria.{_zoom(data)}", over_time.weights
    if judged:
        red = "below 0 it is violated, or the goal not reached"
        yield (
            "clearance",
            f"Clearance to the goal and to each region; red: {red}.{_zoom(data)}",
            over_time.clearance,
        )
    if data.scenario.commands.enabled:
        yield "control-mode", "Who steered, as it was commanded; gray where disarmed.", over_time.control_mode
    if imported:
        yield "velocity", "Velocity over ground and angular velocity, body frame.", over_time.velocities
    if math.isfinite(data.summary["max_force_asked"]):
        who = "the log's commands ask" if imported else "the law asks"
        yield (
            "forces",
            f"Force on the body: its norm, as {who} for it and as it acts; and what acts forward (X), to starboard "
            "(Y) and down (Z).",
            of_forces.forces,
        )
        yield "thrusters", of_forces.thruster_caption(data.scenario), of_forces.thrusters
    if not imported:
        yield (
            "estimates",
            "Estimates of φ in (12), weight less buoyancy and its levers along the body axes, against the truth "
            "(dotted).",
            of_forces.estimates,
        )
    if data.summary["lyapunov"]:
        yield (
            "lyapunov",
            "V of (31), which as printed leaves the frame where a region's gradient vanishes, and −W of (41): dV/dt "
            "where the law's wrench acts and the water rests. Red: where V is negative, or rises.",
            over_time.lyapunov,
        )


def _zoom(data: FigureData) -> str:
    return " Left, where there are two: the time of the first overlap (gray)." if over_time.zooms(data) else ""
