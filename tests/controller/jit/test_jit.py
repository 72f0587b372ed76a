"""Compilation: what is cached is never older than any source it was made from."""

import errno
import importlib
import logging
import os
import pkgutil
import runpy
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

import controller
import cosim
from controller import regions
from controller.jit import jit as module
from controller.jit.jit import compiled
from controller.regions.region_set import evaluate_packed


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


@pytest.fixture
def kept(tmp_path):
    """A function that gives 5 for 1, kept in the folder of its own file; returns what loads it anew, and its files."""
    (tmp_path / "it.py").write_text("def it(x):\n    return x + 4.0\n")

    def load():
        return compiled(runpy.run_path(str(tmp_path / "it.py"))["it"])

    function = load()
    assert function(1.0) == 5.0
    module._tell_of_damage.cache_clear()
    place = Path(function._cache.cache_path)  # NUMBA_CACHE_DIR may say another than beside its file
    return load, {ending: next(place.glob(f"*.{ending}")) for ending in ("nbi", "nbc")}


def a_folder(file):
    file.unlink()
    file.mkdir()


def one_bit_of_code(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


DAMAGES = {
    "empty": lambda file: file.write_bytes(b""),
    "half": lambda file: os.truncate(file, file.stat().st_size // 2),
    "one byte short": lambda file: os.truncate(file, file.stat().st_size - 1),
    "one bit": one_bit_of_code,
    "garbage": lambda file: file.write_bytes(os.urandom(1000)),
    "a pickle of another's": lambda file: file.write_bytes(b"\x80\x04cno_such_module\nrun\n."),
}


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_d1_a_damaged_file_of_the_cache_is_made_anew(kept, damage, ending, caplog):
    load, files = kept
    damage(files[ending])
    again = load()
    assert again(1.0) == 5.0 and not again.stats.cache_hits
    (said,) = caplog.messages
    assert "\n" not in said and "damaged" in said and str(files[ending].parent) in said
    healed = load()
    assert healed(1.0) == 5.0 and healed.stats.cache_hits
    assert len(caplog.messages) == 1


def test_an_index_whose_class_has_gone_is_made_anew(tmp_path, monkeypatch):
    """As after an update that names a class otherwise."""
    monkeypatch.syspath_prepend(tmp_path)
    text = "from typing import NamedTuple\n\nclass Old(NamedTuple):\n    x: float\n\ndef it(a):\n    return a.x + 4.0\n"
    for name in ("Old", "Newer"):  # of another length: Python takes a file of the same second and size for the old one
        (tmp_path / "of_a_class.py").write_text(text.replace("Old", name))
        importlib.invalidate_caches()
        sys.modules.pop("of_a_class", None)
        module._sources.cache_clear()
        source = importlib.import_module("of_a_class")
        monkeypatch.setattr(source, "__cached__", None)
        assert compiled(source.it)(getattr(source, name)(1.0)) == 5.0


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="whoever runs this may read every file")
def test_d1_a_file_that_cannot_be_read_is_made_anew(kept, caplog):
    load, files = kept
    files["nbc"].chmod(0)
    assert load()(1.0) == 5.0 and "damaged" in caplog.text
    assert load()(1.0) == 5.0 and files["nbc"].stat().st_size > 0


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
def test_d1_a_folder_in_the_place_of_a_file_is_left_and_the_function_runs(kept, ending, caplog):
    load, files = kept
    a_folder(files[ending])
    assert load()(1.0) == 5.0 and files[ending].is_dir()
    assert all("\n" not in said for said in caplog.messages) and "this process alone" in caplog.text


def test_d1_code_of_older_sources_is_not_loaded_by_an_index_of_newer_ones(kept, tmp_path, caplog):
    """A kill between the two files leaves both."""
    load, files = kept
    old = files["nbc"].read_bytes()
    (tmp_path / "other.py").write_text("a = 1")
    module._sources.cache_clear()
    assert load()(1.0) == 5.0
    files["nbc"].write_bytes(old)
    again = load()
    assert again(1.0) == 5.0 and not again.stats.cache_hits


def test_d1_what_is_sound_is_loaded_without_a_word(kept, caplog):
    load, files = kept
    caplog.set_level(logging.DEBUG, "controller")
    assert load()(1.0) == 5.0 and not caplog.messages
    shutil.rmtree(files["nbc"].parent)
    assert load()(1.0) == 5.0 and not caplog.messages


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
            if info.name.endswith(
                ("__main__", "rrd_writer")
            ):  # the latter needs what is not among the tests' own packages
                continue
            for value in vars(importlib.import_module(info.name)).values():
                if isinstance(value, Dispatcher) and value.targetoptions.get("_nrt") is False:
                    found[f"{value.py_func.__module__}.{value.py_func.__qualname__}"] = value
    return found


def test_what_counts_no_references_calls_nothing_that_returns_an_array():
    """Its result would never be freed."""
    functions = lean_functions()
    assert "controller.regions.shapes.visibility.visibility" in functions and "cosim.batch.c_calls.fmi_get" in functions
    for name, function in functions.items():
        python = function.py_func
        for called in (python.__globals__.get(word) for word in python.__code__.co_names):
            if isinstance(called, Dispatcher):
                assert "Array" not in str(called.py_func.__annotations__.get("return")), (name, called)
