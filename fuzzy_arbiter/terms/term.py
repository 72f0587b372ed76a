"""A word for a membership function, or for a value."""

from __future__ import annotations

from dataclasses import dataclass

from fuzzy_arbiter.checks import shown
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.shapes import Membership, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.values import Formula, Value


@dataclass(frozen=True, slots=True)
class Term:
    """A word for a part of a universe, and to what degree each place belongs to it; or, of an output, for a value.

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
