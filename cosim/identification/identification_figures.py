"""Figures of the pages of an identification and of an excitation design."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from cosim.identification.excitation import BEGIN, RETURN, SECONDS, Design
from cosim.identification.fit import Fit
from cosim.identification.log import AXES, UNITS, Log
from cosim.identification.prediction import Prediction, predicted_samples
from cosim.report.figures.style import BLACK, BLUE, ORANGE, SKY, STYLE, NamedFigure
from cosim.report.web_page import InlineFigure, inline_figure
from cosim.simulation.signals import Array
from plant_fmu.archive import temporary_folder
from plant_fmu.vehicle import Vehicle

_WIDTH = 7.2  # in
_LOOKAHEAD = 5.0  # s, horizon of the predictions that are shown over time
_MAX_LAG = 20  # samples between residuals whose correlation is shown
_MAX_SHOWN = 60  # parameters in a figure


def inline_figures(drawings: Iterable[NamedFigure]) -> dict[str, InlineFigure]:
    """Return figures as a page shows them, by name."""
    with temporary_folder("identify-") as scratch, mpl.rc_context(STYLE):  # applies while figures are drawn
        return {drawing.name: inline_figure(drawing, scratch) for drawing in drawings}


def figures_of(
    fit: Fit, vehicle: Vehicle, predictions: Sequence[Prediction], shown: Log | None
) -> Iterator[NamedFigure]:
    """Yield all figures in their order."""
    yield NamedFigure("numbers", _NUMBERS, _numbers(fit))
    yield NamedFigure("residuals", _RESIDUALS, _residuals(fit))
    yield NamedFigure("whiteness", _WHITENESS, _whiteness(fit, vehicle))
    if predictions:
        yield NamedFigure("predictions", _PREDICTIONS, _predictions(predictions))
    if shown is not None and (course := velocity_course(shown, fit, vehicle)) is not None:
        yield NamedFigure("course", _COURSE, course)
    yield NamedFigure("correlation", _CORRELATION, _correlation(fit))


_NUMBERS = (
    "What the runs add: each number less its start, in standard deviations of what was known before, with its "
    "95 % interval. A bar that fills the gray band rests on its prior."
)
_RESIDUALS = "Residuals of the last stage by component, in standard deviations of the sensor's noise, over all windows."
_WHITENESS = (
    "Left: autocorrelation of the residuals of the velocity, or else of the first topic, by the number of samples "
    "between them. Right: their correlation with the commanded force along the same axis, that much earlier. In the "
    "gray band (95 %) they are like white noise: outside, a part of the model is missing."
)
_PREDICTIONS = (
    "Free-running prediction: root mean square error of the speed and the angular velocity along and about each axis, "
    "from starts that the samples give."
)
_COURSE = f"Velocities of a run, measured, and predicted anew every {_LOOKAHEAD:g} s from the measured state."
_CORRELATION = "Correlation of the numbers: these runs hardly separate two that are dark."
_REHEARSAL = (
    "The rehearsal: where the vehicle goes, with the numbers as they are known before. Gray: segments; between them "
    "the law brings it back. Dotted: sides of the box."
)


def _numbers(fit: Fit) -> Figure:
    indices = fit.vehicle_indices()[:_MAX_SHOWN]
    figure = Figure(figsize=(_WIDTH, 0.7 + 0.19 * len(indices)), layout="constrained")
    axes = figure.subplots()
    deviation = np.array([fit.parameters[i].deviation for i in indices])
    start = np.array([fit.parameters[i].start for i in indices])
    x = (fit.values[indices] - start) / deviation
    half = fit.intervals.half[indices] / deviation
    rows = np.arange(len(indices))[::-1]
    axes.axvspan(-2.0, 2.0, color=BLACK, alpha=0.06, linewidth=0)
    axes.errorbar(x, rows, xerr=half, fmt="o", color=BLUE, markersize=3.5, linewidth=1.2)
    axes.set_yticks(rows, [fit.parameters[i].name for i in indices], fontsize=7)
    axes.set(xlabel="found less start, in deviations of the prior", ylim=(-1, len(indices)))
    return figure


def _residuals(fit: Fit) -> Figure:
    residuals = fit.residuals_by_topic()
    figure, panels = _panels(len(residuals), 1.5)
    bins = np.linspace(-5.0, 5.0, 51)
    normal = np.exp(-0.5 * np.square(bins)) / np.sqrt(2.0 * np.pi)
    for axes, (name, rows) in zip(panels, residuals.items(), strict=True):
        for component, values in zip(AXES[name], rows.T, strict=True):
            axes.hist(np.clip(values, -5.0, 5.0), bins, density=True, histtype="step", label=component)
        axes.plot(bins, normal, color=BLACK, linewidth=0.8, linestyle=":")
        axes.set(ylabel=name.replace("_", " "), yticks=[])
        axes.legend(loc="upper right", ncols=3, fontsize=7)
    panels[-1].set_xlabel("residual, in standard deviations; dotted: white noise")
    return figure


def _whiteness(fit: Fit, vehicle: Vehicle) -> Figure:
    names = [topic.name for window in fit.windows for topic in window.topics]
    name = "velocity" if "velocity" in names else names[0]
    rows, inputs = list[Array](), list[Array]()
    for window, reduced in zip(fit.windows, fit.residuals, strict=True):
        log = fit.logs[window.run]
        topic = next((t for t in window.topics if t.name == name), None)
        if topic is None:
            continue
        forces = log.thrust @ vehicle.thruster_matrix.T + log.wrench
        times = topic.times + window.begin
        held = forces[np.clip(np.searchsorted(log.times, times, "right") - 1, 0, len(forces) - 1)]
        rows.append(window.by_topic(reduced.residual)[name])
        inputs.append(held - held.mean(axis=0))
    figure = Figure(figsize=(_WIDTH, 2.2), layout="constrained")
    both = figure.subplots(1, 2, sharex=True, sharey=True)
    band = 1.96 / np.sqrt(sum(map(len, rows)))
    for axes, others, title in zip(both, (rows, inputs), ("residual", "commanded force"), strict=True):
        axes.axhspan(-band, band, color=BLACK, alpha=0.08, linewidth=0)
        for j, component in enumerate(AXES[name][:3]):
            pairs = [(r[:, j], x[:, min(j, x.shape[1] - 1)]) for r, x in zip(rows, others, strict=True)]
            axes.plot([_correlated(pairs, lag) for lag in range(_MAX_LAG + 1)], ".-", label=component)
        axes.set(xlabel="samples between", title=f"with the {title}")
    both[0].legend(fontsize=7)
    return figure


def _correlated(pairs: Sequence[tuple[Array, Array]], lag: int) -> float:
    """Return the correlation of series with others that are `lag` samples earlier, over all windows."""
    cut = [(r[lag:], x[: len(x) - lag]) for r, x in pairs if len(r) > lag]
    products = sum(float(r @ x) for r, x in cut)
    return products / max(1e-12, math.sqrt(sum(float(r @ r) for r, _ in cut) * sum(float(x @ x) for _, x in cut)))


def _predictions(predictions: Sequence[Prediction]) -> Figure:
    shown = [p for p in predictions if p.topic in ("velocity", "angular_velocity")] or list(predictions)
    shown = [p for p in shown if p.turns_measured] or shown
    figure, panels = _panels(len(shown), 1.9)
    for axes, p in zip(panels, shown, strict=True):
        bars = np.arange(len(p.identified))
        for k, (label, values, color) in enumerate((
            ("identified", p.identified, BLUE), ("start vehicle", p.start_vehicle, ORANGE),
            ("hold the start velocity", p.constant_velocity, SKY),
        )):  # fmt: skip
            axes.bar(bars + 0.27 * (k - 1), values, 0.25, color=color, label=label)
        axes.set_xticks(bars, list(AXES[p.topic]))
        axes.set_ylabel(f"{p.horizon:g} s ahead [{UNITS[p.topic]}]")
    panels[0].legend(loc="upper right", fontsize=7)
    return figure


def velocity_course(log: Log, fit: Fit, vehicle: Vehicle) -> Figure | None:
    """Draw measured and predicted velocities of a run; None if there are none."""
    times, measured, predicted = predicted_samples(log, fit, vehicle, _LOOKAHEAD)
    if not len(times):
        return None
    figure, panels = _panels(3, 1.2, sharex=True)
    breaks = np.flatnonzero(np.diff((times - times[0]) // _LOOKAHEAD)) + 1
    for axes, component, x, y in zip(panels, AXES["velocity"], measured.T, predicted.T, strict=True):
        axes.plot(times, x, ".", color=BLUE, markersize=3, label="measured")
        axes.plot(np.insert(times, breaks, np.nan), np.insert(y, breaks, np.nan), color=ORANGE, label="predicted")
        axes.set_ylabel(f"{component} [m/s]")
    panels[0].legend(ncols=2, fontsize=7)
    panels[2].set_xlabel("time [s]")
    return figure


def _correlation(fit: Fit) -> Figure:
    indices = fit.vehicle_indices()[:_MAX_SHOWN]
    size = max(3.0, 0.12 * len(indices) + 1.8)
    figure = Figure(figsize=(min(_WIDTH, size + 0.8), size), layout="constrained")
    axes = figure.subplots()
    drawn = axes.imshow(np.abs(fit.intervals.correlation[np.ix_(indices, indices)]), vmin=0.0, vmax=1.0, cmap="Greys")
    axes.set_yticks(range(len(indices)), [fit.parameters[i].name for i in indices], fontsize=5)
    axes.set_xticks([])
    axes.grid(visible=False)
    figure.colorbar(drawn, ax=axes, shrink=0.6, label="magnitude")
    return figure


def rehearsal_figures(design: Design) -> Iterator[NamedFigure]:
    """Yield the figure of a design's rehearsal."""
    figure, panels = _panels(3, 1.4, sharex=True)
    for axes, name, values, middle, size in zip(
        panels, ("north [m]", "east [m]", "depth [m]"), design.rehearsal.states[:, :3].T, design.center, design.box,
        strict=True,
    ):  # fmt: skip
        for k in range(len(design.segments)):
            begin = BEGIN + k * (SECONDS + RETURN)
            axes.axvspan(begin, begin + SECONDS, color=BLACK, alpha=0.06, linewidth=0)
        axes.plot(design.rehearsal.times, values)
        for side in (middle - 0.5 * size, middle + 0.5 * size):
            axes.axhline(side, color=BLACK, linewidth=0.8, linestyle=":")
        axes.set_ylabel(name)
    panels[2].invert_yaxis()
    panels[2].set_xlabel("time [s]")
    yield NamedFigure("rehearsal", _REHEARSAL, figure)


def _panels(count: int, height: float, sharex: bool = False) -> tuple[Figure, Any]:
    """Return a figure with panels below each other, of a height [in] each."""
    figure = Figure(figsize=(_WIDTH, height * count), layout="constrained")
    return figure, figure.subplots(count, 1, squeeze=False, sharex=sharex)[:, 0]
