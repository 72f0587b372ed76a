"""Units and ranges: exponents match the name of the unit."""

import re

import numpy as np
import pytest
from scipy import constants

from plant_fmu import quantities
from plant_fmu.quantities import DISPLAY_UNITS, UNITS, Quantity

BASE = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "Hz": {"s": -1},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "us": {"s": 1},
    "rev": {"rad": 1},
    "min": {"s": 1},
}
ALL = {name: value for name, value in vars(quantities).items() if isinstance(value, Quantity)}


@pytest.mark.parametrize("unit", UNITS)
def test_exponents_are_those_of_the_name(unit):
    over, _, under = unit.partition("/")
    exponents = {}
    for part, sign in ((over, 1), (under.strip("()"), -1)):
        for symbol, power in re.findall(r"([A-Za-z]+)(\d*)", part):
            for base, exponent in BASE.get(symbol, {symbol: 1}).items():
                exponents[base] = exponents.get(base, 0) + sign * exponent * int(power or 1)
    assert UNITS[unit] == {base: exponent for base, exponent in exponents.items() if exponent}


OF_SCIPY = {
    "ms": constants.milli, "min": constants.minute, "h": constants.hour, "mm": constants.milli, "cm": constants.centi,
    "km": constants.kilo, "cm/s": constants.centi, "km/h": constants.kmh, "kn": constants.knot, "g": constants.g,
    "deg": constants.degree, "deg/s": constants.degree, "deg/s2": constants.degree, "t": constants.metric_ton,
    "kN": constants.kilo, "kgf": constants.kgf, "kN.m": constants.kilo,
}  # fmt: skip


@pytest.mark.parametrize(("unit", "display"), [(u, d) for u, factors in DISPLAY_UNITS.items() for d in factors])
def test_display_unit_factors_match_scipy(unit, display):
    """FMI: a value in the display unit is the factor times that in the unit."""
    assert unit in UNITS and display not in UNITS
    assert DISPLAY_UNITS[unit][display] == pytest.approx(1 / OF_SCIPY[display], rel=1e-15)


MADE = {
    "unbounded": quantities.unbounded("N"),
    "diagonal": quantities.inertial("kg.m2", True),
    "beside it": quantities.inertial("kg.m2", False),
    "deviation": quantities.deviation("m"),
    "bias": quantities.bias("m"),
}


@pytest.mark.parametrize("name", [*(name for name in ALL if name not in ("TIME", "VOLTAGE")), *MADE])
def test_quantity_ranges_are_nonempty_and_symmetric_or_nonnegative(name):
    quantity = {**ALL, **MADE}[name]
    assert quantity.minimum < quantity.maximum
    assert quantity.minimum in (0.0, -quantity.maximum) or 0.0 < quantity.minimum <= 1e-3


def test_seeds_are_nonnegative_32_bit_integers():
    assert (quantities.SEED.minimum, quantities.SEED.maximum) == (0, np.iinfo(np.int32).max)
    assert [q.minimum < 0.0 for q in MADE.values()] == [True, False, True, False, True]


def test_unknown_units_are_refused_by_name():
    with pytest.raises(ValueError, match=r"unit is 'V/N', expected one of plant_fmu\.quantities\.UNITS"):
        Quantity("V/N", 0.0, 1.0)
