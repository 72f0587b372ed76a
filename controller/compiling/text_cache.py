"""Keep the C texts of this package's functions between processes: translating takes longer than many a run."""

from __future__ import annotations

import functools
import hashlib
import json
import logging
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import FunctionType

from controller.compiling.library import cache_folder, checksum, is_trusted, write_atomic
from controller.translator.program import Program, text_of_global
from controller.translator.types import Type

log = logging.getLogger(__name__)
_OWN = ("controller", "cosim", "plant_fmu", "fuzzy_arbiter")  # others' functions may depend on more than on their files
_IMPORT = re.compile(r"^\s*(?:from +([\w.]+) +)?import +(\([^)]*|[^\n#]*)", re.M)


def c_text_of(function: Callable[..., None], types: tuple[Type, ...]) -> str:
    """Translate a function to C for arguments of some types, or take the text from the cache."""
    module = getattr(function, "__module__", None) or ""
    if not isinstance(function, FunctionType) or module.partition(".")[0] not in _OWN or function.__closure__:
        return _translated(function, types).text()
    key = hashlib.sha256(f"{module} {function.__qualname__} {types} {sys.version}".encode()).hexdigest()[:32]
    path = cache_folder() / f"{key}.json"
    text = _read_cached(path)
    if text is None:
        program = _translated(function, types)
        text = program.text()
        try:
            digests = {name: _digest(name) for name in sorted(_closure(program.modules))}
            kept = json.dumps({"modules": digests, "globals": program.globals, "text": text}).encode()
            path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            if is_trusted(path.parent):
                write_atomic(path, checksum(kept).encode() + b"\n" + kept)
        except OSError as error:
            log.debug("%s: %s", path, error)
    return text


def _translated(function: Callable[..., None], types: tuple[Type, ...]) -> Program:
    program = Program()
    program.export("entry", function, types)
    return program


def _read_cached(path: Path) -> str | None:
    """Return a text from the cache; None unless all files and values that it was made from are as they were."""
    try:
        expected, _, data = path.read_bytes().partition(b"\n") if is_trusted(path.parent) else (b"", b"", b"")
        if expected == checksum(data).encode():
            kept = json.loads(data)
            same_files = all(_digest(name) == digest for name, digest in kept["modules"].items())
            if same_files and all(_current_value(name) == text for name, text in kept["globals"].items()):
                return str(kept["text"])
    except (OSError, KeyError, AttributeError):  # a file or a value is not there
        pass
    return None


def _current_value(name: str) -> str:
    """Return the text of a value, which may have been set since its file was read, by "module:name"."""
    module, _, attribute = name.partition(":")
    return text_of_global(getattr(sys.modules[module], attribute))


@functools.cache
def _source(module: str) -> str:
    return Path(sys.modules[module].__file__ or "").read_text(encoding="utf-8")


@functools.cache
def _digest(module: str) -> str:
    return hashlib.sha256(_source(module).encode()).hexdigest()


def _closure(modules: set[str]) -> set[str]:
    """Return modules with all modules of these packages that they import, from which their constants may come."""
    closure, unread = set[str](), set(modules)
    while unread:
        name = unread.pop()
        closure.add(name)
        for package, names in _IMPORT.findall(_source(name)):
            parts = re.findall(r"[\w.]+", names)
            imported = {package, *(f"{package}.{part}" for part in parts)} if package else set(parts)
            unread |= {one for one in imported if one.partition(".")[0] in _OWN and one in sys.modules} - closure
    return closure
