"""Units, and the domains for which the plant is meant."""

from __future__ import annotations

import math
from dataclasses import dataclass

# unit: exponents of kg, m, s, rad
UNITS: dict[str, dict[str, int]] = {
    "s": {"s": 1},
    "Hz": {"s": -1},
    "1/s": {"s": -1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "kg": {"kg": 1},
    "kg.m": {"kg": 1, "m": 1},
    "kg.m2": {"kg": 1, "m": 2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N/s": {"kg": 1, "m": 1, "s": -3},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N.m/s": {"kg": 1, "m": 2, "s": -3},
    "N.m/N": {"m": 1},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "us": {"s": 1},
    "rev/min": {"s": -1, "rad": 1},
    "N.s/m": {"kg": 1, "s": -1},
    "N.m.s/rad": {"kg": 1, "m": 2, "s": -1, "rad": -1},
    "N.s2/m2": {"kg": 1, "m": -1},
    "N.m.s2/rad2": {"kg": 1, "m": 2, "rad": -2},
    # units of control laws
    "m2": {"m": 2},
    "m2/s": {"m": 2, "s": -1},
    "N/m": {"kg": 1, "s": -2},
    "N/m2": {"kg": 1, "m": -1, "s": -2},
    "N/m3": {"kg": 1, "m": -2, "s": -2},
    "N/rad": {"kg": 1, "m": 1, "s": -2, "rad": -1},
    "1/(m2.s)": {"m": -2, "s": -1},
    "s2/kg": {"kg": -1, "s": 2},
}

# quantity of each unit, as Modelica's standard library names it where it has it
QUANTITIES = {
    "s": "Time", "Hz": "Frequency", "m": "Length", "m/s": "Velocity", "m/s2": "Acceleration", "rad": "Angle",
    "rad/s": "AngularVelocity", "rad/s2": "AngularAcceleration", "kg": "Mass", "kg.m": "MassMoment",
    "kg.m2": "MomentOfInertia", "N": "Force", "N/s": "ForceRate", "N.m": "Torque", "N.m/s": "TorqueRate",
    "V": "ElectricPotential", "N.s/m": "LinearDamping", "N.m.s/rad": "AngularDamping",
    "N.s2/m2": "QuadraticDamping", "N.m.s2/rad2": "QuadraticAngularDamping",
}  # fmt: skip

# number of coherent SI units in one of the unit, where it is not 1
_FACTORS = {"us": 1e-6, "rev/min": 2.0 * math.pi / 60.0}

_G = 9.80665  # m/s2, standard gravity

# further units in which a tool may show a unit: name, and their number in one of the unit
DISPLAY_UNITS: dict[str, dict[str, float]] = {
    "s": {"ms": 1e3, "min": 1 / 60, "h": 1 / 3600},
    "m": {"mm": 1e3, "cm": 1e2, "km": 1e-3},
    "m/s": {"cm/s": 1e2, "km/h": 3.6, "kn": 3600 / 1852},
    "m/s2": {"g": 1 / _G},
    "rad": {"deg": math.degrees(1.0)},
    "rad/s": {"deg/s": math.degrees(1.0)},
    "rad/s2": {"deg/s2": math.degrees(1.0)},
    "kg": {"t": 1e-3},
    "N": {"kN": 1e-3, "kgf": 1 / _G},
    "N.m": {"kN.m": 1e-3},
}
_SHOWN_IN = {"rad": "deg", "rad/s": "deg/s", "rad/s2": "deg/s2"}  # unless the user chooses otherwise


@dataclass(frozen=True)
class Quantity:
    """The unit of a number, and the domain for which the plant is meant; values beyond it are refused."""

    unit: str  # a key of UNITS, or "" for a pure number
    minimum: float
    maximum: float
    nominal: float = 1.0
    is_gain: bool = False  # True for a gain of a control law, which is shown in the law's own unit

    def __post_init__(self) -> None:
        if self.unit and self.unit not in UNITS:
            raise ValueError(f"unit is {self.unit!r}, expected one of plant_fmu.quantities.UNITS")

    @property
    def display_unit(self) -> str:
        """The unit in which tools show it, "" for its own."""
        return "" if self.is_gain else _SHOWN_IN.get(self.unit, "")

    @property
    def bounded(self) -> bool:
        """True if the domain has bounds."""
        return self.minimum < self.maximum < _ALL


_ALL = 1e300  # any number

TIME = Quantity("s", 0.0, 0.0)
LENGTH = Quantity("m", -1e6, 1e6)
QUATERNION = Quantity("", -2.0, 2.0)  # wider than a unit quaternion, for what integrators try
SPEED = Quantity("m/s", -1e4, 1e4)
ANGULAR_SPEED = Quantity("rad/s", -1e4, 1e4)
HALF_TURN = Quantity("rad", -3.1416, 3.1416)
QUARTER_TURN = Quantity("rad", -1.5708, 1.5708)
FORCE = Quantity("N", -1e9, 1e9, 10.0)  # far above any vehicle
MOMENT = Quantity("N.m", -1e9, 1e9, 10.0)
ALL_FORCES = Quantity("N", -1e12, 1e12, 10.0)
ALL_MOMENTS = Quantity("N.m", -1e12, 1e12, 10.0)
FLAG = Quantity("", 0.0, 1.0)
SEED = Quantity("", 0.0, 2.0**31 - 1.0)

MASS = Quantity("kg", 1e-3, 1e9)
LEVER = Quantity("m", -1e3, 1e3)
WEIGHT = Quantity("N", 0.0, 1e10)
CURRENT = Quantity("m/s", -100.0, 100.0)
SHEAR = Quantity("1/s", -10.0, 10.0)
CURRENT_DEVIATION = Quantity("m/s", 0.0, 100.0)
LONG_TIME = Quantity("s", 1e-3, 1e6)
RADIUS = Quantity("m", 0.0, 1e3)
FRACTION = Quantity("", 0.0, 1.0)
DEAD_BAND = Quantity("", 0.0, 0.99)
FRICTION = Quantity("", 0.0, 10.0)
GRAVITY = Quantity("m/s2", 0.0, 100.0)
TIME_CONSTANT = Quantity("s", 0.0, 1e3)
FORCE_RATE = Quantity("N/s", 0.0, 1e9)
SAMPLE_RATE = Quantity("Hz", 0.0, 1e4)
DELAY = Quantity("s", 0.0, 10.0)
SCALE = Quantity("", 0.0, 1e6)
SCALE_ERROR = Quantity("", -0.5, 0.5)
ACCELERATION = Quantity("m/s2", -100.0, 100.0)
SHARE = Quantity("", -1.0, 1.0)
PULSE = Quantity("us", 0.0, 1e4)
RPM = Quantity("rev/min", -1e4, 1e4)
VOLTAGE = Quantity("V", 10.0, 20.0)
SUBSTEP = Quantity("s", 1e-6, 1.0)
FORCE_LIMIT = Quantity("N", 0.0, 1e10)  # its maximum is above the norm of any force: no limit


def base_unit(unit: str) -> dict[str, str]:
    """Return the attributes of a unit's element ``BaseUnit``, which FMI and SSP share."""
    factor = {"factor": repr(_FACTORS[unit])} if unit in _FACTORS else {}
    return {base: str(power) for base, power in UNITS[unit].items()} | factor


def rate_unit(unit: str) -> str:
    """Return the unit of a time derivative."""
    return f"{unit}2" if unit.endswith("/s") else f"{unit or 1}/s"


def unbounded(unit: str, nominal: float = 1.0) -> Quantity:
    """Return a calculated quantity without bounds."""
    return Quantity(unit, -_ALL, _ALL, nominal)


def inertial(unit: str, diagonal: bool) -> Quantity:
    """Return an element of an inertia or added-mass matrix."""
    return Quantity(unit, 0.0 if diagonal else -1e12, 1e12)


def deviation(unit: str) -> Quantity:
    """Return a standard deviation."""
    return Quantity(unit, 0.0, 1e6)


def bias(unit: str) -> Quantity:
    """Return an offset of an instrument."""
    return Quantity(unit, -1e6, 1e6)
