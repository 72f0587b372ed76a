"""The plant's own elementary functions, against exact rational arithmetic."""

import ctypes
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


@pytest.fixture(scope="module")
def functions(once):
    """Return a function that gives one of the functions by name."""

    def make(folder):
        component = make_vehicle_component(load_vehicle("odin"))
        for name, data in all_sources(component, 3, "").items():
            (folder / name).write_bytes(data)
        # by its plain name, and for other libraries to see
        (folder / "shown.c").write_text(
            '#include "elementary.h"\n#pragma GCC visibility push(default)\n'
            "double log_(double x) { return elementary_log(x); }\n"
            "double expm1_(double x) { return elementary_expm1(x); }\n"
            "double cos_(double x) { return elementary_cos_turns(x); }\n"
            "double atan2_(double y, double x) { return elementary_atan2(y, x); }\n"
            "double hypot_(double x, double y) { return elementary_hypot(x, y); }\n"
        )
        files = [folder / "shown.c", folder / "elementary.c"]
        compile_library(find_compiler(), native_platform(), files, [folder, FMI_HEADERS], folder / "shown.so")

    library = ctypes.CDLL(str(once("elementary", make) / "shown.so"))

    def one(name, n=1):
        function = getattr(library, f"{name}_")
        function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double] * n
        return function

    return one


def off(got, exact):
    """Return by how many units in the last place a number is off."""
    return abs(float((Decimal(got) - exact) / Decimal(math.ulp(float(exact)))))


def sine(x):
    """Return the sine of a Decimal by its series."""
    term = total = x
    for n in range(2, 80, 2):
        term *= -x * x / (n * (n + 1))
        total += term
    return total


@pytest.mark.medium
def test_logarithm_matches_reference(functions):
    getcontext().prec = 50
    log = functions("log")
    near = 1.0 - ANY.uniform(0.0, 1e-9, 50)
    for x in map(float, [*ANY.uniform(0.0, 1.0, 800), *near, 2.0**-53, 1.0 - 2.0**-53, 0.7071, 1e300]):
        assert off(log(x), Decimal(x).ln()) < WITHIN
    assert log(1.0) == 0.0


@pytest.mark.medium
def test_expm1_matches_reference(functions):
    getcontext().prec = 60
    expm1 = functions("expm1")
    for x in map(float, [*-(10.0 ** ANY.uniform(-12.0, 1.77, 800)), -0.3466, -0.3465, -59.9]):
        assert off(expm1(x), Decimal(x).exp() - 1) < WITHIN
    assert [expm1(0.0), expm1(-1e9), expm1(-math.inf)] == [0.0, -1.0, -1.0]
    assert math.isnan(expm1(math.nan))


@pytest.mark.medium
def test_cosine_of_turn_fractions_matches_reference(functions):
    getcontext().prec = 50
    cos = functions("cos")
    for x in map(float, [*ANY.uniform(0.0, 1.0, 400), 0.25 + 1e-9, 0.75 - 1e-12, 0.124999, 0.125001]):
        exact = sine(TURN * (Decimal("0.25") - Decimal(x)))
        assert off(cos(x), exact) < WITHIN
    assert [cos(x) for x in (0.0, 0.25, 0.5, 0.75)] == [1.0, 0.0, -1.0, 0.0]


@pytest.mark.medium
def test_atan2_matches_reference(functions):
    """The C library's result is itself within one unit in the last place."""
    atan2 = functions("atan2", 2)
    for y, x in [*ANY.normal(size=(800, 2)), *(ANY.normal(size=(200, 2)) * [1e-9, 1.0])]:
        assert abs(atan2(y, x) - math.atan2(y, x)) <= 3.0 * math.ulp(math.atan2(y, x))
    for y in (0.0, -0.0, 1.0, -1.0):
        for x in (0.0, -0.0, 1.0, -1.0):
            got, want = atan2(y, x), math.atan2(y, x)
            assert (got, math.copysign(1.0, got)) == (want, math.copysign(1.0, want))


@pytest.mark.medium
def test_hypotenuse_matches_reference(functions):
    hypot = functions("hypot", 2)
    for x, y in [*ANY.normal(size=(200, 2)), *(ANY.normal(size=(50, 2)) * [1e-9, 1.0])]:
        assert abs(hypot(x, y) - math.hypot(x, y)) <= WITHIN * math.ulp(math.hypot(x, y))


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
