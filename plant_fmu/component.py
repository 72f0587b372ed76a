"""The parts that an FMU is made of: a vehicle's plant, or another component."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from plant_fmu.variables import Variable

STOP_TIME = 10.0  # s, end of the default experiment
STEP = 0.01  # s, step of the default experiment


@dataclass(frozen=True, eq=False)
class Component:
    """One FMU to be built: its variables, its C code behind the common wrappers, and its further members."""

    # Its C files include a header `model.h` and the definition of `COMPONENT`, see `csrc/wrapper/component.h`. With
    # states among its variables it is for co-simulation and model exchange, without for co-simulation alone.

    name: str  # model identifier, and the beginning of its names in C
    description: str  # one line
    variables: tuple[Variable, ...]  # the first is the time; states are consecutive, and so are derivatives
    sources: Mapping[str, bytes]  # C files, by name
    contents: Callable[[int], Mapping[str, bytes]]  # function from FMI version to further members, by path
    header: str = "variables.h"  # name of the C header that is generated from the variables
    constants: Mapping[str, int] = field(default_factory=dict)  # constants of that header
    stop_time: float = STOP_TIME  # s, end of the default experiment
    step: float = STEP  # s, step of the default experiment

    @property
    def has_states(self) -> bool:
        """True if it has continuous states."""
        return any(v.role == "state" for v in self.variables)

    @property
    def has_clocks(self) -> bool:
        """True if it has clocks, and so event mode in co-simulation; for FMI 3.0 alone, as arrays are."""
        return any(v.type == "clock" for v in self.variables)

    @property
    def has_model_exchange(self) -> bool:
        """True if it shows the derivatives of its states."""
        return any(v.role == "derivative" and not v.hidden for v in self.variables)
