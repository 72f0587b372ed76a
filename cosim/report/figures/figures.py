"""The figures of a run, in the order of its report: those of the paper, and further ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import islice

import matplotlib as mpl
from matplotlib.figure import Figure

from cosim.report.figures import path as in_space
from cosim.report.figures import time_series
from cosim.report.figures.layout import FIGURE_STYLE
from cosim.report.figures.panels import Column, Panel, draw_panels, overlap_columns, zoom_columns
from cosim.report.figures.style import FigureData, NamedFigure
from cosim.report.figures.trajectory import is_known, targets_of

_AFTER = {figure: f" (after Fig. {figure})" for figure in ("5a", "5b", "7")}  # captions' references to the paper


def drawings(data: FigureData, first: int = 0, every: int = 1) -> Iterator[NamedFigure]:
    """Yield the figures for which the run has data, or some of them: every n-th from the index `first`."""
    for name, caption, draw in islice(_figures(data), first, None, every):
        with mpl.rc_context(FIGURE_STYLE):
            yield NamedFigure(name, caption, draw(data))


def _figures(data: FigureData) -> Iterator[tuple[str, str, Callable[[FigureData], Figure]]]:
    """Yield name, caption, and drawing function of each figure."""
    scenario, windows = data.scenario, data.summary["intersection_windows"]
    imported, columns = bool(scenario.log), zoom_columns(data)
    zoom = " Left, where there are two: the time of the first overlap (gray)." if columns else ""
    after = dict.fromkeys(_AFTER, "") if imported else _AFTER

    def over_time(
        name: str, caption: str, panels: Callable[[FigureData], Sequence[Panel]], columns: Sequence[Column] = ()
    ) -> tuple[str, str, Callable[[FigureData], Figure]]:
        return name, caption, lambda data: draw_panels(data, panels(data), columns)

    if is_known(data):
        way = "" if imported else "; the path is in a criterion's color while the arbiter gives way to its regions"
        caption = f"Path in space{after['5a']}, seen from the south-east{way}. Gray: its shadow on the deepest plane."
        yield "path-3d", caption, in_space.path_3d
        caption = f"Path from the side and from above{after['5b']}"
        if scenario.has_goal or scenario.regions:
            caption += ", with outlines of the regions: full to be kept out of, dashed to be kept within"
        caption += f"{way}."
        if scenario.moving:
            caption += (
                " What moved is faint where it began and ended; regions are full where they were when the vehicle had "
                "minimum clearance to them."
            )
        if targets_of(data):
            caption += " Diamonds: the targets before the last one, numbered as they were commanded."
        yield "path-plane", caption, in_space.path_plane
    if scenario.has_goal:
        caption = (
            "Position error: distance from the middle of the goal over √3 (after Fig. 6; the quantity is assumed)."
        )
        yield over_time("position-error", caption, time_series.position_error)
    caption = f"Attitude{after['7']}: Euler angles from NED to the body frame."
    yield over_time("attitude", caption, time_series.attitude)
    if windows:
        caption = "Normalized weights around each overlap of regions (after Fig. 8; assumed)."
        yield over_time("weights-overlap", caption, time_series.weights_together, overlap_columns(data))
    if not imported:
        yield over_time("weights", f"Memberships and weights of the criteria.{zoom}", time_series.weights, columns)
    if scenario.has_goal:
        caption = (
            f"Clearance to the goal and to each region; red: below 0 it is violated, or the goal not reached.{zoom}"
        )
        yield over_time("clearance", caption, time_series.clearance, columns)
    if scenario.commands.enabled:
        caption = "Who steered, as it was commanded; gray where disarmed."
        yield "control-mode", caption, time_series.control_mode
    if imported:
        caption = "Velocity over ground and angular velocity, body frame."
        yield over_time("velocity", caption, time_series.velocities)
    if math.isfinite(data.summary["max_force_asked"]):
        who = "the log's commands ask" if imported else "the law asks"
        caption = (
            f"Force on the body: its norm, as {who} for it and as it acts; and what acts forward (X), to starboard (Y) "
            "and down (Z)."
        )
        yield over_time("forces", caption, time_series.forces)
        yield over_time("thrusters", time_series.thruster_caption(scenario), time_series.thrusters)
    if not imported:
        caption = (
            "Estimates of φ in (12), weight less buoyancy and its levers in body axes, against the truth (dotted)."
        )
        yield over_time("estimates", caption, time_series.estimates)
    if data.summary["lyapunov"]:
        caption = (
            "V of (31), which as printed leaves the frame where a region's gradient vanishes, and −W of (41): dV/dt "
            "where the law's wrench acts and the water rests. Red: where V is negative, or rises."
        )
        yield over_time("lyapunov", caption, time_series.lyapunov, columns)
