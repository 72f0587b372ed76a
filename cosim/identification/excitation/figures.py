"""The figure of a design's page."""

from __future__ import annotations

from matplotlib.figure import Figure

from cosim.identification.excitation.design import BEGIN, RETURN, Design
from cosim.identification.excitation.segments import SECONDS
from cosim.report.figures.style import BLACK, NamedFigure

_CAPTION = (
    "The rehearsal: where the vehicle goes, with the numbers as they are known before. Grey: segments; between them "
    "the law brings it back. Dotted: sides of the box."
)


def figure_of(done: Design) -> NamedFigure:
    """Return the figure of the rehearsal."""
    figure = Figure(figsize=(7.2, 4.2), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    flown = done.rehearsal
    center = (0.0, 0.0, done.depth)
    for axes, name, values, middle, size in zip(
        panels, ("north [m]", "east [m]", "depth [m]"), flown.states[:, :3].T, center, done.box, strict=True
    ):
        for k in range(len(done.segments)):
            begin = BEGIN + k * (SECONDS + RETURN)
            axes.axvspan(begin, begin + SECONDS, color=BLACK, alpha=0.06, linewidth=0)
        axes.plot(flown.times, values)
        for side in (middle - 0.5 * size, middle + 0.5 * size):
            axes.axhline(side, color=BLACK, linewidth=0.8, linestyle=":")
        axes.set_ylabel(name)
    panels[2].invert_yaxis()
    panels[2].set_xlabel("time [s]")
    return NamedFigure("rehearsal", _CAPTION, figure)
