"""Figures of an identification's page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from cosim.identification.fit import Fit
from cosim.identification.log import UNITS
from cosim.identification.validation import Prediction
from cosim.report.figures.style import BLACK, BLUE, ORANGE, SKY, NamedFigure

_WIDTH = 7.2  # in
_MOST = 60  # most parameters in a figure


def figures_of(fit: Fit, predictions: Sequence[Prediction]) -> Iterator[NamedFigure]:
    """Yield all figures in their order."""
    yield NamedFigure("numbers", _NUMBERS, _numbers(fit))
    yield NamedFigure("residuals", _RESIDUALS, _residuals(fit))
    if predictions:
        yield NamedFigure("predictions", _PREDICTIONS, _predictions(predictions))
    yield NamedFigure("correlation", _CORRELATION, _correlation(fit))


_NUMBERS = (
    "What the runs add: each number less its start, in standard deviations of what was known before, with its "
    "95 % interval. A bar that fills the grey band rests on its prior."
)
_RESIDUALS = "Residuals of the last stage by component, in standard deviations of the sensor's noise, over all windows."
_PREDICTIONS = (
    "Free-running prediction: root mean square error of the speed and the angular velocity along and about each axis, "
    "from starts that the samples give."
)
_CORRELATION = "Correlation of the numbers: these runs hardly separate two that are dark."


def _numbers(fit: Fit) -> Figure:
    places = fit.vehicle_part()[:_MOST]
    figure = Figure(figsize=(_WIDTH, 0.7 + 0.19 * len(places)), layout="constrained")
    axes = figure.subplots()
    deviation = np.array([fit.parameters[i].deviation for i in places])
    start = np.array([fit.parameters[i].start for i in places])
    x = (fit.values[places] - start) / deviation
    half = fit.intervals.half[places] / deviation
    rows = np.arange(len(places))[::-1]
    axes.axvspan(-2.0, 2.0, color=BLACK, alpha=0.06, linewidth=0)
    axes.errorbar(x, rows, xerr=half, fmt="o", color=BLUE, markersize=3.5, linewidth=1.2)
    axes.set_yticks(rows, [fit.parameters[i].name for i in places], fontsize=7)
    axes.set(xlabel="found less start, in deviations of the prior", ylim=(-1, len(places)))
    return figure


def _residuals(fit: Fit) -> Figure:
    names = [topic.name for topic in fit.windows[0].topics]
    figure = Figure(figsize=(_WIDTH, 1.5 * len(names)), layout="constrained")
    panels = figure.subplots(len(names), 1, squeeze=False)[:, 0]
    bins = np.linspace(-5.0, 5.0, 51)
    normal = np.exp(-0.5 * np.square(bins)) / np.sqrt(2.0 * np.pi)
    for axes, name in zip(panels, names, strict=True):
        for component, values in _by_component(fit, name).items():
            axes.hist(np.clip(values, -5.0, 5.0), bins, density=True, histtype="step", label=component)
        axes.plot(bins, normal, color=BLACK, linewidth=0.8, linestyle=":")
        axes.set(ylabel=name.replace("_", " "), yticks=[])
        axes.legend(loc="upper right", ncols=3, fontsize=7)
    panels[-1].set_xlabel("residual, in standard deviations; dotted: white noise")
    return figure


def _by_component(fit: Fit, name: str) -> dict[str, np.ndarray]:
    found: dict[str, list[np.ndarray]] = {}
    for window, reduced in zip(fit.windows, fit.residuals, strict=True):
        count = 0
        for topic in window.topics:
            size = len(topic.times) * len(topic.components)
            if topic.name == name:
                rows = reduced.residual[count : count + size].reshape(-1, len(topic.components))
                for component, values in zip(topic.components, rows.T, strict=True):
                    found.setdefault(component, []).append(values)
            count += size
    return {component: np.concatenate(parts) for component, parts in found.items()}


def _predictions(predictions: Sequence[Prediction]) -> Figure:
    shown = [p for p in predictions if p.topic in ("velocity", "angular_velocity")] or list(predictions)
    figure = Figure(figsize=(_WIDTH, 1.9 * len(shown)), layout="constrained")
    panels = figure.subplots(len(shown), 1, squeeze=False)[:, 0]
    for axes, p in zip(panels, shown, strict=True):
        places = np.arange(len(p.identified))
        for k, (label, values, colour) in enumerate((
            ("identified", p.identified, BLUE), ("start vehicle", p.start_vehicle, ORANGE),
            ("hold the start velocity", p.held, SKY),
        )):  # fmt: skip
            axes.bar(places + 0.27 * (k - 1), values, 0.25, color=colour, label=label)
        axes.set_xticks(places, list("uvw" if p.topic == "velocity" else "pqr" if p.topic != "depth" else "z"))
        axes.set_ylabel(f"{p.horizon:g} s ahead [{UNITS[p.topic]}]")
    panels[0].legend(loc="upper right", fontsize=7)
    return figure


def _correlation(fit: Fit) -> Figure:
    places = fit.vehicle_part()[:_MOST]
    size = max(3.0, 0.12 * len(places) + 1.8)
    figure = Figure(figsize=(min(_WIDTH, size + 0.8), size), layout="constrained")
    axes = figure.subplots()
    drawn = axes.imshow(np.abs(fit.intervals.correlation[np.ix_(places, places)]), vmin=0.0, vmax=1.0, cmap="Greys")
    axes.set_yticks(range(len(places)), [fit.parameters[i].name for i in places], fontsize=5)
    axes.set_xticks([])
    axes.grid(visible=False)
    figure.colorbar(drawn, ax=axes, shrink=0.6, label="magnitude")
    return figure
