"""Compilation: what is cached is never older than any source it was made from."""

import errno
import importlib
import pkgutil
from pathlib import Path

import numpy as np
from numba.core.dispatcher import Dispatcher

import controller
import cosim
from controller import compiled as module
from controller import regions
from controller.compiled import compiled
from controller.regions import evaluate_packed


def test_cached_functions_carry_the_stamp_of_all_sources():
    folder = Path(regions.__file__).parent
    assert evaluate_packed._cache._cache_file._source_stamp == module._sources(folder)


def test_the_stamp_is_of_the_package_and_of_the_callers_folder(tmp_path):
    (tmp_path / "mine.py").write_text("a = 1")
    before, elsewhere = module._sources(tmp_path), module._sources(tmp_path / "none")
    module._sources.cache_clear()
    (tmp_path / "mine.py").write_text("a = 2")
    assert len({before, elsewhere, module._sources(tmp_path)}) == 3


def test_the_stamp_is_of_whatever_else_is_named_too(tmp_path):
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "other.py").write_text("a = 1")
    before, without = module._sources(tmp_path / "none", tmp_path), module._sources(tmp_path / "none")
    module._sources.cache_clear()
    (tmp_path / "deep" / "other.py").write_text("a = 2")
    assert len({before, without, module._sources(tmp_path / "none", tmp_path)}) == 3
    function = compiled(lambda x: x + 3.0, tmp_path)
    assert function._cache._cache_file._source_stamp == module._sources(Path(__file__).parent, tmp_path)


def test_a_full_disk_keeps_nothing_and_the_function_runs(monkeypatch, caplog):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    function = compiled(lambda x: x + 4.0)
    monkeypatch.setattr(function._cache._cache_file, "save", full)
    assert function(1.0) == 5.0
    assert "No space left" in caplog.text


def test_without_numbas_insides_nothing_is_cached(monkeypatch):
    real = module.numba.njit
    real(lambda x: x)(1.0)  # what Numba compiles of its own it loads now
    made = []

    def njit(**options):
        def wrap(function):
            made.append(options)
            jitted = real(error_model="numpy")(function)
            if options.get("cache"):
                monkeypatch.setattr(jitted, "_cache", object(), raising=False)
            return jitted

        return wrap

    monkeypatch.setattr(module.numba, "njit", njit)
    assert compiled(lambda x: x + 1.0)(1.0) == 2.0
    assert [options.get("cache", False) for options in made] == [True, False]


def test_without_a_place_to_keep_it_nothing_is_cached(monkeypatch):
    real = module.numba.njit

    def njit(**options):
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return real(**options)

    monkeypatch.setattr(module.numba, "njit", njit)
    assert compiled(lambda x: x + 2.0)(1.0) == 3.0


def test_division_by_zero_gives_what_numpy_gives():
    assert np.isinf(compiled(lambda x: 1.0 / x)(0.0))


def lean_functions():
    """All functions of the project that count no references."""
    found = {}
    for package in (controller, cosim):
        for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if info.name.endswith(("__main__", "as_rrd")):  # the latter needs what is not among the tests' own packages
                continue
            for value in vars(importlib.import_module(info.name)).values():
                if isinstance(value, Dispatcher) and value.targetoptions.get("_nrt") is False:
                    found[f"{value.py_func.__module__}.{value.py_func.__qualname__}"] = value
    return found


def test_what_counts_no_references_calls_nothing_that_returns_an_array():
    """Its result would never be freed."""
    functions = lean_functions()
    assert "controller.regions.visibility.visibility" in functions and "cosim.native.read" in functions
    for name, function in functions.items():
        python = function.py_func
        for called in (python.__globals__.get(word) for word in python.__code__.co_names):
            if isinstance(called, Dispatcher):
                assert "Array" not in str(called.py_func.__annotations__.get("return")), (name, called)
