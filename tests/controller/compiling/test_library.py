"""Compiled C libraries: cache, damage, missing compiler, and missing cache folder."""

import ctypes
import os
import shlex
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from controller.compiling import library, text_cache
from controller.compiling.library import checksum, library_name, load_libraries, load_library
from controller.errors import CompilationError
from controller.translator.types import type_of
from cosim.step.decision import bound_wrench

TEXT = "int answer(void);\nint answer(void) { return 42; }\n"


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """The folder in which libraries are kept, empty."""
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path / name))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))  # for other processes
    yield tmp_path / "subreach" / "functions"
    load_library.cache_clear()


@pytest.fixture
def compiled(monkeypatch):
    """Names of what is compiled."""
    names, real = [], library._compiling

    def noted(text):
        names.append(library_name(text))
        return real(text)

    monkeypatch.setattr(library, "_compiling", noted)
    return names


def answer(text=TEXT):
    load_library.cache_clear()
    return load_library(text).answer()


def test_compiled_library_is_cached_by_its_text(cache, compiled):
    assert [answer(), answer(), answer(TEXT.replace("42", "43"))] == [42, 42, 43]
    assert len(compiled) == 2 and compiled[0] == library_name(TEXT) != compiled[1]
    assert len(list(cache.iterdir())) == 4  # each with its checksum


@pytest.mark.parametrize(
    "damage",
    [
        *(lambda whole, n=n: whole[: int(n * len(whole))] for n in (0.0, 0.3, 0.9, 0.999)),
        lambda whole: whole[:-1] + b"?",
    ],
)
def test_damaged_library_is_recompiled(cache, compiled, caplog, damage):
    answer()
    (path,) = cache.glob("*.so")
    whole = path.read_bytes()
    path.unlink()
    path.write_bytes(damage(whole))
    assert answer() == 42 and len(compiled) == 2
    assert [record.getMessage() for record in caplog.records] == [f"{path}: damaged; compiled anew"]
    assert path.read_bytes() == whole
    library.checksum_path(path).unlink()
    assert answer() == 42 and len(compiled) == 3


@pytest.mark.skipif(os.name != "posix", reason="of POSIX")
def test_a_cache_that_others_can_write_is_not_used(cache, compiled, caplog):
    answer()
    cache.chmod(0o777)
    assert answer() == answer() == 42 and len(compiled) == 3
    assert "others can write there" in caplog.records[0].getMessage() and len(caplog.records) == 1


def test_without_cache_folder_library_is_compiled_per_process(tmp_path, monkeypatch, compiled, caplog):
    (tmp_path / "file").touch()
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path / "file" / name))
    assert answer() == 42 and len(compiled) == 1
    assert caplog.records[0].getMessage().endswith("Not a directory; compiled for this process alone")


def test_prebuilt_library_needs_no_compiler(cache, tmp_path, monkeypatch, compiled):
    answer()
    (tmp_path / "prebuilt").mkdir()
    cache.rename(tmp_path / "prebuilt" / library._platform())
    monkeypatch.setattr(library, "PREBUILT", tmp_path / "prebuilt")
    monkeypatch.setenv("CC", "/nowhere/cc")
    assert answer() == 42 and len(compiled) == 1


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("/nowhere/cc", "no C compiler: CC is '/nowhere/cc', which is not on the PATH"),
        ("'", 'no C compiler: CC is "\'": No closing quotation'),
        ("true", "C compiler true failed: it wrote neither a library nor a message"),
        ("false", "C compiler false failed: it wrote neither a library nor a message"),
    ],
)
def test_missing_compiler_gives_one_line_error(cache, monkeypatch, command, words):
    monkeypatch.setenv("CC", command)
    with pytest.raises(CompilationError) as refused:
        answer()
    assert str(refused.value) == words
    assert not cache.exists()


def test_missing_compiler_error_names_alternatives(monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(CompilationError, match="neither cc nor the ziglang package was found"):
        load_library("none")


def test_compilation_error_quotes_first_compiler_error(cache):
    with pytest.raises(CompilationError, match=r"error: .*unknown"):
        load_library("unknown answer;\n")


COMPILER = """
import os, pathlib, sys, time
folder = pathlib.Path(__file__).parent
if os.fork():  # as the driver of a compiler, which starts the compiler itself
    sys.exit(os.waitstatus_to_exitcode(os.wait()[1]))
(folder / f"{os.getpid()}.pid").touch()
source = next(word for word in sys.argv if word.endswith(".c"))
if "broken" in pathlib.Path(source).read_text():
    sys.exit("error: broken")
until = time.monotonic() + 60.0
while len(list(folder.glob("*.pid"))) < COUNT and time.monotonic() < until:
    time.sleep(0.01)
os.execvp("cc", ["cc", *sys.argv[1:]])
"""


def compilers(folder):
    return sorted(int(path.stem) for path in folder.glob("*.pid"))


def is_running(process):
    try:
        os.kill(process, 0)
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except ProcessLookupError:
        return False
    except FileNotFoundError:
        return not Path("/proc/self").exists()


def wait_for(condition):
    until = time.monotonic() + 60.0
    while not condition() and time.monotonic() < until:
        time.sleep(0.01)
    assert condition()


@pytest.fixture
def waiting_compiler(tmp_path, monkeypatch):
    """A compiler that works only when COUNT of it run."""

    def make(count):
        script = tmp_path / "compiler.py"
        script.write_text(COMPILER.replace("COUNT", str(count)))
        monkeypatch.setenv("CC", shlex.join([sys.executable, str(script)]))

    return make


def test_several_libraries_are_compiled_at_once_while_texts_are_made(cache, tmp_path, waiting_compiler):
    waiting_compiler(3)

    def texts():
        for n in range(3):
            wait_for(lambda n=n: len(compilers(tmp_path)) == n)
            yield TEXT.replace("42", str(n))

    assert [loaded.answer() for loaded in load_libraries(texts())] == [0, 1, 2]


@pytest.mark.parametrize("error", [CompilationError, KeyboardInterrupt])
def test_an_error_stops_all_compilers(cache, tmp_path, waiting_compiler, error):
    waiting_compiler(9)

    def texts():
        yield "broken"
        yield TEXT
        wait_for(lambda: len(compilers(tmp_path)) == 2)
        if error is KeyboardInterrupt:
            raise KeyboardInterrupt

    with pytest.raises(error):
        load_libraries(texts())
    wait_for(lambda: not any(map(is_running, compilers(tmp_path))))
    assert not cache.exists()


@pytest.mark.medium
def test_processes_that_compile_the_same_at_once_leave_one_whole_library(cache):
    code = f"from controller.compiling.library import load_library; print(load_library({TEXT!r}).answer())"
    several = [
        subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    assert [process.communicate(timeout=120) for process in several] == [("42\n", "")] * 3
    (path,) = cache.glob("*.so")
    assert ctypes.CDLL(str(path)).answer() == 42 and library.has_valid_checksum(path)
    assert len(list(cache.iterdir())) == 2


@pytest.mark.medium
def test_what_a_killed_process_left_in_the_cache_is_removed_once_it_is_old(cache):
    answer()
    for name, age in (("old", 2.0), ("young", 0.5)):
        part = cache / f".{name}.part"
        part.write_bytes(b"half")
        then = time.time() - age * library._STALE_AGE
        os.utime(part, (then, then))
    answer(TEXT.replace("42", "43"))
    assert [path.name for path in cache.glob(".*")] == [".young.part"]


@pytest.mark.medium(fast=1)
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such locks")
@pytest.mark.parametrize("killed", [True, False])
def test_temporary_folder_of_a_killed_process_is_removed_by_a_later_one(tmp_path, killed):
    """Once it is old; that of a process which still runs, and folders of others, stay."""
    environment = os.environ | {"TMPDIR": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    script = (
        "from controller.compiling.library import _temporary_folder; print(_temporary_folder(), flush=True); input()"
    )

    def begin():
        process = subprocess.Popen(
            [sys.executable, "-c", script], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        return process, Path(process.stdout.readline().strip())

    first, folder = begin()
    other = tmp_path / "subreach-other"
    other.mkdir()
    if killed:
        first.kill()
        first.communicate(timeout=60)
    long_ago = time.time() - 2.0 * library._STALE_AGE
    for path in (folder, other):
        os.utime(path, (long_ago, long_ago))
    second, own = begin()
    assert folder.exists() is not killed and other.exists() and own.exists()
    for process in (first, second)[killed:]:
        process.communicate("\n", timeout=60)
    assert not own.exists() and not folder.exists()


def test_a_kept_text_is_that_of_the_present_constants(cache, monkeypatch):
    def text():
        return text_cache.c_text_of(bound_wrench, (type_of(np.zeros(6)),))

    plain = text()
    with monkeypatch.context() as patch:
        patch.setattr("cosim.step.decision.MAX_WRENCH", 12345.0)
        assert "12345.0" in text() and "12345.0" not in plain
    assert text() == plain


def test_a_kept_text_depends_on_all_modules_that_are_imported(monkeypatch):
    sources = {
        "controller.a": "from controller import (  # two\n    b,\n    c as d,\n)",
        "controller.b": "import controller.d as e, os",
        "controller.c": "if True:\n    from controller.e import x",
    }
    for name in ("controller.a", "controller.b", "controller.c", "controller.d", "controller.e", "controller.f"):
        monkeypatch.setitem(sys.modules, name, sys)
    monkeypatch.setattr(text_cache, "_source", lambda name: sources.get(name, ""))
    assert text_cache._closure({"controller.a"}) == {"controller", *(f"controller.{name}" for name in "abcde")}


@pytest.mark.parametrize("damage", ["half", "changed", "older"])
def test_a_damaged_text_is_made_anew(damage, cache):
    kind = (type_of(np.zeros(6)),)
    plain = text_cache.c_text_of(bound_wrench, kind)
    (path,) = cache.glob("*.json")
    whole = path.read_bytes()
    damaged = {
        "half": whole[: len(whole) // 2],
        "changed": whole.replace(b"bound_wrench", b"bound_trench"),
        "older": checksum(b"{}").encode() + b"\n{}",
    }
    path.write_bytes(damaged[damage])
    assert text_cache.c_text_of(bound_wrench, kind) == plain
    assert path.read_bytes() == whole
