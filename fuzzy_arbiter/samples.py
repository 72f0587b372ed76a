"""Validate samples, and return them in the order of the inputs, within their universes."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence, Sized
from numbers import Real
from operator import itemgetter
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fuzzy_arbiter.checks import shown
from fuzzy_arbiter.definition import System, variable_names
from fuzzy_arbiter.errors import InputError
from fuzzy_arbiter.shapes import Array

_NUMBER: Any = (Real, np.bool_)
NAN_POLICIES = ("raise", "propagate")
EDGE = 1e-9  # distance from a universe, as a fraction of its width, within which an input counts as its end


class Frame(Protocol):
    """A table with columns by name, as pandas and polars have it."""

    @property
    def columns(self) -> Any:
        """Names of the columns."""
        ...

    def __getitem__(self, name: Any, /) -> Any: ...


Sample = Sequence[float] | Mapping[str, float] | NDArray[Any]
Columns = Mapping[str, ArrayLike] | Frame | NDArray[np.void]


class Samples:
    """Validate samples, and clip them if the system does."""

    def __init__(self, system: System) -> None:
        self._clips = system.outside == "clip"
        self._limits = tuple(v.universe for v in system.inputs)
        self._tolerance = tuple(EDGE * (high - low) for low, high in self._limits)
        self._names = variable_names(system.inputs)
        self._by_name = itemgetter(*self._names)

    def plain(self, inputs: Any) -> Sequence[float] | None:
        """Return the values of a dict or a one-dimensional array without validation."""
        kind = type(inputs)
        if kind is dict and len(inputs) == len(self._names):
            try:
                values = self._by_name(inputs)
            except KeyError:
                return None
            return values if len(self._names) > 1 else (values,)
        return inputs.tolist() if kind is np.ndarray and inputs.ndim == 1 else None

    def one(self, inputs: Sample) -> Sequence[float]:
        """Return the values of one sample, as floats within their universes."""
        values = inputs if type(inputs) is list or type(inputs) is tuple else self._in_order(inputs)
        if len(values) != len(self._names):
            raise InputError(f"inputs: got {len(values)}, expected {len(self._names)}: {', '.join(self._names)}")
        for x, (low, high) in zip(values, self._limits, strict=True):
            if type(x) is not float or not low <= x <= high:  # NaN too
                return self._converted(values, isinstance(inputs, np.ma.MaskedArray))
        return values

    def many(self, inputs: ArrayLike) -> Array:
        """Return the values of many samples; inputs (n, inputs), returns (n, inputs)."""
        values, missing = self.rows(inputs)
        if missing.any():
            raise InputError(f"row {int(np.argmax(missing))}: a value is masked, expected none")
        return values

    def rows(self, inputs: ArrayLike, nan_policy: str = "raise") -> tuple[Array, NDArray[np.bool_]]:
        """Return the values of many samples, and True for those that are masked or, where asked for, NaN."""
        if nan_policy not in NAN_POLICIES:
            raise InputError(f"nan_policy is {shown(nan_policy)}, expected {' or '.join(NAN_POLICIES)}")
        try:
            received = np.asarray(inputs)
            if received.dtype.kind not in "biufO":  # NumPy would read numbers from texts, too
                raise TypeError(f"got values of the type {received.dtype.name}")
            if received.dtype.kind == "O" and any(isinstance(x, str | bytes) for x in received.flat):
                raise TypeError("got a text among the values")
            if isinstance(inputs, np.ma.MaskedArray):
                received = np.where(masked := np.ma.getmaskarray(inputs), 0.0, received)
            else:
                masked = np.zeros(received.shape, dtype=bool)
            values = received.astype(np.float64, copy=False)
        except (TypeError, ValueError, OverflowError) as error:
            raise InputError(f"inputs: {error}; expected rows of numbers for {', '.join(self._names)}") from None
        if values.ndim != 2 or values.shape[1] != len(self._names):
            raise InputError(f"inputs have the shape {values.shape}, expected (n, {len(self._names)})")
        low, high = np.array(self._limits).T
        missing: NDArray[np.bool_] = np.asarray(masked.any(axis=1))
        if values.size and low.max() <= values.min() and values.max() <= high.min():  # for NaN neither holds
            return values, missing
        if nan_policy == "propagate":
            missing |= np.isnan(values).any(axis=1)
        values = np.where(missing[:, None], low, values)
        edge = np.array(self._tolerance)
        valid = ~np.isnan(values) if self._clips else (low - edge <= values) & (values <= high + edge)
        if not valid.all():
            row, i = np.argwhere(~valid)[0]
            expected = f"expected a number in [{low[i]:g}, {high[i]:g}]"
            if np.isnan(values[row, i]):
                expected += ", or nan_policy='propagate'"
            raise InputError(f"row {row}: {self._names[i]} is {float(values[row, i])!r}, {expected}")
        return np.clip(values, low, high), missing

    def columns(self, inputs: Columns) -> Array:
        """Return columns by name as rows, in a masked array if one of them is masked; returns (n, inputs)."""
        if isinstance(inputs, Mapping):
            self._require_names(inputs)
        else:
            names: Any = inputs.dtype.names if isinstance(inputs, np.ndarray) else inputs.columns
            self._require_columns(list(map(str, names)))
        received = [inputs[name] for name in self._names]
        columns = [x if isinstance(x, np.ma.MaskedArray) else np.asarray(x) for x in received]
        lengths = {len(x) for x in columns if x.ndim == 1}
        if any(x.ndim > 1 for x in columns) or len(lengths) != 1:
            shapes = ", ".join(f"{name} {x.shape}" for name, x in zip(self._names, columns, strict=True))
            raise InputError(f"columns have the shapes {shapes}, expected one length, or a single value for all rows")
        (n,) = lengths
        values = np.stack([np.broadcast_to(np.ma.getdata(x), n) for x in columns], axis=1)
        if not any(isinstance(x, np.ma.MaskedArray) for x in columns):
            return values
        masks = np.stack([np.broadcast_to(np.ma.getmaskarray(x), n) for x in columns], axis=1)
        return np.ma.MaskedArray(values, masks)

    def _converted(self, values: Sequence[Any], masked: bool) -> list[float]:
        """Return values as floats within their universes, so that other number types add no rounding of their own."""
        result = []
        for name, x, (low, high), edge in zip(self._names, values, self._limits, self._tolerance, strict=True):
            if not isinstance(x, _NUMBER) or x != x or (not self._clips and not low - edge <= x <= high + edge):
                received = "masked" if masked and x is None else shown(x)
                hint = "; for columns there is batch" if isinstance(x, Sized) and not isinstance(x, str) else ""
                raise InputError(f"{name}: input is {received}, expected a number in [{low:g}, {high:g}]{hint}")
            result.append(float(min(max(x, low), high)))
        return result

    def _in_order(self, inputs: Any) -> Sequence[Any]:
        if hasattr(inputs, "keys"):
            known = set(inputs.keys())  # of a row of a data frame other columns are passed over
            self._require_names(inputs if isinstance(inputs, Mapping) else [n for n in self._names if n in known])
            return [inputs[name] for name in self._names]
        if isinstance(inputs, Sequence) or (isinstance(inputs, np.ndarray) and inputs.ndim):
            return inputs.tolist() if isinstance(inputs, np.ndarray) else list(inputs)
        raise InputError(f"inputs are {inputs!r}, expected {len(self._names)} numbers")

    def _require_names(self, inputs: Collection[str]) -> None:
        for name in inputs:  # first, for a misspelt one is missing, too
            if name not in self._names:
                raise InputError(f"{name}: unknown input, expected {', '.join(self._names)}")
        for name in self._names:
            if name not in inputs:
                raise InputError(f"{name}: input is missing, expected {', '.join(self._names)}")

    def _require_columns(self, columns: Sequence[str]) -> None:
        for name in self._names:
            if columns.count(name) != 1:
                fault = "stands twice" if name in columns else "is missing"
                raise InputError(f"{name}: column {fault} in {', '.join(columns)}; expected {', '.join(self._names)}")
