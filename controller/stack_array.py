"""Small arrays of functions that are translated to C: their shapes, and sums in the order in which C adds."""

from __future__ import annotations

import contextvars
import functools
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, init=False)
class Shape:
    """The lengths of an array, as an annotation of its type: a number, a name where it varies, or None for any."""

    lengths: tuple[int | str | None, ...]

    def __init__(self, *lengths: int | str | None) -> None:
        object.__setattr__(self, "lengths", lengths)


Array = NDArray[np.float64]
Vector3 = Annotated[Array, Shape(3)]
Vector4 = Annotated[Array, Shape(4)]
Vector6 = Annotated[Array, Shape(6)]
Matrix3 = Annotated[Array, Shape(3, 3)]
Matrix6 = Annotated[Array, Shape(6, 6)]
Number = Annotated[Array, Shape(1)]  # the number of the only region
VectorM = Annotated[Array, Shape("m")]  # of m thrusters
VectorN = Annotated[Array, Shape("n")]  # of n regions
Rows3 = Annotated[Array, Shape("n", 3)]
Columns3 = Annotated[Array, Shape(3, "m")]
Columns6 = Annotated[Array, Shape(6, "m")]


class Ordered(np.ndarray):
    """An array whose products and sums are added one after the other, so that Python and C have the same bits."""

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Run a function of arrays; options as in NumPy."""
        # In order only over all axes and without options; else, and where NumPy has an error to raise, as NumPy does.
        options = {name: _plain(value) for name, value in options.items()}
        is_default = all(name in _DEFAULTS and value is _DEFAULTS[name] for name, value in options.items())
        applies = is_default and ("axis" in options) == (method == "reduce") and all(np.size(x) for x in inputs)
        own = _IN_ORDER.get((ufunc.__name__, method)) if applies else None
        run = own or functools.partial(getattr(ufunc, method), **options)
        return ordered(run(*map(_plain, inputs)))

    def __array_function__(self, *arguments: Any) -> Any:
        """Run another function of NumPy."""
        return ordered(super().__array_function__(*arguments))


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    return value.view(np.ndarray) if isinstance(value, Ordered) else value


def _product(one: Any, other: Any) -> Array:
    a, b = np.asarray(one), np.asarray(other)
    if not (1 <= a.ndim <= 2 and 1 <= b.ndim <= 2) or a.shape[-1] != b.shape[0]:
        return np.asarray(np.matmul(a, b))
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


_DEFAULTS = {"axis": None, "dtype": None, "keepdims": False, "where": True}
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


_in_order = contextvars.ContextVar("_in_order", default=False)


def interpret(function: Any, arguments: tuple[Any, ...]) -> None:
    """Run a translated function in Python with the bits of C, and as there without warnings of overflow or 1 / 0."""
    token = _in_order.set(True)
    try:
        with np.errstate(all="ignore"):
            function(*ordered(arguments))
    finally:
        _in_order.reset(token)


def zeros(*shape: int) -> Array:
    """Return an array of zeros, which in C lasts until the calling function returns."""
    # It must not be stored beyond the call.
    made = np.zeros(shape)
    return made.view(Ordered) if _in_order.get() else made


def array(*items: Any) -> Array:
    """Return an array of numbers, or of rows, which in C lasts as long as that of `zeros`."""
    made = np.array(items, dtype=float)
    return made.view(Ordered) if _in_order.get() else made
