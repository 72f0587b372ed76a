"""Terms that cover a universe evenly, from their names alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from fuzzy_arbiter.checks import all_of, shown
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.shapes import Shape, triangle

_NAMES = {
    3: ("poor", "average", "good"),
    5: ("poor", "mediocre", "average", "decent", "good"),
    7: ("dismal", "poor", "mediocre", "average", "decent", "good", "excellent"),
}


@dataclass(frozen=True, slots=True)
class AutomaticTerms:
    """Names of terms whose shapes follow from the universe of their variable."""

    names: tuple[str, ...]

    def over(self, universe: tuple[float, float]) -> dict[str, Shape]:
        """Return the shapes over a universe."""
        low, high = map(Fraction, universe)
        step = (high - low) / (len(self.names) - 1)
        peaks = [float(low + i * step) for i in range(-1, len(self.names) + 1)]
        return {name: triangle(*peaks[i : i + 3]) for i, name in enumerate(self.names)}


def auto_terms(terms: int | Sequence[str]) -> AutomaticTerms:
    """Return triangles at equal distances, to be used as the terms of a variable.

    Parameters
    ----------
    terms : {3, 5, 7} or sequence of str
        Number of terms, named as in scikit-fuzzy, such as ``poor``, ``average``, ``good``; or two or more names.

    Returns
    -------
    AutomaticTerms
        Terms whose degrees sum to 1 everywhere.

    Raises
    ------
    DefinitionError
        If `terms` is another number, or has fewer than two names.

    Examples
    --------
    >>> from fuzzy_arbiter import Variable, auto_terms
    >>> service = Variable("service", (0, 10), auto_terms(3))
    >>> service.term_names, service["average"](4)
    (('poor', 'average', 'good'), 0.8)
    """
    if isinstance(terms, int) and not isinstance(terms, bool):
        if terms not in _NAMES:
            raise DefinitionError(f"auto_terms: got {shown(terms)}, expected 3, 5 or 7, or the terms' names")
        return AutomaticTerms(_NAMES[terms])
    names = all_of(str, terms, "auto_terms", "3, 5 or 7, or the terms' names")
    if len(names) < 2:
        raise DefinitionError(f"auto_terms: got {len(names)} names, expected two or more")
    return AutomaticTerms(names)
