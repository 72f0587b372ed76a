"""The plant's own elementary functions, against exact rational arithmetic."""

import ctypes
import itertools
import math
import re
from decimal import Decimal, getcontext

import numpy as np
import pytest

from plant_fmu import load_vehicle
from plant_fmu.compiling.compiler import compile_library, find_compiler
from plant_fmu.compiling.libraries import FMI_HEADERS
from plant_fmu.compiling.platforms import native_platform
from plant_fmu.compiling.sources import all_sources, c_sources
from plant_fmu.vehicle_component import make_vehicle_component

TURN = Decimal("6.28318530717958647692528676655900576839433879875021")
WITHIN = 2.0  # units in the last place, as elementary.h says
ANY = np.random.default_rng(5)


ARGUMENTS = {"log": "double x", "expm1": "double x", "cos_turns": "double x", "atan2": "double y, double x",
             "hypot": "double x, double y"}  # fmt: skip


@pytest.fixture(scope="module")
def functions(once):
    """Return a function that gives one of the functions by name."""

    def make(folder):
        component = make_vehicle_component(load_vehicle("odin"))
        for name, data in all_sources(component, 3, "").items():
            (folder / name).write_bytes(data)
        # by plain names, and for other libraries to see
        shown = ['#include "elementary.h"', "#pragma GCC visibility push(default)"]
        for name, arguments in ARGUMENTS.items():
            passed = arguments.replace("double ", "")
            shown.append(f"double {name}_({arguments}) {{ return elementary_{name}({passed}); }}")
        (folder / "shown.c").write_text("\n".join([*shown, ""]))
        files = [folder / "shown.c", folder / "elementary.c"]
        compile_library(find_compiler(), native_platform(), files, [folder, FMI_HEADERS], folder / "shown.so")

    library = ctypes.CDLL(str(once("elementary", make) / "shown.so"))

    def one(name):
        function = getattr(library, f"{name}_")
        function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double] * ARGUMENTS[name].count("double")
        return function

    return one


def sine(x):
    """Return the sine of a Decimal by its series."""
    term = total = x
    for n in range(2, 80, 2):
        term *= -x * x / (n * (n + 1))
        total += term
    return total


@pytest.mark.medium
@pytest.mark.parametrize(
    ("name", "exact", "points", "values"),
    [
        ("log", Decimal.ln, [*ANY.uniform(0.0, 1.0, 800), *(1.0 - ANY.uniform(0.0, 1e-9, 50)), 2.0**-53, 1.0 - 2.0**-53,
                             0.7071, 1e300], {1.0: 0.0}),
        ("expm1", lambda x: x.exp() - 1, [*-(10.0 ** ANY.uniform(-12.0, 1.77, 800)), -0.3466, -0.3465, -59.9],
         {0.0: 0.0, -1e9: -1.0, -math.inf: -1.0}),
        ("cos_turns", lambda x: sine(TURN * (Decimal("0.25") - x)),
         [*ANY.uniform(0.0, 1.0, 400), 0.25 + 1e-9, 0.75 - 1e-12, 0.124999, 0.125001],
         {0.0: 1.0, 0.25: 0.0, 0.5: -1.0, 0.75: 0.0}),
    ],
    ids=["log", "expm1", "cos_turns"],
)  # fmt: skip
def test_function_matches_exact_arithmetic(functions, name, exact, points, values):
    getcontext().prec = 60
    function = functions(name)
    for x in map(float, points):
        true = exact(Decimal(x))
        assert abs(float((Decimal(function(x)) - true) / Decimal(math.ulp(float(true))))) < WITHIN
    assert {x: function(x) for x in values} == values
    assert name != "expm1" or math.isnan(function(math.nan))


@pytest.mark.medium
@pytest.mark.parametrize(("name", "within", "n"), [("atan2", 3.0, 800), ("hypot", WITHIN, 200)])
def test_function_of_two_numbers_matches_the_c_library(functions, name, within, n):
    """The C library's arcus tangens is itself within one unit in the last place."""
    function, reference = functions(name), getattr(math, name)
    for point in [*ANY.normal(size=(n, 2)), *(ANY.normal(size=(n // 4, 2)) * [1e-9, 1.0])]:
        assert abs(function(*point) - reference(*point)) <= within * math.ulp(reference(*point))
    for point in itertools.product((0.0, -0.0, 1.0, -1.0), repeat=2) if name == "atan2" else ():
        got, want = function(*point), reference(*point)
        assert (got, math.copysign(1.0, got)) == (want, math.copysign(1.0, want))


def arctangent(x):
    """Return the arcus tangens of a Decimal by its series, after four halvings."""
    for _ in range(4):
        x = x / (1 + (1 + x * x).sqrt())
    return 16 * sum((-1) ** n * x ** (2 * n + 1) / (2 * n + 1) for n in range(40))


def test_table_of_arctangents_holds_each_eighth_and_what_it_lacks():
    getcontext().prec = 50
    text = c_sources(make_vehicle_component(load_vehicle("odin")), 3)["elementary.c"].decode()
    table = re.search(r"ATAN\[9\]\[2\] = \{(.*?)\};", text, re.DOTALL)
    rows = re.findall(r"\{(.+?), (.+?)\}", table[1])
    assert len(rows) == 9
    for k, (number, rest) in enumerate(rows):
        exact = arctangent(Decimal(k) / 8)
        assert (float(number), float(rest)) == (float(exact), float(exact - Decimal(float(exact))))
