"""The library of the lanes: cached, complete, and rebuilt if damaged."""

import logging

import platformdirs
import pytest

from cosim.batch import lanes_library as module
from cosim.batch.lanes_library import lanes_library
from plant_fmu import load_vehicle
from plant_fmu.errors import BuildError

QUICK = ("-O1",)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    lanes_library.cache_clear()
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda name: str(tmp_path / name))
    return tmp_path / "subreach" / "lanes"


def test_missing_compiler_gives_one_line_error(cache, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(BuildError, match="no C compiler: CC is 'no-such-compiler'"):
        lanes_library(load_vehicle("odin"))
    assert not cache.exists()


def test_failed_compilation_leaves_no_file(cache, monkeypatch):
    monkeypatch.setattr(module, "_files", lambda vehicle, beside: {"many_bad.c": b"no C"})
    with pytest.raises(BuildError, match="failed"):
        lanes_library(load_vehicle("odin"))
    assert not cache.exists() or not list(cache.iterdir())


@pytest.mark.slow
def test_library_is_cached_and_rebuilt_if_damaged(cache, tmp_path, monkeypatch):
    built = []
    compile_library = module.compile_library
    monkeypatch.setattr(module, "compile_library", lambda *a: (built.append(a[4].name), compile_library(*a)))

    def load():
        lanes_library.cache_clear()
        assert lanes_library(load_vehicle("odin"), QUICK).lanes_count() in (4, 8)

    load()
    load()
    library, checksum = sorted(cache.iterdir())
    assert built == [library.name]
    # elsewhere, for whoever has loaded a file does not look at it again
    elsewhere = tmp_path / "elsewhere" / "subreach" / "lanes"
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda name: str(tmp_path / "elsewhere" / name))
    elsewhere.mkdir(parents=True)
    (elsewhere / library.name).write_bytes(library.read_bytes()[:1000])
    (elsewhere / checksum.name).write_bytes(checksum.read_bytes())
    load()
    assert built == [library.name] * 2 and sorted(p.name for p in elsewhere.iterdir()) == [library.name, checksum.name]
    assert (elsewhere / library.name).stat().st_size > 1000


@pytest.mark.slow
def test_without_cache_folder_library_is_compiled_per_process(cache, caplog):
    cache.parent.mkdir()
    cache.write_text("a file, no folder")
    with caplog.at_level(logging.WARNING):
        assert lanes_library(load_vehicle("odin"), QUICK).lanes_count() in (4, 8)
    assert "compiled for this process alone" in caplog.text
