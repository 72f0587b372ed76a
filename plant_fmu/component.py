"""What an FMU is made of: a vehicle's plant, or anything else that brings the same few things."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from plant_fmu.compiling.sources import plant_sources
from plant_fmu.contents import contents
from plant_fmu.errors import BuildError
from plant_fmu.toml_tables import hint
from plant_fmu.variables import Variable, variables
from plant_fmu.vehicle import Vehicle

STOP_TIME = 10.0  # s, of the default experiment
STEP = 0.01  # s


@dataclass(frozen=True, eq=False)
class Component:
    """One FMU to be built: its variables, its C code behind the common wrappers, and what it holds beside them.

    Its C files bring a header ``model.h`` and the definition of ``COMPONENT``, as ``csrc/wrapper/component.h`` says.
    With states among its variables it is for co-simulation and model exchange, without for co-simulation alone.
    """

    name: str  # model identifier, and the beginning of its names in C
    description: str  # one line
    variables: tuple[Variable, ...]  # the first is the time; states and derivatives each stand side by side
    sources: Mapping[str, bytes]  # its C files, by name
    contents: Callable[[int], Mapping[str, bytes]]  # by FMI version: what else is in the FMU, by path
    header: str = "variables.h"  # name of the C header that is generated from the variables
    constants: Mapping[str, int] = field(default_factory=dict)  # in that header
    stop_time: float = STOP_TIME  # s, of the default experiment
    step: float = STEP  # s

    @property
    def has_states(self) -> bool:
        """Whether it has continuous states."""
        return any(v.role == "state" for v in self.variables)


def of_vehicle(
    vehicle: Vehicle, start: Mapping[str, float] | None = None, stop_time: float = STOP_TIME, step: float = STEP
) -> Component:
    """Return the plant of a vehicle.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    start : mapping from str to float, optional
        Start values of parameters and states, by name, over those of the vehicle.
    stop_time, step : float, optional
        Of the default experiment [s].

    Returns
    -------
    Component
        What its FMU is made of.

    Raises
    ------
    BuildError
        If a start value is of no parameter, input or state, or beyond its range.
    VehicleError
        If a number of the vehicle is beyond the range of its parameter.
    """
    rows = tuple(variables(vehicle))
    if start is not None:
        rows = _started(rows, start)
    return Component(
        name=vehicle.name,
        description=f"Underwater vehicle, six degrees of freedom: {vehicle.title}",
        variables=rows,
        sources=plant_sources(),
        contents=lambda fmi: contents(vehicle, fmi, rows if start is not None else None),
        header="vehicle.h",
        constants={"N_THRUSTERS": vehicle.n_thrusters},
        stop_time=stop_time,
        step=step,
    )


def _started(rows: tuple[Variable, ...], start: Mapping[str, float]) -> tuple[Variable, ...]:
    """Return the variables with other start values."""
    settable = {v.name: v for v in rows if v.role in ("state", "input", "parameter")}
    for name, value in start.items():
        if name not in settable:
            raise BuildError(f"start value of {name!r}: no such parameter, input or state; {hint(name, settable)}")
        q = settable[name].quantity
        if not (math.isfinite(value) and q.minimum <= value <= q.maximum):
            raise BuildError(f"start value of {name} is {value:g} {q.unit}, expected {q.minimum:g} to {q.maximum:g}")
    return tuple(replace(v, start=float(start[v.name])) if v.name in start else v for v in rows)
