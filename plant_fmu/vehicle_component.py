"""The plant of a vehicle as a component."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from plant_fmu.compiling.sources import plant_sources
from plant_fmu.component import STEP, STOP_TIME, Component
from plant_fmu.contents import contents
from plant_fmu.errors import BuildError
from plant_fmu.toml_tables import hint
from plant_fmu.variables import Variable, described, show_small, variables, with_arrays
from plant_fmu.variables.former_names import present_name
from plant_fmu.vehicle import Vehicle


def make_vehicle_component(
    vehicle: Vehicle,
    start: Mapping[str, float] | None = None,
    stop_time: float = STOP_TIME,
    step: float = STEP,
    coupled: bool = False,
    arrays: bool = False,
    small: bool = False,
) -> Component:
    """Return the plant of a vehicle; stop_time, step [s]; for FMI 3.0 alone with arrays and sensors on clocks."""
    rows = tuple(variables(vehicle, coupled))
    if small:
        rows = show_small(rows)
    if arrays:
        rows = with_arrays(rows, has_clocks=not small)
    if start is not None:
        rows = _started(rows, start)
    own = [v for _, v in described(rows)] if start is not None or coupled or arrays or small else None
    return Component(
        name=vehicle.name.replace("-", "_"),  # as FMI's model identifier begins names in C
        description=f"Underwater vehicle, six degrees of freedom: {vehicle.title}",
        variables=rows,
        sources=plant_sources(),
        contents=lambda fmi: contents(vehicle, fmi, own),
        header="vehicle.h",
        constants={"N_THRUSTERS": vehicle.n_thrusters, "COUPLED": int(coupled)},
        stop_time=stop_time,
        step=step,
    )


def _started(rows: tuple[Variable, ...], start: Mapping[str, float]) -> tuple[Variable, ...]:
    """Return the variables with other start values."""
    settable = {v.name: v for v in rows if v.role in ("state", "input", "parameter")}
    start = {present_name(name, settable): value for name, value in start.items()}
    for name, value in start.items():
        if name not in settable:
            raise BuildError(f"start value of {name!r}: no such parameter, input or state; {hint(name, settable)}")
        q = settable[name].quantity
        if not (math.isfinite(value) and q.minimum <= value <= q.maximum):
            raise BuildError(f"start value of {name} is {value:g} {q.unit}, expected {q.minimum:g} to {q.maximum:g}")
    return tuple(replace(v, start=float(start[v.name])) if v.name in start else v for v in rows)
