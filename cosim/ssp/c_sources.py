"""C sources that become part of an FMU."""

from __future__ import annotations

from importlib import resources

_NAMED = b'#include "variables.h" /* names the functions */\n'


def c_files(package: str, folder: str) -> dict[str, bytes]:
    """Return the C files and headers of a folder."""
    directory = resources.files(package).joinpath(*folder.split("/"))
    return {file.name: file.read_bytes() for file in directory.iterdir() if file.name.endswith((".c", ".h"))}


def under_own_names(files: dict[str, bytes]) -> dict[str, bytes]:
    """Prefix functions of C files with the name of their FMU, so that FMUs can be linked into one program."""
    return {name: _NAMED + code if name.endswith(".c") else code for name, code in files.items()}
