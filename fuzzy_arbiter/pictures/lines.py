"""Pictures over one axis: the terms of a variable, and the weights along one input."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import Normalization, Output
from fuzzy_arbiter.errors import DefinitionError, InputError, UnsupportedError
from fuzzy_arbiter.pictures.places import fixed_inputs, format_values, index_of, points_along, weights_at
from fuzzy_arbiter.pictures.style import (
    FAINT,
    INK,
    legend_above,
    legend_style,
    line_style,
    new_axes,
    require_matplotlib,
    room,
    tidy,
)
from fuzzy_arbiter.shapes import Shape
from fuzzy_arbiter.terms.term import Term

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MEANING: dict[Normalization, str] = {
    "none": "the centroids themselves",
    "range": "each from its least to its greatest",
    "sum": "then divided by their sum",
    "max": "then divided by the greatest",
}


def terms(arbiter: Arbiter, variable: str, at: float | None = None, ax: Axes | None = None) -> Axes:
    """Draw the terms of a variable over its universe.

    Parameters
    ----------
    arbiter : Arbiter
        Arbiter with the variable.
    variable : str
        Name of an input or an output.
    at : float, optional
        Place at which the terms' degrees are marked.
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
        If the variable has no terms, or its terms are values.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> from fuzzy_arbiter.pictures import terms
    >>> terms(Arbiter(), "obstacle").get_ylabel()
    'degree'
    """
    variables = (*arbiter.system.inputs, *arbiter.system.outputs)
    selected = variables[index_of(variables, variable, "variable")]
    low, high = selected.universe
    if at is not None and not low <= at <= high:
        raise InputError(f"{variable}: position is {at!r}, expected a number in [{low:g}, {high:g}]")
    if not selected.terms or (isinstance(selected, Output) and selected.weighted):
        raise UnsupportedError(f"terms of {variable!r}: it has values or none, which are not drawn; expected sets")
    ax = new_axes(6.0, 2.7) if ax is None else ax
    for i, term in enumerate(selected.terms):
        x, y = corners(term, (low, high))
        ax.plot(x, y, label=term.name, clip_on=False, **line_style(i))
        if at is not None:
            ax.plot(at, term.membership(at), "o", color=line_style(i)["color"], clip_on=False, zorder=4)
    if at is not None:
        ax.axvline(at, color=FAINT, linewidth=1.0, zorder=1)
    ax.set(xlim=(low, high), ylim=(0.0, 1.0), xlabel=variable, ylabel="degree")
    tidy(ax)
    legend_above(ax, selected.term_names)
    return ax


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
    fixed = fixed_inputs(arbiter, (over,), at)
    variable = system.inputs[index_of(system.inputs, over, "input")]
    low, high = variable.universe
    x = points_along(variable, 301)
    weights = weights_at(arbiter, fixed, {over: x})
    ax = new_axes(6.0, 3.2) if ax is None else ax
    for k, name in enumerate(system.result_names):
        ax.plot(x, weights[:, k], label=name, clip_on=False, **line_style(k))
    ax.set(xlim=(low, high), xlabel=over, ylabel="centroid" if system.normalization == "none" else "weight")
    if system.normalization != "none":
        ax.set_ylim(0.0, 1.0)
    tidy(ax)
    legend_above(ax, system.result_names, f"at {format_values(fixed)}" if fixed else "")
    return ax


def normalizations(
    arbiter: Arbiter,
    over: str,
    at: Mapping[str, float] | None = None,
    axes: Mapping[Normalization, Axes] | None = None,
) -> dict[Normalization, Axes]:
    """Draw all weights along one input, once under each normalization; the arbiter's own does not matter.

    Parameters
    ----------
    arbiter, over, at
        As for `profile`.
    axes : mapping from str to Axes, optional
        Axes of each normalization to draw; default: four of a new figure.

    Returns
    -------
    dict of Axes by str
        Axes of the picture, by normalization.

    Raises
    ------
    DefinitionError, InputError
        As for `profile`, and if there is no such normalization.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> from fuzzy_arbiter.pictures import normalizations
    >>> sorted(normalizations(Arbiter(), over="obstacle"))
    ['max', 'none', 'range', 'sum']
    """
    fixed = fixed_inputs(arbiter, (over,), at)
    new = axes is None
    if axes is None:
        require_matplotlib()
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.2, 5.4), layout="constrained")
        axes = dict(zip(_MEANING, figure.subplots(2, 2, sharex=True).flat, strict=True))
    for name, ax in axes.items():
        if name not in _MEANING:
            raise DefinitionError(f"no normalization {name!r}, expected one of {', '.join(_MEANING)}")
        system = replace(arbiter.system, normalization=name)
        profile(Arbiter(system=system, engine=arbiter.engine), over, fixed, ax)
        legend = ax.get_legend()
        assert legend is not None
        legend.remove()
        ax.set_title(f"{name}: {_MEANING[name]}", fontsize=10, loc="left", color=INK)
        if name == "none" and all(v.universe == (0.0, 1.0) for v in system.outputs):
            ax.set_ylim(0.0, 1.0)  # as the others
        if new:
            ax.label_outer()
    first = next(iter(axes.values()))
    handles, labels = first.get_legend_handles_labels()
    where = f"at {format_values(fixed)}" if fixed else ""
    if new:
        style = legend_style(labels, where, 2 * room(first))
        first.figure.legend(handles, labels, loc="outside upper left", frameon=False, **style)
    else:  # outside is what only some layouts know
        first.legend(loc="best", framealpha=0.8, **legend_style(labels, where, room(first)))
    return dict(axes)
