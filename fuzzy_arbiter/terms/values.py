"""Terms of outputs that are values, not sets: constant, linear in the inputs, or any expression of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fuzzy_arbiter.checks import all_of, finite, finite_numbers, shown
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.shapes import Array, Membership
from fuzzy_arbiter.terms.expressions import Expression
from fuzzy_arbiter.terms.parser import Node


class Value(ABC):
    """The conclusion of a Sugeno rule: a number for each sample."""

    __slots__ = ()

    @abstractmethod
    def expression(self, inputs: Sequence[str], outputs: Sequence[str] = ()) -> Expression:
        """Return the value as an expression of the inputs and of earlier outputs."""


@dataclass(frozen=True, slots=True)
class Constant(Value):
    """One number, independent of the inputs: a singleton.

    Raises
    ------
    DefinitionError
        If the number is not finite.

    Examples
    --------
    >>> from fuzzy_arbiter.terms import Constant
    >>> Constant(15).value
    15.0
    """

    value: float

    def __post_init__(self) -> None:
        value = finite(self.value)
        if value is None:
            raise DefinitionError(f"constant is {shown(self.value)}, expected a finite number")
        object.__setattr__(self, "value", value)

    def expression(self, inputs: Sequence[str], outputs: Sequence[str] = ()) -> Expression:
        """Return the number, with arguments as `Value.expression`."""
        return Expression("", self.value)


@dataclass(frozen=True, slots=True, init=False)
class Linear(Value):
    """A sum of the inputs, each times its coefficient, and of a constant.

    Attributes
    ----------
    coefficients : tuple of float
        Coefficient of each input, in the order of the system's inputs.
    constant : float
        Constant term of the sum.

    Raises
    ------
    DefinitionError
        If a coefficient or the constant is not finite.

    Examples
    --------
    >>> from fuzzy_arbiter.terms import Linear
    >>> Linear((2.0, 0.5), 1.0).expression(["speed", "depth"]).text
    '2 * speed + 0.5 * depth + 1'
    """

    coefficients: tuple[float, ...]
    constant: float = 0.0

    def __init__(self, coefficients: Sequence[float], constant: float = 0.0, *others: object) -> None:
        if others:
            what = f"got {2 + len(others)} arguments, expected coefficients and a constant, such as Linear((1, 2), 3)"
            raise DefinitionError(f"linear: {what}")
        all_numbers = (*all_of(object, coefficients, "linear", "a sequence of numbers"), constant)
        numbers = finite_numbers(all_numbers)
        if numbers is None:
            raise DefinitionError(f"linear: got {shown(all_numbers)}, expected finite numbers")
        object.__setattr__(self, "coefficients", numbers[:-1])
        object.__setattr__(self, "constant", numbers[-1])

    def expression(self, inputs: Sequence[str], outputs: Sequence[str] = ()) -> Expression:
        """Return the sum, with arguments as `Value.expression`; `DefinitionError` for another number of inputs."""
        if len(inputs) != len(self.coefficients):
            raise DefinitionError(
                f"linear of {len(self.coefficients)} coefficients, expected one for each input: {', '.join(inputs)}"
            )
        tree: Any = None
        for name, coefficient in zip(inputs, self.coefficients, strict=True):
            if coefficient:
                part = ("*", coefficient, name)
                tree = part if tree is None else ("+", tree, part)
        if tree is None:
            return Expression("", self.constant)
        return Expression("", ("+", tree, self.constant) if self.constant else tree)

    @classmethod
    def of(cls, tree: Node, inputs: Sequence[str]) -> Linear | None:
        """Return the linear value of the tree of an expression of `inputs`; None if the tree has another form."""
        coefficients = dict.fromkeys(inputs, 0.0)
        constant = 0.0
        node: Node | None = tree
        while node is not None:
            node, part = (node[1], node[2]) if isinstance(node, tuple) and node[0] == "+" else (None, node)
            if isinstance(part, float):
                constant = part
            elif isinstance(part, tuple) and part[0] == "*" and isinstance(part[1], float) and part[2] in coefficients:
                coefficients[part[2]] = part[1]
            else:
                return None
        linear_value = cls(tuple(coefficients.values()), constant)
        return linear_value if linear_value.expression(inputs).tree == tree else None


@dataclass(frozen=True, slots=True)
class Formula(Value, Membership):
    """An arithmetic expression: a term of an output on the inputs' names, or a membership function of ``x``.

    Attributes
    ----------
    text : str
        Text of a `fuzzy_arbiter.terms.expressions.Expression`.

    Raises
    ------
    DefinitionError
        If the text is no expression.

    Examples
    --------
    >>> from fuzzy_arbiter.terms import Formula
    >>> Formula("1 / (1 + x^2)")(1.0)
    0.5
    """

    text: str
    _parsed: Expression = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        parsed = Expression(self.text)
        object.__setattr__(self, "text", parsed.text)
        object.__setattr__(self, "_parsed", parsed)

    @property
    def names(self) -> frozenset[str]:
        """Names of the numbers in the expression."""
        return self._parsed.names

    def expression(self, inputs: Sequence[str], outputs: Sequence[str] = ()) -> Expression:
        """Return it, with arguments as `Value.expression`; raise `DefinitionError` for other names than these."""
        parsed, known = self._parsed, (*inputs, *outputs)
        unknown = sorted(parsed.names - set(known))
        if unknown:
            raise DefinitionError(
                f"expression {shown(self.text)} asks for {', '.join(unknown)}, expected inputs, or outputs before its "
                f"own: {', '.join(known)}"
            )
        return parsed

    def __call__(self, x: Any) -> Any:
        """Return the degree at a position, held within [0, 1]; NaN for NaN; degrees for an array."""
        if hasattr(x, "__len__"):
            return self.of_array(x)
        return x if x != x else min(max(self._parsed({"x": x}), 0.0), 1.0)

    def of_many(self, positions: Array, /) -> Array:
        """Return the degrees at many positions, each as a call gives it, to rounding."""
        values = self._parsed.of_many({"x": positions})
        return np.clip(np.broadcast_to(np.asarray(values, dtype=np.float64), np.shape(positions)), 0.0, 1.0)

    def breaks(self, universe: tuple[float, float]) -> tuple[float, ...]:
        """Return (): where an expression bends in a universe is not known."""
        return ()

    def within(self, universe: tuple[float, float]) -> Formula:
        """Return the formula itself; `DefinitionError` if it is NaN or above 1 somewhere in the `universe`."""
        positions = np.linspace(*universe, 1001)
        values = np.broadcast_to(self.expression(["x"]).of_many({"x": positions}), positions.shape)
        bad = ~(values <= 1.0 + 1e-9) | ~np.isfinite(values)
        if bad.any():
            i = int(np.argmax(bad))
            raise DefinitionError(
                f"expression {shown(self.text)} gives {float(values[i]):g} at x = {positions[i]:g}, expected at most 1"
            )
        return self
