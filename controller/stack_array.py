"""Small arrays of functions that are translated to C: their shapes, and sums in the order in which C adds."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, init=False)
class Shape:
    """The lengths of an array, as an annotation of its type; None is any."""

    lengths: tuple[int | None, ...]

    def __init__(self, *lengths: int | None) -> None:
        object.__setattr__(self, "lengths", lengths)


Array = NDArray[np.float64]
Vector3 = Annotated[Array, Shape(3)]
Vector4 = Annotated[Array, Shape(4)]
Vector6 = Annotated[Array, Shape(6)]
Matrix3 = Annotated[Array, Shape(3, 3)]
Matrix6 = Annotated[Array, Shape(6, 6)]
Rows3 = Annotated[Array, Shape(None, 3)]
Columns3 = Annotated[Array, Shape(3, None)]
Columns6 = Annotated[Array, Shape(6, None)]
Number = Annotated[Array, Shape(1)]


class Ordered(np.ndarray):
    """An array whose products and sums are added one after the other, so that Python and C have the same bits."""

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Run a function of arrays; options as in NumPy."""
        plain = [x.view(np.ndarray) if isinstance(x, Ordered) else x for x in inputs]
        out = [x.view(np.ndarray) if isinstance(x, Ordered) else x for x in options.pop("out", ())]
        own = None if options or out else _IN_ORDER.get((ufunc.__name__, method))
        if method == "reduce" and options.get("axis", 0) is None:  # of all elements
            own = _IN_ORDER.get((ufunc.__name__, method))
        if own is None:
            options |= {"out": tuple(out)} if out else {}
            own = functools.partial(getattr(ufunc, method), **options)
        return ordered(own(*plain))

    def __array_function__(self, *arguments: Any) -> Any:
        """Run another function of NumPy."""
        return ordered(super().__array_function__(*arguments))


def _product(a: Array, b: Array) -> Array:
    if a.shape[-1] != b.shape[0]:
        raise ValueError(f"product of shapes {a.shape} and {b.shape}")
    total = np.zeros(a.shape[:-1] + b.shape[1:])
    for k in range(b.shape[0]):
        total = total + np.multiply.outer(a[..., k], b[k])
    return total


def _sum(a: Array) -> Any:
    total = 0 if a.dtype != float else 0.0
    for x in a.ravel():
        total = total + x
    return total


def _minimum(a: Array, b: Array) -> Array:
    return np.where((b < a) | np.isnan(b), b, a)[()]


def _maximum(a: Array, b: Array) -> Array:
    return np.where((b > a) | np.isnan(b), b, a)[()]


_IN_ORDER: dict[tuple[str, str], Any] = {
    ("matmul", "__call__"): _product,
    ("minimum", "__call__"): _minimum,
    ("maximum", "__call__"): _maximum,
    ("clip", "__call__"): lambda x, low, high: _minimum(_maximum(x, low), high),
    ("add", "reduce"): _sum,
    ("minimum", "reduce"): lambda a: functools.reduce(_minimum, a.ravel()),
    ("maximum", "reduce"): lambda a: functools.reduce(_maximum, a.ravel()),
}


def ordered(value: Any) -> Any:
    """Return a view of an array, or a tuple of such, that adds in order."""
    if isinstance(value, np.ndarray):
        return value.view(Ordered)
    if isinstance(value, tuple):
        items = map(ordered, value)
        return type(value)(*items) if hasattr(value, "_fields") else tuple(items)
    return value


def zeros(*shape: int) -> Array:
    """Return an array of zeros, which in C lasts until the calling function returns."""
    # It must not be stored beyond the call.
    return np.zeros(shape).view(Ordered)


def array(*items: Any) -> Array:
    """Return an array of numbers, or of rows, which in C lasts as long as that of `zeros`."""
    return np.array(items, dtype=float).view(Ordered)
