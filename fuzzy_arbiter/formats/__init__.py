"""Definitions in files: JSON and TOML of our own, FCL of IEC 61131-7, FIS of MATLAB and Octave, FLL of fuzzylite.

Imports: terms, engines.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Literal, get_args

from fuzzy_arbiter.checks import shown
from fuzzy_arbiter.definition import System
from fuzzy_arbiter.errors import ArbiterError, FormatError, UnsupportedError
from fuzzy_arbiter.files import read_text, write_atomic
from fuzzy_arbiter.formats import fcl, fis, fll, json_toml
from fuzzy_arbiter.formats.native import fold_normalization

__all__ = ["FORMATS", "FormatName", "fold_normalization", "load", "reads", "save", "writes"]

FormatName = Literal["json", "toml", "fcl", "fis", "fll"]
FORMATS: tuple[str, ...] = get_args(FormatName)
MAX_FILE = 4_000_000  # maximum number of bytes of a file

_PARSERS: dict[str, tuple[Callable[[str], System], Callable[[System], str]]] = {
    "json": (json_toml.read_json, json_toml.write_json),
    "toml": (json_toml.read_toml, json_toml.write_toml),
    "fcl": (fcl.read, fcl.write),
    "fis": (fis.read, fis.write),
    "fll": (fll.read, fll.write),
}


def reads(text: str, format: str, block: str | None = None) -> System:
    """Parse a text as a system.

    Parameters
    ----------
    text : str
        Content of a file; a byte order mark and the ends of lines do not matter.
    format : {"json", "toml", "fcl", "fis", "fll"}
        Format of the text.
    block : str, optional
        Name of the FUNCTION_BLOCK in a FCL text; needed where there are several.

    Returns
    -------
    System
        The system; only descriptions in the text are dropped.

    Raises
    ------
    FormatError
        If there is no such format or block, the text is not of it, or uses an unsupported part of it.
    DefinitionError
        If the definition is invalid.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> system = Arbiter().system
    >>> from fuzzy_arbiter.formats import reads, writes
    >>> reads(writes(system, "fcl"), "fcl") == system
    True
    """
    _require_format(format, f"format is {format!r}")
    if not isinstance(text, str):
        raise FormatError(f"got {shown(text)}, expected text")
    lines = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    if format == "fcl":
        return fcl.read(lines, block)
    if block is not None:
        raise FormatError(f"block is {shown(block)}, expected none for {format}: only FCL has function blocks")
    return _PARSERS[format][0](lines)


def writes(system: System, format: str) -> str:
    """Format a system as text that parses as the same system.

    Parameters
    ----------
    system : System
        System to write.
    format : {"json", "toml", "fcl", "fis", "fll"}
        Format of the text.

    Returns
    -------
    str
        Content of a file, with every number in full precision.

    Raises
    ------
    FormatError
        If there is no such format.
    UnsupportedError
        If the format cannot represent the system; the unsupported part is named.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> system = Arbiter().system
    >>> from fuzzy_arbiter.formats import writes
    >>> print(writes(system, "fll").splitlines()[0])
    # fuzzy_arbiter: normalization = range, weights_of = "obstacle" "shape" "depth"
    """
    _require_format(format, f"format is {format!r}")
    if not isinstance(system, System):
        raise UnsupportedError(f"got {shown(system)}, expected a System")
    return _PARSERS[format][1](system)


def load(path: str | Path, block: str | None = None) -> System:
    """Load a file, and return its system.

    Parameters
    ----------
    path : str or Path
        JSON, TOML, FCL, FIS or FLL file; its suffix, in any case, selects the format.
    block : str, optional
        Name of the block, as for `reads`.

    Raises
    ------
    FormatError, DefinitionError
        If the file cannot be read, and as for `reads`.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> system = Arbiter().system
    >>> from fuzzy_arbiter.formats import load, save
    >>> save(system, "arbiter.toml")
    >>> load("arbiter.toml") == system
    True
    """
    format = _format(path)
    text = read_text(path, MAX_FILE, format in ("json", "toml"))
    try:
        return reads(text, format, block)
    except ArbiterError as error:
        raise type(error)(f"{path}: {error}") from None


def save(system: System, path: str | Path) -> None:
    """Write a system to a file atomically.

    Parameters
    ----------
    system : System
        System to write.
    path : str or Path
        File, as for `load`; an older one is replaced.

    Raises
    ------
    FormatError, UnsupportedError
        If the file cannot be written, or the format cannot represent the system; nothing is written then.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> system = Arbiter().system
    >>> from fuzzy_arbiter.formats import save
    >>> save(system, "arbiter.json")
    >>> Arbiter.load("arbiter.json").system == system
    True
    """
    write_atomic(path, writes(system, _format(path)).encode("utf-8"))


def _format(path: str | Path) -> str:
    format = Path(path).suffix.lower().removeprefix(".")
    _require_format(format, f"{path}: suffix is {Path(path).suffix!r}")
    return format


def _require_format(format: str, what: str) -> None:
    if format not in FORMATS:
        raise FormatError(f"{what}, expected one of {', '.join(FORMATS)}")
