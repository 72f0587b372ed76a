"""One variable of an FMU, and the names that its variables are made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from plant_fmu.quantities import Quantity

Role = Literal["time", "state", "input", "output", "derivative", "parameter"]
Type = Literal["real", "integer", "boolean"]

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
    """One scalar variable of the FMU."""

    name: str  # structured name, such as ``thrust[1]``
    role: Role
    member: str  # its member of the C struct Model
    quantity: Quantity
    description: str
    start: float = 0.0
    depends: tuple[str, ...] = ()  # names, or beginnings followed by *, of the variables that it is calculated from
    type: Type = "real"
    local: bool = False  # a state that is no output

    @property
    def nominal(self) -> float:
        """A typical magnitude: that of the start value for a parameter, else that of the quantity."""
        return (abs(self.start) if self.role == "parameter" else 0.0) or self.quantity.nominal

    def text(self, value: float) -> str:
        """Format a value of this variable for XML; a real number reads back to the same bits."""
        if self.type == "boolean":
            return "true" if value else "false"
        return str(int(value)) if self.type == "integer" else repr(float(value))
