"""Pictures over one axis: the terms of a variable, and the weights along one input."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import Output, System, Variable, variable_names
from fuzzy_arbiter.errors import InputError, UnsupportedError
from fuzzy_arbiter.pictures.sampling import points_along, weights_over
from fuzzy_arbiter.pictures.style import FAINT, legend_above, line_style, new_axes, tidy
from fuzzy_arbiter.shapes import Shape
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def terms(arbiter: Arbiter, variable: str, at: float | None = None, ax: Axes | None = None) -> Axes:
    """Draw the terms of a variable over its universe.

    Parameters
    ----------
    arbiter : Arbiter
        Arbiter with the variable.
    variable : str
        Name of an input or an output.
    at : float, optional
        Position at which the terms' degrees are marked.
    ax : Axes, optional
        Axes to draw into; default: those of a new figure.

    Returns
    -------
    Axes
        Axes of the picture.

    Raises
    ------
    DefinitionError
        If there is no such variable.
    InputError
        If the position is outside the universe.
    UnsupportedError
        If the variable has no terms.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> from fuzzy_arbiter.pictures import terms
    >>> terms(Arbiter(), "obstacle").get_ylabel()
    'degree'
    """
    selected = arbiter.system[variable]
    low, high = selected.universe
    if at is not None and not low <= at <= high:
        raise InputError(f"{variable}: position is {at!r}, expected a number in [{low:g}, {high:g}]")
    if not selected.terms:
        raise UnsupportedError(f"terms of {variable!r}: it has none to draw")
    ax = new_axes(6.0, 2.7) if ax is None else ax
    spans = value_spans(arbiter.system, selected)
    for i, term in enumerate(selected.terms):
        if term.name in spans:  # a stem, or the range of a value that depends on the inputs
            start, end = spans[term.name]
            low, high = min(low, start), max(high, end)
            x, y = [start, start, end, end], [0.0, 1.0, 1.0, 0.0]
        else:
            x, y = corners(term, (low, high))
            if at is not None:
                ax.plot(at, term.membership(at), "o", color=line_style(i)["color"], clip_on=False, zorder=4)
        ax.plot(x, y, label=term.name, clip_on=False, **line_style(i))
    if at is not None:
        ax.axvline(at, color=FAINT, linewidth=1.0, zorder=1)
    ax.set(xlim=(low, high), ylim=(0.0, 1.0), xlabel=variable, ylabel="strength" if spans else "degree")
    tidy(ax)
    legend_above(ax, selected.term_names)
    return ax


def value_spans(system: System, variable: Variable) -> dict[str, tuple[float, float]]:
    """Return the minimum and the maximum of each term that is a value, over samples of the inputs."""
    if not (isinstance(variable, Output) and variable.weighted):
        return {}
    corners = itertools.islice(itertools.product(*(v.universe for v in system.inputs)), 1024)
    low, high = np.array([v.universe for v in system.inputs]).T
    samples = np.array([*corners, *np.random.default_rng(0).uniform(low, high, (1024, len(low)))]).T
    inputs, outputs = variable_names(system.inputs), variable_names(system.outputs)
    known = dict(zip(inputs, samples, strict=True)) | dict.fromkeys(outputs, np.nan)
    spans = {}
    for term in variable.terms:
        if isinstance(term.shape, Value):
            values = np.ravel(term.shape.expression(inputs, outputs).of_many(known))
            values = values[np.isfinite(values)]
            spans[term.name] = (float(values.min()), float(values.max())) if values.size else variable.universe
    return spans


def corners(term: Term, universe: tuple[float, float]) -> tuple[list[float], list[float]]:
    """Return the corners of a term's line, both ends of a jump among them."""
    low, high = universe
    if not isinstance(term.shape, Shape):  # as many corners as make it look smooth
        positions = np.unique([*np.linspace(low, high, 401), *term.membership.breaks((low, high))])
        return positions.tolist(), term.membership.of_many(positions).tolist()
    inside = [(x, y) for x, y in term.straight.points if low < x < high]
    x, y = zip((low, term.straight(low)), *inside, (high, term.straight(high)), strict=True)
    return list(x), list(y)


def profile(
    arbiter: Arbiter,
    over: str,
    at: Mapping[str, float] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw all weights along one input.

    Parameters
    ----------
    arbiter : Arbiter
        Arbiter to draw.
    over : str
        Name of the input along the axis.
    at : mapping from str to float, optional
        Values of the others, which the picture shows; default: the middle of each universe.
    ax : Axes, optional
        Axes to draw into; default: those of a new figure.

    Returns
    -------
    Axes
        Axes of the picture; lines have gaps where an output is undefined.

    Raises
    ------
    DefinitionError
        If there is no such input.
    InputError
        If a value is not a number in its universe.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> from fuzzy_arbiter.pictures import profile
    >>> profile(Arbiter(), over="obstacle").get_xlabel()
    'obstacle'
    """
    system = arbiter.system
    (x,), weights, note = weights_over(arbiter, (over,), at, lambda variable: points_along(variable, 301))
    ax = new_axes(6.0, 3.2) if ax is None else ax
    for k, name in enumerate(system.result_names):
        ax.plot(x, weights[:, k], label=name, clip_on=False, **line_style(k))
    ax.set(xlim=system[over].universe, xlabel=over, ylabel="weight" if system.weights_of else "value")
    if system.normalization != "none":
        ax.set_ylim(0.0, 1.0)
    tidy(ax)
    legend_above(ax, system.result_names, note)
    return ax
