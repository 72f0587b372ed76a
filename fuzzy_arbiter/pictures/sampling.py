"""The weights of an arbiter along one or two inputs, and positions that make smooth lines."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import System, Variable, variable_names
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.shapes import Array


def output_index(system: System, name: str) -> int:
    """Return the index of an output by name."""
    for names in (system.result_names, variable_names(system.outputs)):
        if name in names:
            return names.index(name)
    raise DefinitionError(f"no output {name!r}, expected one of {', '.join(system.result_names)}")


def weights_over(
    arbiter: Arbiter, over: Sequence[str], at: Mapping[str, float] | None, positions: Callable[[Variable], Array]
) -> tuple[list[Array], Array, str]:
    """Return positions along inputs, weights over their grid and of each output, and the other inputs in words."""
    # the first input runs along the columns; other inputs are at a value, or at the middle of their universe
    inputs, at = {v.name: v for v in arbiter.system.inputs}, dict(at or {})
    for name in (*over, *at):
        if name not in inputs:
            raise DefinitionError(f"no input {name!r}, expected one of {', '.join(inputs)}")
        if name in over and name in at:
            raise DefinitionError(f"{name!r} is at {at[name]!r}, and the picture goes over it; expected one of the two")
    if len(set(over)) < len(over):
        raise DefinitionError(f"{over[0]!r} appears twice, expected two inputs")
    middles = {name: (v.universe[0] + v.universe[1]) / 2.0 for name, v in inputs.items()}
    sample = dict(zip(inputs, arbiter.samples.one(middles | at), strict=True))
    axes = [positions(inputs[name]) for name in over]
    grid = dict(zip(over, np.meshgrid(*axes), strict=True))
    columns = np.broadcast_arrays(*(sample | grid).values(), grid[over[0]])[:-1]
    weights = arbiter.batch(np.stack([column.ravel() for column in columns], axis=1))
    fixed = {name: value for name, value in sample.items() if name not in over}
    return axes, weights.reshape(*columns[0].shape, -1), f"at {format_values(fixed)}" if fixed else ""


def format_values(values: Mapping[str, float]) -> str:
    """Format values as text."""
    return ", ".join(f"{name} = {value:.4g}" for name, value in values.items())


def points_along(variable: Variable, count: int) -> Array:
    """Return positions close enough for a line, with both sides of every break of the variable's terms."""
    low, high = variable.universe
    knots = np.array(variable.knots)
    beside = (high - low) * 1e-9
    x: Array = np.unique(np.concatenate([np.linspace(low, high, count), knots, knots - beside, knots + beside]))
    return x[(low <= x) & (x <= high)]
