"""One variable of an FMU, and the names that its variables are made of."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from plant_fmu.quantities import Quantity

Role = Literal["time", "state", "input", "output", "derivative", "parameter"]
Type = Literal["real", "integer", "boolean", "clock"]

AXES = "xyz"
VELOCITIES = "uvwpqr"
FORCES = "XYZKMN"
SENSORS = (
    ("depth_sensor", "the pressure sensor"),
    ("dvl", "the DVL"),
    ("imu", "the IMU"),
    ("compass", "the compass"),
    ("usbl", "the USBL"),
)


@dataclass(frozen=True)
class Variable:
    """One scalar variable of the FMU, or an element of an array."""

    name: str  # structured name, such as ``thrust[1]``
    role: Role
    member: str  # its member of the C struct Model
    quantity: Quantity
    description: str
    start: float = 0.0
    depends: tuple[str, ...] = ()  # names, or beginnings followed by *, of the variables that it is calculated from
    type: Type = "real"
    local: bool = False  # a state that is no output
    hidden: bool = False  # True if the model description leaves it out
    clock: str = ""  # name of the clock at whose ticks it changes, in an FMU with clocks
    array: str = ""  # name of the array of which it is an element
    shape: tuple[int, ...] = ()  # of the first element of an array: the array's; of its further elements: (0,)
    starts: tuple[float, ...] = ()  # of an array: start values, row by row

    @property
    def nominal(self) -> float:
        """A typical magnitude: that of the start value for a parameter, else that of the quantity."""
        return (abs(self.start) if self.role == "parameter" else 0.0) or self.quantity.nominal

    @property
    def size(self) -> int:
        """The number of values behind its value reference: 1 of a scalar, 0 within an array."""
        return math.prod(self.shape)

    def text(self, value: float) -> str:
        """Format a value of this variable for XML; a real number reads back to the same bits."""
        if self.type == "boolean":
            return "true" if value else "false"
        return str(int(value)) if self.type == "integer" else repr(float(value))
