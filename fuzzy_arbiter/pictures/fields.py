"""Pictures over two inputs: one output as a surface, and the output with the maximum weight."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.pictures.sampling import output_index, weights_over
from fuzzy_arbiter.pictures.style import INK, color, hatch, new_axes, require_matplotlib, title_width, wrapped
from fuzzy_arbiter.shapes import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TIE = 1e-9  # weights closer than this are equal
_UNDEFINED = "#d9d9d9"
_SHADES = 5  # number of shades of the margin
_FRACTIONS = np.linspace(0.2, 0.85, _SHADES)  # of the output's color in each shade


def surface(
    arbiter: Arbiter,
    output: str,
    over: tuple[str, str],
    at: Mapping[str, float] | None = None,
    ax: Axes | None = None,
    points: int = 61,
) -> Axes:
    """Draw one output over two inputs: as level lines, or as a relief on axes of three dimensions.

    Parameters
    ----------
    arbiter, at, ax
        As for `fuzzy_arbiter.pictures.profile`; with axes of ``projection="3d"`` a relief is drawn.
    output : str
        Name of the output, in results or its own.
    over : (str, str)
        Names of the inputs along the two axes.
    points : int
        Number of points along each axis.

    Returns
    -------
    Axes
        Axes of the picture, blank where an output is undefined.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> from fuzzy_arbiter.pictures import surface
    >>> surface(Arbiter(), "obstacle", over=("obstacle", "shape")).get_xlabel()
    'obstacle'
    """
    k = output_index(arbiter.system, output)
    x, y, weights, title = _field(arbiter, over, at, points, output)
    z = np.ma.masked_invalid(weights[..., k])
    relief = ax is not None and ax.name == "3d"
    ax = new_axes(5.6, 4.4) if ax is None else ax
    if relief:
        _relief(ax, x, y, weights[..., k], (*over, output))
    elif z.count() == 0 or z.max() - z.min() < _TIE * max(1.0, abs(z).max()):
        ax.contourf(x, y, np.ma.getmaskarray(z).astype(float), levels=[-0.5, 0.5], colors=["#eeeeee"])
        value = "undefined" if z.count() == 0 else f"{output} = {z.max():.4g}"
        ax.text(0.5, 0.5, f"{value} everywhere", transform=ax.transAxes, ha="center")
    else:
        filled = ax.contourf(x, y, z, levels=10, cmap="cividis")
        ticks = np.array(filled.levels)[::2]
        levels = ticks[1:-1]
        pale = levels > (levels[0] + levels[-1]) / 2.0  # there the ground is light
        lines = ax.contour(x, y, z, levels=levels, colors=np.where(pale, "#222222", "#ffffff").tolist(), linewidths=0.9)
        bar = ax.figure.colorbar(filled, ax=ax, label=output, ticks=ticks)
        bar.add_lines(lines)  # labels on the lines themselves would lie on each other where the surface is steep
        bar.outline.set_visible(False)
    if not relief:
        ax.set(xlabel=over[0], ylabel=over[1])
    ax.set_title(wrapped(title, title_width(ax)), fontsize=10, loc="left")
    return ax


def decisions(
    arbiter: Arbiter,
    over: tuple[str, str],
    at: Mapping[str, float] | None = None,
    ax: Axes | None = None,
    points: int = 101,
) -> Axes:
    """Draw over two inputs which output is the greatest, the darker the farther it is above the next.

    Parameters
    ----------
    arbiter, over, at, ax, points
        As for `surface`; the arbiter has two outputs or more.

    Returns
    -------
    Axes
        Axes of the picture, white where the greatest is shared, gray where an output is undefined.

    Raises
    ------
    DefinitionError
        If there is no such input, or one output only.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> from fuzzy_arbiter.pictures import decisions
    >>> decisions(Arbiter(), over=("obstacle", "shape")).get_xlabel()
    'obstacle'
    """
    require_matplotlib()
    from matplotlib.colors import to_rgb
    from matplotlib.patches import Patch

    outputs = arbiter.system.outputs
    if len(outputs) < 2:
        raise DefinitionError(
            f"decisions: the only output is {outputs[0].name!r}, expected two or more to decide between"
        )
    x, y, weights, title = _field(arbiter, over, at, points, "what decides")
    ax = new_axes(5.8, 4.4) if ax is None else ax
    undefined = np.asarray(np.isnan(weights).any(axis=-1))
    ranked_weights = np.where(undefined[..., None], 0.0, weights)
    ranked = np.sort(ranked_weights, axis=-1)
    max_margin = max(float((ranked[..., -1] - ranked[..., -2]).max()), _TIE)
    levels = np.linspace(0.0, max_margin, _SHADES + 1)
    levels[0] = max_margin * 1e-4  # equal, to what can be drawn
    levels[-1] *= 1.0 + 1e-9
    if undefined.any():
        ax.contourf(x, y, undefined.astype(float), levels=[0.5, 1.5], colors=[_UNDEFINED])
    keys: list[Patch] = []
    for k, name in enumerate(arbiter.system.result_names):
        others = np.delete(ranked_weights, k, axis=-1).max(axis=-1)
        ahead = np.ma.masked_where(undefined, ranked_weights[..., k] - others)
        if ahead.count() == 0 or not ahead.max() > levels[0]:
            continue
        # mixed with white
        shades = [tuple(1.0 - fraction * (1.0 - part) for part in to_rgb(color(k))) for fraction in _FRACTIONS]
        ax.contourf(x, y, ahead, levels=levels, colors=shades)
        hatching = ax.contourf(x, y, ahead, levels=levels[[0, -1]], colors="none", hatches=[hatch(k)])
        hatching.set(edgecolor=(1.0, 1.0, 1.0, 0.55), linewidth=0.0)
        # two neighbors are ahead of each other by opposite amounts, so that their borders fall on one line
        if ahead.min() < levels[0]:
            ax.contour(x, y, ahead, levels=levels[:1], colors=INK, linewidths=1.1)
        keys.append(Patch(label=wrapped(name, 24), facecolor=shades[-1], edgecolor="white", hatch=hatch(k)))
    equal = ~undefined & (ranked[..., -1] - ranked[..., -2] <= levels[0])
    if equal.sum() > 2 * points:  # fewer are the line between two regions
        keys.append(Patch(label="shared", facecolor="white", edgecolor=INK))
    if undefined.any():
        keys.append(Patch(label="undefined", facecolor=_UNDEFINED))
    ax.legend(
        handles=keys, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False, fontsize=9, borderaxespad=0.0,
        title=f"greatest, darkest\nwhere {max_margin:.3g} ahead", title_fontsize=9, alignment="left", handleheight=1.6,
        labelspacing=0.8,
    )  # fmt: skip
    ax.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]), xlabel=over[0], ylabel=over[1])
    ax.set_title(wrapped(title, title_width(ax)), fontsize=10, loc="left")
    return ax


def _field(
    arbiter: Arbiter, over: tuple[str, str], at: Mapping[str, float] | None, points: int, title: str
) -> tuple[Array, Array, Array, str]:
    """Return positions along both axes, weights over them (rows along the second), and the picture's title."""
    if isinstance(over, str) or len(over) != 2:
        raise DefinitionError(f"over is {over!r}, expected the names of two inputs")
    (x, y), weights, note = weights_over(arbiter, over, at, lambda v: np.linspace(*v.universe, points))
    return x, y, weights, f"{title}  ({note})" if note else title


def _relief(ax: Any, x: Array, y: Array, z: Array, names: tuple[str, str, str]) -> None:
    across, along = np.meshgrid(x, y)
    every = max(1, len(x) // 30)
    ax.plot_surface(across, along, z, rstride=every, cstride=every, cmap="cividis", edgecolor="white", linewidth=0.2)
    for axis, name in zip((ax.xaxis, ax.yaxis, ax.zaxis), names, strict=True):
        label = wrapped(name, 20)
        axis.set_label_text(label)
        axis.labelpad = 4.0 + 10.0 * label.count("\n")
    ax.set_box_aspect(None, zoom=0.8)  # the layout ignores labels in three dimensions
    ax.locator_params(nbins=6)
