"""The library of the predictions: cached, and rebuilt if damaged."""

import platformdirs
import pytest

from cosim.identification import shooting
from cosim.identification.shooting import Shooter
from plant_fmu import load_vehicle
from plant_fmu.errors import BuildError


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda name: str(tmp_path / name))
    shooting._library.cache_clear()
    yield tmp_path / "subreach" / "shooting"
    shooting._library.cache_clear()


def test_missing_compiler_gives_one_line_error(cache, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(BuildError, match="no C compiler: CC is 'no-such-compiler'"):
        Shooter(load_vehicle("odin"))
    assert not cache.exists()


def test_failed_compilation_leaves_no_file(cache, monkeypatch):
    monkeypatch.setattr(shooting, "c_sources", lambda *_: {"bad.c": b"no C"})
    with pytest.raises(BuildError, match="failed"):
        Shooter(load_vehicle("odin"))
    assert not cache.exists() or not list(cache.iterdir())


@pytest.mark.slow
def test_library_is_cached_and_rebuilt_if_damaged(cache, monkeypatch):
    built = []
    compile_library = shooting.compile_library
    monkeypatch.setattr(shooting, "compile_library", lambda *a: (built.append(a[4].name), compile_library(*a)))

    def load():
        shooting._library.cache_clear()
        Shooter(load_vehicle("odin"))

    load()
    load()
    library, _ = sorted(cache.iterdir())
    assert built == [library.name]
    # another file of that name: a process that has loaded a file does not read it again
    content = library.read_bytes()
    library.unlink()
    library.write_bytes(content[:1000])
    load()
    assert built == [library.name] * 2 and library.stat().st_size > 1000
