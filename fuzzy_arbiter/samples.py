"""Samples: what comes as inputs, checked, in the order of the inputs, in their universes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from fuzzy_arbiter.definition import System, variable_names
from fuzzy_arbiter.engines.firing import Array
from fuzzy_arbiter.errors import InputError

Sample = Sequence[float] | Mapping[str, float]
_NUMBER = (Real, np.bool_)


class Samples:
    """Checks samples, and clips them if the system says so.

    Parameters
    ----------
    system : System
        Whose inputs they are.
    """

    def __init__(self, system: System) -> None:
        self._clips = system.outside == "clip"
        self._limits = tuple(v.universe for v in system.inputs)
        self._names = variable_names(system.inputs)

    def one(self, inputs: Sample) -> Sequence[float]:
        """Return the values of one sample.

        Parameters
        ----------
        inputs : sequence of float, or mapping from input's name to float
            One value for each input.

        Returns
        -------
        sequence of float
            In the order of the inputs, in their universes.

        Raises
        ------
        InputError
            If an input is missing, unknown, not a number, or outside its universe (unless that clips).
        """
        try:
            values = inputs if type(inputs) is list or type(inputs) is tuple else self._in_order(inputs)
            for x, (low, high) in zip(values, self._limits, strict=True):
                if type(x) is not float or not low <= x <= high:  # NaN too
                    return self._converted(values)
        except (TypeError, ValueError):
            raise self._fault(inputs) from None
        return values

    def many(self, inputs: ArrayLike) -> Array:
        """Return the values of many samples.

        Parameters
        ----------
        inputs : array_like, shape (n, inputs)
            One sample in each row.

        Returns
        -------
        ndarray, shape (n, inputs)
            In their universes.

        Raises
        ------
        InputError
            If the shape is another, or a value is not a number or outside its universe (unless that clips); the first
            such row is named.
        """
        try:
            received = np.asarray(inputs)
            if received.dtype.kind not in "biufO":  # NumPy would read numbers from texts, too
                raise TypeError(f"values of the type {received.dtype.name} came")
            values = received.astype(np.float64, copy=False)
        except (TypeError, ValueError) as error:
            raise InputError(f"inputs: {error}; expected rows of numbers for {', '.join(self._names)}") from None
        if values.ndim != 2 or values.shape[1] != len(self._names):
            raise InputError(f"inputs have the shape {values.shape}, expected (n, {len(self._names)})")
        low, high = np.array(self._limits).T
        if values.size and low.max() <= values.min() and values.max() <= high.min():  # for NaN neither holds
            return values
        good = ~np.isnan(values) if self._clips else (low <= values) & (values <= high)
        if not good.all():
            row, i = np.argwhere(~good)[0]
            expected = f"expected a number in [{low[i]:g}, {high[i]:g}]"
            raise InputError(f"row {row}: {self._names[i]} is {float(values[row, i])!r}, {expected}")
        return np.clip(values, low, high) if self._clips else values

    def _converted(self, values: Sequence[float]) -> list[float]:
        """Return values as floats, in their universes: a number of another type would bring its own rounding along."""
        if not all(isinstance(x, _NUMBER) for x in values):
            raise TypeError
        if not all(low <= x <= high for x, (low, high) in zip(values, self._limits, strict=True)):
            if not self._clips or any(x != x for x in values):
                raise self._fault(values)
            values = [min(max(x, low), high) for x, (low, high) in zip(values, self._limits, strict=True)]
        return list(map(float, values))

    def _in_order(self, inputs: Sample) -> list[float]:
        if isinstance(inputs, Mapping):
            for name in inputs:  # first, for a misspelt one is missing, too
                if name not in self._names:
                    raise InputError(f"{name}: unknown input, expected {', '.join(self._names)}")
            for name in self._names:
                if name not in inputs:
                    raise InputError(f"{name}: input is missing, expected {', '.join(self._names)}")
            return [inputs[name] for name in self._names]
        if isinstance(inputs, np.ndarray):
            return list(inputs.tolist())
        if isinstance(inputs, Sequence):
            return list(inputs)
        raise TypeError(inputs)

    def _fault(self, inputs: Sample) -> InputError:
        """Find out what is wrong with a sample that was refused."""
        try:
            values = self._in_order(inputs)
        except TypeError:
            return InputError(f"inputs are {inputs!r}, expected {len(self._names)} numbers")
        if len(values) != len(self._names):
            return InputError(f"inputs: {len(values)} came, expected {len(self._names)}: {', '.join(self._names)}")
        for name, x, (low, high) in zip(self._names, values, self._limits, strict=True):
            if not isinstance(x, _NUMBER) or x != x or (not self._clips and not low <= x <= high):
                return InputError(f"{name}: input is {x!r}, expected a number in [{low:g}, {high:g}]")
        return InputError(f"inputs are {inputs!r}, expected {len(self._names)} numbers")
