"""Fold range normalization into the outputs' universe, for tools that do not support it."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.engines.clipped_centroid import term_centroids
from fuzzy_arbiter.errors import DefinitionError, UnsupportedError
from fuzzy_arbiter.shapes import Shape
from fuzzy_arbiter.terms.term import Term


def fold_normalization(system: System) -> System:
    """Return the system whose raw centroids are the weights of a range-normalized one.

    Normalizing to the range maps the centroids of an output's least and greatest term, each alone, to 0 and 1. The same
    map of the output's universe, terms and default gives a system that needs no normalizing: low and high triangles on
    [0, 1] become triangles on [-1, 2]. The ends of the map are exact, the positions are rounded once.

    Parameters
    ----------
    system : System
        System with the normalization ``range`` or ``none``.

    Returns
    -------
    System
        System with the normalization ``none``; the same system if it has that.

    Raises
    ------
    UnsupportedError
        If the normalization is over all outputs, an output's terms have one centroid and so no range, or the mapped
        terms overflow floating point.

    Notes
    -----
    Where the engines clip a centroid to [0, 1], because it is beyond those of the least and the greatest term,
    the new system does not clip it.

    Examples
    --------
    >>> from fuzzy_arbiter.criteria import prioritized
    >>> from fuzzy_arbiter.formats import fold_normalization
    >>> fold_normalization(prioritized()).outputs[0].universe
    (-1.0, 2.0)
    """
    if system.normalization == "none":
        return system
    if system.normalization != "range":
        raise UnsupportedError(
            f"no universe can say the normalization {system.normalization!r}, which is over all outputs; "
            "expected 'range' or 'none'"
        )
    return replace(system, outputs=tuple(map(_mapped, system.outputs)), normalization="none")


def range_ends(output: Output) -> tuple[Fraction, Fraction]:
    """Return the centroids that range normalization maps to 0 and 1."""
    centroids = term_centroids(output, Fraction)
    return min(centroids), max(centroids)


def _mapped(output: Output) -> Output:
    if (output.defuzzifier, output.aggregation) != ("centroid", "max"):
        raise UnsupportedError(
            f"output {output.name!r} has the defuzzifier {output.defuzzifier} and the aggregation "
            f"{output.aggregation}, which no universe can fold; expected centroid and max"
        )
    low, high = range_ends(output)
    if low == high:
        raise UnsupportedError(
            f"output {output.name!r}: its terms have one centroid, {float(low):g}, which leaves no range to normalize"
        )

    def scale(x: float) -> float:
        return float((Fraction(x) - low) / (high - low))

    try:
        terms = tuple(Term(t.name, Shape(tuple((scale(x), y) for x, y in t.straight.points))) for t in output.terms)
        default = None if output.default is None else min(max(scale(output.default), 0.0), 1.0)
        low_end, high_end = map(scale, output.universe)
        return replace(output, universe=(low_end, high_end), terms=terms, default=default)
    except (OverflowError, DefinitionError):
        raise UnsupportedError(
            f"output {output.name!r}: its terms lie too far apart, or too close, to be mapped in floating point"
        ) from None
