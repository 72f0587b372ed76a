"""What the pictures share: new axes, colours and lines that can be told apart, and the places they are drawn for."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import Variable
from fuzzy_arbiter.engines.firing import Array
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.sampling import defined

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito's, which colour-blind people can tell apart, from dark to light
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
DASHES = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (7, 2, 1.5, 2)), (0, (7, 2, 1.5, 2, 1.5, 2)), (0, (1, 3)))
HATCHES = ("////", "....", "\\\\\\\\", "xx", "----", "||||")
INK, FAINT = "#333333", "#999999"
LEGEND = 68  # letters that a legend's line has room for

V = TypeVar("V", bound=Variable)


def new_axes(width: float, height: float, **keywords: Any) -> Axes:
    """Return the axes of a new figure, which belongs to nobody else.

    Parameters
    ----------
    width, height : float
        Of the figure [in].
    **keywords
        For the axes, such as ``projection``.

    Returns
    -------
    Axes
        Alone in the figure.
    """
    from matplotlib.figure import Figure

    ax: Axes = Figure(figsize=(width, height), layout="constrained").add_subplot(**keywords)
    return ax


def colour(i: int) -> str:
    """Return the colour of the i-th of several things.

    Parameters
    ----------
    i : int
        From 0.

    Returns
    -------
    str
        The same again after six.
    """
    return COLOURS[i % len(COLOURS)]


def hatch(i: int) -> str:
    """Return the hatches of the i-th of several areas.

    Parameters
    ----------
    i : int
        From 0.

    Returns
    -------
    str
        Others where the colour comes again.
    """
    return HATCHES[(i + i // len(COLOURS)) % len(HATCHES)]


def line_style(i: int) -> dict[str, Any]:
    """Return what makes the i-th line unlike the others, in colour and in grey, and visible below the next.

    Parameters
    ----------
    i : int
        From 0.

    Returns
    -------
    dict
        Keywords of ``Axes.plot``; other dashes where the colour comes again.
    """
    dashes = DASHES[(i + i // len(COLOURS)) % len(DASHES)]
    return {"color": colour(i), "linestyle": dashes, "linewidth": max(1.3, 2.7 - 0.35 * i)}


def tidy(ax: Axes) -> None:
    """Leave out the frame's upper and right sides, and draw a faint grid.

    Parameters
    ----------
    ax : Axes
        To be changed.
    """
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(color="#e4e4e4", linewidth=0.6)
    ax.set_axisbelow(True)


def legend_above(ax: Axes, names: Sequence[str], title: str = "") -> None:
    """Set the legend above the axes, where it covers nothing, in as many columns as the names leave room for.

    Parameters
    ----------
    ax : Axes
        With labelled lines.
    names : sequence of str
        Their labels.
    title : str
        Stands above the legend.
    """
    columns = max(1, min(len(names), LEGEND // (max(map(len, names)) + 8)))
    legend = ax.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        frameon=False,
        handlelength=3.2,
        borderaxespad=0.2,
        borderpad=0.1,
        fontsize=9,
        title=wrapped(title, LEGEND) or None,
        title_fontsize=10,
        alignment="left",
    )
    legend.set_in_layout(True)


def wrapped(text: str, width: int) -> str:
    """Return a text in lines of at most some letters, broken between words where that is possible.

    Parameters
    ----------
    text : str
        One line.
    width : int
        Letters.

    Returns
    -------
    str
        Lines.
    """
    return "\n".join(textwrap.wrap(text, width, break_on_hyphens=False))


def one_of(variables: Sequence[V], name: str, kind: str) -> int:
    """Return the place of the variable of a name.

    Parameters
    ----------
    variables : sequence of Variable
        Inputs or outputs.
    name : str
        Its name.
    kind : str
        What the variables are, for the error.

    Returns
    -------
    int
        Its index.

    Raises
    ------
    DefinitionError
        If there is none; those that there are, are listed.
    """
    names = [v.name for v in variables]
    if name not in names:
        raise DefinitionError(f"no {kind} {name!r}, expected one of {', '.join(names)}")
    return names.index(name)


def fixed_inputs(arbiter: Arbiter, over: Sequence[str], at: Mapping[str, float] | None) -> dict[str, float]:
    """Return the values of the inputs that a picture does not go over.

    Parameters
    ----------
    arbiter : Arbiter
        Whose inputs.
    over : sequence of str
        Inputs that the picture goes over.
    at : mapping from str to float, optional
        Values of others.

    Returns
    -------
    dict of float by str
        Values of all others, by default the middle of the universe, in the order of the inputs.

    Raises
    ------
    DefinitionError
        If an input does not exist, or is both fixed and gone over.
    InputError
        If a value is not a number in its universe.
    """
    inputs = arbiter.system.inputs
    at = dict(at or {})
    for name in (*over, *at):
        one_of(inputs, name, "input")
    for name in over:
        if name in at:
            raise DefinitionError(f"{name!r} is at {at[name]!r}, and the picture goes over it; expected one of the two")
    if len(set(over)) < len(over):
        raise DefinitionError(f"{over[0]!r} came twice, expected two inputs")
    middle = {v.name: (v.universe[0] + v.universe[1]) / 2.0 for v in inputs}
    values = dict(zip(middle, arbiter.samples.one(middle | at), strict=True))
    return {name: value for name, value in values.items() if name not in over}


def weights_at(arbiter: Arbiter, fixed: Mapping[str, float], over: Mapping[str, Array]) -> Array:
    """Return the weights at many places, NaN where an output is undefined.

    Parameters
    ----------
    arbiter : Arbiter
        What is drawn.
    fixed : mapping from str to float
        Inputs of one value.
    over : mapping from str to ndarray, shape (n,)
        All other inputs.

    Returns
    -------
    ndarray, shape (n, outputs)
        Weights.
    """
    system = arbiter.system
    n = len(next(iter(over.values())))
    samples = np.empty((n, len(system.inputs)))
    for i, variable in enumerate(system.inputs):
        samples[:, i] = over[variable.name] if variable.name in over else fixed[variable.name]
    known = defined(system, samples)
    weights = np.full((n, len(system.outputs)), np.nan)
    if known.any():
        weights[known] = arbiter.batch(samples[known])
    return weights


def said(values: Mapping[str, float]) -> str:
    """Return values as a text.

    Parameters
    ----------
    values : mapping from str to float
        By name.

    Returns
    -------
    str
        As ``a = 1, b = 0.5``.
    """
    return ", ".join(f"{name} = {value:.4g}" for name, value in values.items())


def knots_of(variable: Variable) -> list[float]:
    """Return where the terms of a variable break, and the ends of its universe.

    Parameters
    ----------
    variable : Variable
        Any.

    Returns
    -------
    list of float
        Increasing.
    """
    low, high = variable.universe
    return sorted({low, high, *(x for t in variable.terms for x, _ in t.shape.points if low < x < high)})
