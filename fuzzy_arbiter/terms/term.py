"""A word for a membership function, or for a value; and words whose functions follow from the universe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from fuzzy_arbiter.checks import all_of, shown
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.shapes import Membership, Shape, triangle
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.values import Formula, Value

_NAMES = {
    3: ("poor", "average", "good"),
    5: ("poor", "mediocre", "average", "decent", "good"),
    7: ("dismal", "poor", "mediocre", "average", "decent", "good", "excellent"),
}


@dataclass(frozen=True, slots=True)
class Term:
    """A word for a part of a universe, and to what degree each position belongs to it; or, of an output, for a value.

    Attributes
    ----------
    name : str
        Name of the term.
    shape : Membership or Value
        A `Shape` of points, a curve such as ``curve("gaussian", 5, 2)``, or, of an output whose terms are values, a
        `Constant`, a `Linear` or a `Formula`.

    Raises
    ------
    DefinitionError
        If the shape is neither a membership function nor a value.

    Examples
    --------
    >>> from fuzzy_arbiter import Term, triangle
    >>> Term("medium", triangle(0.0, 0.5, 1.0)).shape(0.25)
    0.5
    """

    name: str
    shape: Membership | Value

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Membership | Value):
            raise DefinitionError(
                f"term {shown(self.name)}: shape is {shown(self.shape)}, expected such as triangle(0, 1, 2)"
            )

    @property
    def membership(self) -> Membership:
        """Its membership function; a value has none and raises `DefinitionError`."""
        value = isinstance(self.shape, Formula) and self.shape.names - {"x"}
        if value or not isinstance(self.shape, Membership):
            raise DefinitionError(f"term {shown(self.name)} is a value, expected a membership function")
        return self.shape

    @property
    def straight(self) -> Shape:
        """Its shape, if that is piecewise linear; any other raises `DefinitionError`."""
        if not isinstance(self.shape, Shape):
            raise DefinitionError(f"term {shown(self.name)} is {self.kind}, expected a piecewise-linear one")
        return self.shape

    @property
    def kind(self) -> str:
        """Kind of the shape, in words."""
        if isinstance(self.shape, Curve):
            return f"a curve of the kind {self.shape.kind}"
        return "piecewise linear" if isinstance(self.shape, Shape) else f"a {type(self.shape).__name__.lower()}"


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
