"""Places at which pictures evaluate an arbiter, and the weights there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import System, Variable, variable_names
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.shapes import Array


def index_of(variables: Sequence[Variable], name: str, kind: str) -> int:
    """Return the index of a variable by name."""
    names = variable_names(variables)
    if name not in names:
        raise DefinitionError(f"no {kind} {name!r}, expected one of {', '.join(names)}")
    return names.index(name)


def output_index(system: System, name: str) -> int:
    """Return the index of an output by name."""
    for names in (system.result_names, variable_names(system.outputs)):
        if name in names:
            return names.index(name)
    raise DefinitionError(f"no output {name!r}, expected one of {', '.join(system.result_names)}")


def fixed_inputs(arbiter: Arbiter, over: Sequence[str], at: Mapping[str, float] | None) -> dict[str, float]:
    """Return the values of the inputs that are not axes of a picture."""
    inputs = arbiter.system.inputs
    at = dict(at or {})
    for name in (*over, *at):
        index_of(inputs, name, "input")
    for name in over:
        if name in at:
            raise DefinitionError(f"{name!r} is at {at[name]!r}, and the picture goes over it; expected one of the two")
    if len(set(over)) < len(over):
        raise DefinitionError(f"{over[0]!r} appears twice, expected two inputs")
    middle = {v.name: (v.universe[0] + v.universe[1]) / 2.0 for v in inputs}
    values = dict(zip(middle, arbiter.samples.one(middle | at), strict=True))
    return {name: value for name, value in values.items() if name not in over}


def weights_at(arbiter: Arbiter, fixed: Mapping[str, float], over: Mapping[str, Array]) -> Array:
    """Return the weights at many positions, NaN where an output is undefined; over (n,), returns (n, outputs)."""
    system = arbiter.system
    n = len(next(iter(over.values())))
    samples = np.empty((n, len(system.inputs)))
    for i, variable in enumerate(system.inputs):
        samples[:, i] = over[variable.name] if variable.name in over else fixed[variable.name]
    return arbiter.batch(samples)


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
