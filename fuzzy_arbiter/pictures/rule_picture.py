"""A picture of the rules at one sample: each rule's strength and clipped term, the joined outline, its value."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import Output, variable_names
from fuzzy_arbiter.engines.firing import Firing, Slot
from fuzzy_arbiter.engines.weighted import value_function
from fuzzy_arbiter.pictures.lines import corners
from fuzzy_arbiter.pictures.sampling import format_values, output_index, points_along
from fuzzy_arbiter.pictures.style import FAINT, INK, color, hatch, new_axes, wrapped
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.samples import Sample
from fuzzy_arbiter.shapes import Array, Membership
from fuzzy_arbiter.terms.norms import AGGREGATIONS, T_NORMS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAX_ROWS = 10
_LETTERS = 50  # maximum number of letters in a line of a rule
_HEIGHT = 0.72  # height of a term of degree 1, in rows
_TALL = 1.6  # factor of the height of the outline at the foot


def rules(arbiter: Arbiter, inputs: Sample, output: str | None = None, ax: Axes | None = None) -> Axes:
    """Draw the rules that fire for an output at a sample, and the value of their joined terms.

    Each row is a rule: its condition, the term that it concludes, bounded by the rule's strength (a value is a stem of
    that height), and that strength, in bold and with a dot where none is greater for the term. At the foot all rows
    are joined, with the output's value. Of many rules those that do not fire are left out, then the weakest.

    Parameters
    ----------
    arbiter : Arbiter
        Arbiter to draw.
    inputs : sequence of float, or mapping from input's name to float
        The sample, as for a call.
    output : str, optional
        Name of the output; default: the first.
    ax : Axes, optional
        Axes to draw into; default: those of a new figure, of the height that the rules need.

    Returns
    -------
    Axes
        Axes of the picture.

    Raises
    ------
    DefinitionError
        If there is no such output.
    InputError
        If an input is missing, unknown, not a number, or outside its universe.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> from fuzzy_arbiter.pictures import rules
    >>> rules(Arbiter(), {"obstacle": 0.75, "shape": 1.0, "depth": 0.0}).get_xlabel()
    'alpha_1'
    """
    system = arbiter.system
    k = 0 if output is None else output_index(system, output)
    variable, values, firing = system.outputs[k], arbiter.samples.one(inputs), Firing(system)
    strengths = firing.strengths(values)
    cuts = firing.cuts(strengths)[k]
    outlines = _Outlines(arbiter, k, values)
    rows = [
        _Row(f"R{i + 1}", rule, strength, variable.term_names.index(conclusion.term))
        for i, (rule, strength) in enumerate(zip(system.rules, strengths, strict=True))
        for conclusion in rule.conclusions
        if conclusion.variable == variable.name
    ]
    max_strengths = {row.term: max(other.strength for other in rows if other.term == row.term) for row in rows}
    hidden = 0
    if len(rows) > MAX_ROWS:
        strongest = sorted((row for row in rows if row.strength > 0.0), key=lambda row: -row.strength)[:MAX_ROWS]
        hidden = len(rows) - len(strongest)
        rows = [row for row in rows if row in strongest]
    labels = [row.label() for row in rows]
    lines = sum(label.count("\n") for label in labels)
    ax = new_axes(7.2, 1.3 + 0.58 * len(rows) + 0.1 * lines + 0.95) if ax is None else ax

    for baseline, row in enumerate(rows):  # rows are counted downwards
        outline = outlines.of_term(row.term, row.strength, (row.rule.operators or system).implication)
        _draw_row(ax, variable, baseline, row, outline, row.strength == max_strengths[row.term])
    foot = len(rows) + _TALL - 0.6
    tall = _TALL * _HEIGHT
    ax.plot(outlines.universe, [foot, foot], color=INK, linewidth=1.0)
    for x, joined in outlines.joined(firing.slots[k], cuts):
        ax.fill_between(x, foot, foot - tall * joined, facecolor="#d9d9d9", linewidth=0)
        ax.plot(x, foot - tall * joined, color=INK, linewidth=1.8)
    text = _draw_value(ax, arbiter, values, k, (foot, tall), any(cuts))

    joined_label = "joined" + (f"\n({hidden} rules not drawn)" if hidden else "")
    ax.set_yticks([*(line - 0.12 for line in range(len(rows))), foot - tall / 2.6], [*labels, joined_label])
    ax.tick_params(axis="y", length=0, pad=8, labelsize=9)
    ax.set(xlim=outlines.universe, ylim=(foot + 0.02, -1.0 + 0.15), xlabel=variable.name)
    ax.spines[["top", "right", "left"]].set_visible(False)
    heading = f"{format_values(dict(zip(variable_names(system.inputs), values, strict=True)))}  →  {text}"
    ax.set_title(wrapped(heading, 64), fontsize=10, loc="right", pad=8)
    return ax


class _Outlines:
    """Outlines of the terms of the k-th output, each bounded by a strength; of values, stems."""

    def __init__(self, arbiter: Arbiter, k: int, values: Sequence[float]) -> None:
        system = arbiter.system
        self.output = output = system.outputs[k]
        self.universe = output.universe
        self._x = points_along(output, 801)
        if output.weighted:
            names = variable_names(system.inputs), variable_names(system.outputs[:k])
            self._known = (*values, *arbiter.centroids(values)[:k]) if k else values
            self._values = [value_function(term.shape, *names) for term in output.terms]

    def of_term(self, term: int, strength: float, implication: str) -> tuple[Array, Array]:
        """Return positions and heights of a term that is bounded by a strength."""
        if not self.output.weighted:
            degrees = self.output.terms[term].membership.of_many(self._x)
            return self._x, T_NORMS[implication].array(strength, degrees)
        position = self._values[term](strength, self._known) if strength > 0.0 else self.universe[0]
        self.universe = min(self.universe[0], position), max(self.universe[1], position)
        return np.full(2, position), np.array([0.0, strength])

    def joined(self, slots: Sequence[Slot], cuts: Sequence[float]) -> list[tuple[Array, Array]]:
        """Return the joined outline, or the stems of all values that fire."""
        outlines = [self.of_term(s.term, cut, s.implication) for s, cut in zip(slots, cuts, strict=True) if cut > 0.0]
        if self.output.weighted or not outlines:
            return outlines
        return [(self._x, functools.reduce(AGGREGATIONS[self.output.aggregation].array, (y for _, y in outlines)))]


@dataclass(frozen=True, slots=True)
class _Row:
    """A rule that concludes on the output, its strength, and the index of the concluded term."""

    name: str
    rule: Rule
    strength: float
    term: int

    def label(self) -> str:
        """Return the condition in a few lines, without the middle of a long one."""
        weight = "" if self.rule.weight == 1.0 else f" with {self.rule.weight:g}"
        lines = wrapped(f"{self.name}: if {self.rule.condition}{weight}", _LETTERS).split("\n")
        return "\n".join(lines if len(lines) <= 4 else [*lines[:2], f"{lines[2]} …", lines[-1]])


def _draw_row(
    ax: Axes, variable: Output, baseline: int, row: _Row, outline: tuple[Array, Array], decides: bool
) -> None:
    """Draw the term of a rule, its part below the rule's strength, and that strength."""
    term, (x, degrees), fires = variable.terms[row.term], outline, row.strength > 0.0
    ax.plot(variable.universe, [baseline, baseline], color=FAINT, linewidth=0.7)
    if isinstance(term.shape, Membership):
        ends, whole = corners(term, variable.universe)
        ax.plot(ends, baseline - _HEIGHT * np.array(whole), color=FAINT, linewidth=1.0)
    if fires:
        line, ink = baseline - _HEIGHT * degrees, color(row.term)
        ax.fill_between(x, baseline, line, facecolor=ink, alpha=0.45, linewidth=0)
        ax.fill_between(x, baseline, line, facecolor="none", edgecolor=ink, hatch=hatch(row.term), linewidth=0)
        ax.plot(x, line, color=ink, linewidth=1.6)
    bold = fires and decides
    ax.annotate(
        f"{row.strength:.3f} {term.name}{' •' if bold else ''}", (1.0, baseline), xycoords=("axes fraction", "data"),
        xytext=(8, 4), textcoords="offset points", color=INK if fires else FAINT, fontsize=9.5,
        fontweight="bold" if bold else "normal", annotation_clip=False,
    )  # fmt: skip


def _draw_value(ax: Axes, arbiter: Arbiter, values: Sample, k: int, place: tuple[float, float], fires: bool) -> str:
    """Draw the raw value at the foot, and return the output's value in words."""
    output, (foot, tall) = arbiter.system.outputs[k], place
    if not fires and output.default is None:
        return f"{output.name}: no rule fires"
    center = arbiter.centroids(values)[k]
    ax.plot([center, center], [foot, foot - tall], color=INK, linewidth=1.4, linestyle=(0, (4, 2)))
    ax.plot(center, foot, "^", color=INK, markersize=8, clip_on=False, zorder=5)
    side = -1 if center > sum(output.universe) / 2.0 else 1  # on the wider side
    ax.annotate(
        f"{output.defuzzifier if fires else 'default'} {center:.4g}", (center, foot - tall), xytext=(6 * side, -3),
        textcoords="offset points", ha="right" if side < 0 else "left", va="top", fontsize=9.5, color=INK,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.85},
    )  # fmt: skip
    return f"{output.name} = {arbiter(values)[k]:.4g}"
