"""The figures of a run, one function each: the paper's, and what stands behind them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from controller.regions import Region, clearances_at
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

STYLE: dict[str, Any] = {
    "font.size": 9,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.prop_cycle": mpl.cycler(color=CYCLE),
    "legend.frameon": False,
    "lines.linewidth": 1.3,
    "svg.fonttype": "none",
    "svg.hashsalt": "subreach",
}

_POINTS = 1500  # of a drawn curve: about what a figure's width resolves
_GRID = 140  # points a side, where outlines of regions are searched
_SLICES = 41


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


def thin(time: Array, *signals: Array) -> tuple[Array, ...]:
    """Return time and signals with few enough points to draw; what leaves in between is the least and greatest of each part.

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
    if n <= 2 * _POINTS:
        return (time, *signals)
    part = int(np.ceil(n / (_POINTS / max(1, len(signals)))))
    keep = {0, n - 1}
    for start in range(0, n, part):
        for signal in signals:
            piece = signal[start : start + part]
            keep |= {start + int(np.argmin(piece)), start + int(np.argmax(piece))}
    index = np.array(sorted(keep))
    return (time[index], *(signal[index] for signal in signals))


def drawings(story: Story) -> Iterator[Drawing]:
    """Yield every figure that the run has something to show for.

    Parameters
    ----------
    story : Story
        Scenario, record and summary.

    Yields
    ------
    Drawing
        In the order of the report.
    """
    figures: list[tuple[str, str, Callable[[Story], Figure]]] = [
        ("path-3d", "Path in space (after Fig. 5a). X marks the start, I the overlap of regions.", path_3d),
        ("path-plane", "Path from the side and from above (after Fig. 5b); regions as silhouettes.", path_plane),
        ("position-error", "RMS position error |p − p_d|/√3 (after Fig. 6; the quantity is assumed).", position_error),
        ("attitude", "Attitude (after Fig. 7).", attitude),
        ("weights-overlap", "Normalised weights around each overlap of regions (after Fig. 8; assumed).", weights_overlap),
        ("weights", "Memberships and weights over the whole run.", weights),
        ("clearance", "Clearance to each region, negative where it is violated.", clearance),
        ("forces", "Body force: what the law asks for, and what acts.", forces),
        ("thrusters", "Thruster forces.", thrusters),
        ("estimates", "Estimated restoring parameters against the truth (dotted).", estimates),
    ]
    for name, caption, draw in figures:
        if name == "weights-overlap" and not story.summary["intersection_windows"]:
            continue
        if name == "thrusters":
            caption = thruster_caption(story.scenario)
        with mpl.rc_context(STYLE):
            yield Drawing(name, caption, draw(story))


# ---- in space --------------------------------------------------------------------------------------------------


def path_3d(story: Story) -> Figure:
    """Draw the path, regions and goal in space."""
    scenario, record = story.scenario, story.record
    figure = Figure(figsize=(6.8, 4.6))
    ax = figure.add_axes((0.0, 0.02, 1.0, 0.94), projection="3d")
    low, high = _extent(scenario, record)
    wide = np.maximum(high - low, 0.4 * (high - low).max())  # a flat path still gets a box with some depth
    middle = (low + high) / 2.0
    low, high = middle - wide / 2.0, middle + wide / 2.0
    rng = np.random.default_rng(0)
    for region, colour in _regions(scenario):
        points = _surface_points(region, low, high, rng)
        if points.size:
            ax.scatter(*points.T, s=3.0, color=colour, alpha=0.45, linewidths=0, rasterized=True)
            ax.plot([], [], [], "o", color=colour, label=region.name)
    path = record.stack(["position.x", "position.y", "position.z"])
    ax.plot(*_thin_path(path).T, color=PATH_COLOUR, label="path")
    ax.plot(*path[0][:, None], marker="x", color=BLACK, markersize=8, mew=2, linestyle="none", label="X start")
    overlap = _overlap(story)
    if overlap.any():
        inside = path[overlap]
        ax.plot(*inside.T, color=BLACK, linewidth=3, label="I overlap")
        ax.text(*(inside[len(inside) // 2] + [0.0, 0.0, -0.12 * wide[2]]), "I", fontweight="bold", ha="center")
    ax.set(xlabel="north x [m]", ylabel="east y [m]", zlabel="depth z [m]")
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_zlim(high[2], low[2])
    ax.yaxis.set_major_locator(MaxNLocator(4))
    ax.set_box_aspect(wide, zoom=1.12)
    ax.view_init(elev=20, azim=-70)
    figure.legend(loc="upper center", ncols=8)
    return figure


def path_plane(story: Story) -> Figure:
    """Draw the path and the silhouettes of the regions in the vertical and the horizontal plane."""
    scenario, record = story.scenario, story.record
    low, high = _extent(scenario, record)
    side, top = high[2] - low[2], high[1] - low[1]
    figure = Figure(figsize=(6.8, 2.0 + 6.0 * (side + top) / (high[0] - low[0])), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True, height_ratios=[side, top])
    for ax, vertical, other, label in zip(axes, (2, 1), (1, 2), ("depth z [m]", "east y [m]"), strict=True):
        u, v = np.linspace(low[0], high[0], _GRID), np.linspace(low[vertical], high[vertical], _GRID)
        for region, colour in _regions(scenario):
            inside = _silhouette(region, u, v, vertical, np.linspace(low[other], high[other], _SLICES))
            if inside.max() > 0.0 > inside.min():
                ax.contourf(u, v, inside, levels=[0.0, np.inf], colors=[colour], alpha=0.15)
                ax.contour(u, v, inside, levels=[0.0], colors=[colour], linewidths=1.2)
        ax.plot(*_thin_path(record.stack(["position.x", f"position.{'xyz'[vertical]}"])).T, color=PATH_COLOUR)
        ax.plot(record["position.x"][0], record[f"position.{'xyz'[vertical]}"][0], "x", color=BLACK, mew=2)
        ax.set_ylabel(label)
        ax.set_xlim(low[0], high[0])
        ax.set_ylim(low[vertical], high[vertical])
        ax.set_aspect("equal")
        overlap = _overlap(story)
        if overlap.any():
            x, w = record["position.x"][overlap], record[f"position.{'xyz'[vertical]}"][overlap]
            ax.plot(x, w, color=BLACK, linewidth=3)
    axes[0].invert_yaxis()
    axes[1].set_xlabel("north x [m]")
    for region, colour in _regions(scenario):
        axes[0].plot([], [], "s", color=colour, alpha=0.5, label=region.name)
    axes[0].plot([], [], color=PATH_COLOUR, label="path")
    axes[0].plot([], [], "x", color=BLACK, mew=2, label="start")
    if _overlap(story).any():
        axes[0].plot([], [], color=BLACK, linewidth=3, label="overlap")
    figure.legend(loc="outside upper center", ncols=7)
    return figure


def _regions(scenario: Scenario) -> Iterator[tuple[Region, str]]:
    yield Region("goal", scenario.goal, "in"), GOAL_COLOUR
    for secondary in scenario.regions:
        yield secondary.region, CRITERION_COLOURS[secondary.criterion]


def _extent(scenario: Scenario, record: Record) -> tuple[Array, Array]:
    """Return the corners of a box about the path and the goal, with some room."""
    path = record.stack(["position.x", "position.y", "position.z"])
    aim = np.array([scenario.initial.position])
    points = np.vstack([path, aim, _anchor(scenario)])
    low, high = points.min(axis=0), points.max(axis=0)
    room = np.maximum(0.06 * (high - low).max(), (1.2 - (high - low)) / 2.0)
    return low - room, high + room


def _anchor(scenario: Scenario) -> Array:
    """Return points of the goal that must be in the picture: the corners of its box, or the start if it has no end."""
    start = np.array(scenario.initial.position)
    centre = getattr(scenario.goal, "centre", None)
    if centre is None:
        return start[None]
    size = getattr(scenario.goal, "radius", None) or max(
        getattr(scenario.goal, "size", None) or scenario.goal.semi_axes  # type: ignore[attr-defined]
    )
    return np.array([np.array(centre) - size, np.array(centre) + size])


def _silhouette(region: Region, u: Array, v: Array, vertical: int, across: Array) -> Array:
    """Return the greatest depth inside the region's shape along each line of sight, shape (len(v), len(u)); < 0 outside."""
    other = 3 - vertical
    points = np.empty((len(across), len(v), len(u), 3))
    points[..., 0] = u
    points[..., vertical] = v[:, None]
    points[..., other] = across[:, None, None]
    inside = clearances_at(points.reshape(-1, 3), Region(region.name, region.shape, "in"))
    return np.asarray(inside.reshape(points.shape[:-1]).max(axis=0))


def _surface_points(region: Region, low: Array, high: Array, rng: np.random.Generator, n: int = 20000) -> Array:
    """Return points near the region's surface within the box, at most some hundreds."""
    shape = Region(region.name, region.shape, "in")
    if centre := getattr(region.shape, "centre", None):
        size = getattr(region.shape, "radius", None) or max(getattr(region.shape, "semi_axes", None) or region.shape.size)  # type: ignore[attr-defined]
        low, high = np.maximum(low, np.array(centre) - 1.05 * size), np.minimum(high, np.array(centre) + 1.05 * size)
        if (low >= high).any():
            return np.empty((0, 3))
    points = rng.uniform(low, high, (n, 3))
    distance = np.abs(clearances_at(points, shape))
    nearest = np.argsort(distance)[:700]
    return points[nearest[distance[nearest] < 0.02 * (high - low).max()]]


def _overlap(story: Story) -> np.ndarray[Any, np.dtype[np.bool_]]:
    time = story.record["time"]
    inside = np.zeros(len(time), dtype=bool)
    for start, end in story.summary["intersection_windows"]:
        inside |= (time >= start) & (time <= end)
    return inside


def _thin_path(path: Array) -> Array:
    """Return about as many points of a path as a figure resolves, evenly spaced along its length."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    wanted = np.searchsorted(length, np.linspace(0.0, length[-1], _POINTS))
    return path[np.unique(np.minimum(wanted, len(path) - 1))]


# ---- over time -------------------------------------------------------------------------------------------------


def _axes(height: float = 2.6, rows: int = 1) -> tuple[Figure, Any]:
    figure = Figure(figsize=(6.8, height), layout="constrained")
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    axes[-1].set_xlabel("time [s]")
    return figure, axes


def _zoomed(story: Story, height: float, rows: int = 1) -> tuple[Figure, Any]:
    """Return axes for the whole run, shape (rows, 1), or (rows, 2) with the time of the overlap on the left."""
    windows = story.summary["intersection_windows"]
    until = 1.6 * windows[0][1] if windows else np.inf
    if until > 0.4 * story.summary["simulated_time"]:
        figure, axes = _axes(height, rows)
        return figure, axes[:, None]
    figure = Figure(figsize=(6.8, height), layout="constrained")
    axes = figure.subplots(rows, 2, sharex="col", sharey="row", squeeze=False, width_ratios=[2, 3])
    for ax in axes[:, 0]:
        ax.set_xlim(0.0, until)
        ax.axvspan(*windows[0], color=BLACK, alpha=0.08)
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    return figure, axes


def _curves(axes: Any, story: Story, signals: dict[str, Array], **style: Any) -> None:
    """Draw signals into one axes, or into several that show different spans of time."""
    for ax in np.atleast_1d(axes):
        seen = story.record["time"] <= (ax.get_xlim()[1] if not ax.get_autoscalex_on() else np.inf)
        time, *thinned = thin(story.record["time"][seen], *(signal[seen] for signal in signals.values()))
        for label, signal in zip(signals, thinned, strict=True):
            ax.plot(time, signal, label=label, **style)


def _legend(figure: Figure, ax: Axes, ncols: int) -> None:
    figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=ncols)


def _symlog(ax: Axes, largest: float, linear: float) -> None:
    """Make an axis linear to about `linear` and logarithmic beyond."""
    threshold = 10.0 ** np.ceil(np.log10(max(linear, 1.0)))
    decades = 10.0 ** np.arange(np.log10(threshold), np.ceil(np.log10(largest)) + 1.0)
    ax.set_yscale("symlog", linthresh=threshold)
    ax.set_yticks([*-decades[::-1], 0.0, *decades])
    ax.set_ylim(-1.5 * largest, 1.5 * largest)


def position_error(story: Story) -> Figure:
    """Draw the RMS error to the goal's centre, or the distance to the goal where it has none."""
    figure, (ax,) = _axes()
    centre, radius = getattr(story.scenario.goal, "centre", None), getattr(story.scenario.goal, "radius", None)
    if centre is None:
        _curves(ax, story, {"distance to the goal": np.maximum(0.0, -story.record["goal.clearance"])})
        ax.set_ylabel("distance [m]")
    else:
        error = np.linalg.norm(story.record.stack([f"position.{a}" for a in "xyz"]) - np.array(centre), axis=1)
        _curves(ax, story, {"RMS error": error / np.sqrt(3.0)})
        ax.set_ylabel("RMS error [m]")
        if radius is not None:
            ax.axhline(radius / np.sqrt(3.0), color=GOAL_COLOUR, linestyle="--", label="tolerance r_v/√3")
    ax.set_ylim(bottom=0.0)
    ax.legend()
    return figure


def attitude(story: Story) -> Figure:
    """Draw roll, pitch and yaw."""
    figure, (ax,) = _axes()
    _curves(ax, story, {name: np.rad2deg(story.record[f"attitude.{name}"]) for name in ("roll", "pitch", "yaw")})
    ax.set_ylabel("Euler angle [°]")
    ax.legend(ncols=3)
    return figure


def weights_overlap(story: Story) -> Figure:
    """Draw the weights around each window in which the regions overlap, at most the first three."""
    windows = story.summary["intersection_windows"][:3]
    figure = Figure(figsize=(6.8, 2.8), layout="constrained")
    axes = figure.subplots(1, len(windows), sharey=True, squeeze=False)[0]
    time = story.record["time"]
    for ax, (start, end) in zip(axes, windows, strict=True):
        room = max(0.5 * (end - start), 5 * story.scenario.time.step)
        shown = (time >= start - room) & (time <= end + room)
        for i, name in enumerate(CRITERIA):
            weight = story.record[f"weight.{name}"][shown]
            ax.plot(time[shown], weight, color=CRITERION_COLOURS[name], label=f"α{i + 1} {name}")
        ax.axvspan(start, end, color=BLACK, alpha=0.08, label="overlap")
        ax.set_title(f"{start:.3f} s to {end:.3f} s", fontsize=9)
        ax.set_xlabel("time [s]")
    axes[0].set_ylabel("normalised weight [–]")
    axes[0].set_ylim(-0.05, 1.05)
    _legend(figure, axes[0], 4)
    return figure


def weights(story: Story) -> Figure:
    """Draw memberships and weights of each criterion."""
    figure, axes = _zoomed(story, 4.2, len(CRITERIA))
    for i, (row, name) in enumerate(zip(axes, CRITERIA, strict=True)):
        _curves(row, story, {"weight": story.record[f"weight.{name}"]}, color=CRITERION_COLOURS[name])
        _curves(row, story, {"membership": story.record[f"membership.{name}"]}, color=BLACK, linestyle=":")
        row[0].set(ylabel=f"α{i + 1} {name}", ylim=(-0.05, 1.05))
    _legend(figure, axes[0, 0], 2)
    return figure


def clearance(story: Story) -> Figure:
    """Draw the clearance to each region and to the goal."""
    figure, axes = _zoomed(story, 3.0)
    styles = ("-", "--", "-.", ":")
    for i, (region, colour) in enumerate(_regions(story.scenario)):
        signal = story.record[f"{region.name}.clearance"]
        _curves(axes[0], story, {region.name: signal}, color=colour, linestyle=styles[i % 4])
    for ax in axes[0]:
        ax.set_ylim(ax.get_ylim())
        ax.axhspan(ax.get_ylim()[0], 0.0, color=RED, alpha=0.06, linewidth=0)
        ax.axhline(0.0, color=BLACK, linewidth=0.8)
    axes[0, 0].set_ylabel("clearance [m]")
    _legend(figure, axes[0, 0], 8)
    return figure


def forces(story: Story) -> Figure:
    """Draw the norm of the body force on a logarithmic axis, and its components."""
    figure, (norm, parts) = _axes(4.6, 2)
    asked = np.linalg.norm(story.record.stack([f"command.{a}" for a in "XYZ"]), axis=1)
    acting = np.linalg.norm(story.record.stack([f"actuation.{a}" for a in "XYZ"]), axis=1)
    floor = 1e-2
    _curves(norm, story, {"acting": np.maximum(acting, floor)}, color=BLUE)
    _curves(norm, story, {"asked for": np.maximum(asked, floor)}, color=RED, linestyle="--")
    norm.set(yscale="log", ylabel="‖F‖ [N]")
    norm.legend(ncols=2)
    _curves(parts, story, {f"{a} acting": story.record[f"actuation.{a}"] for a in "XYZ"})
    largest, typical = float(acting.max()), float(np.percentile(acting, 90))
    if largest > 20.0 * max(typical, 1.0):  # a spike would flatten all the rest
        _symlog(parts, largest, typical)
    parts.set_ylabel("force [N]")
    parts.legend(ncols=3)
    return figure


def thruster_caption(scenario: Scenario) -> str:
    """Return what the thruster figure shows."""
    if scenario.actuation.through == "thrusters":
        return "Force of each thruster, and its limits (dashed)."
    return (
        "What the acting body wrench would ask of each thruster (pseudo-inverse), and what a thruster gives (dashed): "
        "in this scenario the wrench acts on the body directly, not through the thrusters."
    )


def thrusters(story: Story) -> Figure:
    """Draw the force of each thruster, or what it would have to give."""
    vehicle = story.scenario.vehicle
    if story.scenario.actuation.through == "thrusters":
        force = story.record.stack([f"thruster_force[{i + 1}]" for i in range(vehicle.n_thrusters)])
    else:
        wrench = story.record.stack([f"actuation.{a}" for a in "XYZKMN"])
        force = wrench @ np.linalg.pinv(vehicle.thruster_matrix).T
    figure, (ax,) = _axes(3.0)
    for i in range(vehicle.n_thrusters):
        style = "-" if i < len(CYCLE) // 2 else "--"
        _curves(ax, story, {str(i + 1): force[:, i]}, color=CYCLE[i % len(CYCLE)], linestyle=style, linewidth=1.0)
    lowest, highest = float(vehicle.thrust_min.min()), float(vehicle.thrust_max.max())
    for bound in (lowest, highest):
        ax.axhline(bound, color=BLACK, linestyle="--", linewidth=0.8)
    if np.abs(force).max() > 5.0 * max(highest, -lowest):
        _symlog(ax, float(np.abs(force).max()), max(highest, -lowest))
    ax.set_ylabel("thrust [N]")
    _legend(figure, ax, 8)
    return figure


def estimates(story: Story) -> Figure:
    """Draw the estimates against the truth."""
    figure, (force, moment) = _axes(4.2, 2)
    truth = story.scenario.true_restoring_parameters
    labels = ("W − B", "x_G W − x_B B", "y_G W − y_B B", "z_G W − z_B B")
    styles = ("-", "-", "--", "-")
    for i, label in enumerate(labels):
        ax, colour = (force, BLUE) if i == 0 else (moment, CYCLE[i])
        _curves(ax, story, {label: story.record[f"estimate.phi{i + 1}"]}, color=colour, linestyle=styles[i])
        ax.axhline(truth[i], color=colour, linestyle=":", linewidth=1.0)
    force.set_ylabel("φ̂1 [N]")
    moment.set_ylabel("φ̂2 … φ̂4 [N m]")
    force.legend()
    moment.legend(ncols=3)
    return figure
