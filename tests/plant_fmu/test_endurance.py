"""Many instances in sequence and in parallel."""

import ctypes
import resource
from pathlib import Path

import pytest

from plant_fmu import Plant, load_vehicle
from plant_fmu.build import cached_fmu

needs_proc = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads memory from /proc")


def resident():
    """Resident memory now [bytes]."""
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * resource.getpagesize()


@pytest.fixture
def library(make_slave):
    """The FMI 3.0 library through ctypes alone, and its token."""
    slave = make_slave()
    return ctypes.CDLL(slave.fmu.dll._name), slave.description.guid.encode()  # without FMPy's conversions


def make(library, token, prefix=""):
    """Make one instance."""
    instantiate, nothing = library[f"{prefix}fmi3InstantiateCoSimulation"], ctypes.c_void_p()
    instantiate.restype = ctypes.c_void_p
    made = instantiate(b"x", token, None, *[ctypes.c_bool()] * 4, None, ctypes.c_size_t(0), *[nothing] * 3)
    assert made
    return ctypes.c_void_p(made)


def live(library, token):
    """Make, step, save and free one instance."""
    instance = make(library, token)
    assert (
        library.fmi3EnterInitializationMode(
            instance, False, ctypes.c_double(), ctypes.c_double(), False, ctypes.c_double()
        )
        == 0
    )
    assert library.fmi3ExitInitializationMode(instance) == 0
    flags = [ctypes.byref(ctypes.c_bool()) for _ in range(3)]
    for k in range(10):
        last = ctypes.byref(ctypes.c_double())
        assert library.fmi3DoStep(instance, ctypes.c_double(k * 0.01), ctypes.c_double(0.01), True, *flags, last) == 0
    state = ctypes.c_void_p()
    assert library.fmi3GetFMUState(instance, ctypes.byref(state)) == 0
    assert library.fmi3FreeFMUState(instance, ctypes.byref(state)) == 0
    library.fmi3FreeInstance(instance)


@needs_proc
def test_instances_leak_no_memory(library):
    loaded, token = library
    for _ in range(1000):
        live(loaded, token)
    before = resident()
    for _ in range(1000):
        live(loaded, token)
    assert resident() - before < 200_000


@needs_proc
@pytest.mark.slow
def test_repeated_loading_leaks_little_memory():
    """The whole way: extract, load, step, free, unload."""
    path = cached_fmu(load_vehicle("odin"), 3)

    def once():
        with Plant(path) as plant:
            plant.initialize()
            plant.step(0.01)

    def grown(times):
        before = resident()
        for _ in range(times):
            once()
        return resident() - before

    grown(20)
    # what is left behind is so each time; what earlier tests have left in disorder is not
    assert any(grown(50) < 50 * 20_000 for _ in range(4))


def test_simultaneous_instances_are_independent(library):
    loaded, token = library
    made = [make(loaded, token) for _ in range(1000)]
    reference = (ctypes.c_uint * 1)(1)  # position.x
    one = ctypes.c_size_t(1)
    for i, instance in enumerate(made):
        assert loaded.fmi3SetFloat64(instance, reference, one, ctypes.byref(ctypes.c_double(i)), one) == 0
    value = ctypes.c_double()
    for i, instance in enumerate(made):
        assert loaded.fmi3GetFloat64(instance, reference, one, ctypes.byref(value), one) == 0
        assert value.value == i
        loaded.fmi3FreeInstance(instance)
