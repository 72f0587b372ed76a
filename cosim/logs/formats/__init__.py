"""Formats of logs, one module each, whose `LogFormat` is called ``FORMAT``.

To add a format, add a module to this folder.

Imports: mavlink.wire, plant_fmu, simulation.
"""

from importlib import import_module
from pkgutil import iter_modules

from cosim.logs.format import LogFormat

__all__ = ["FORMATS"]


def _find_formats() -> dict[str, LogFormat]:
    """Return the format of each suffix."""
    found: dict[str, LogFormat] = {}
    for module in iter_modules(__path__):
        entry = getattr(import_module(f"{__name__}.{module.name}"), "FORMAT", None)
        if not isinstance(entry, LogFormat):
            raise TypeError(f"{__name__}.{module.name} has no FORMAT, expected its LogFormat")
        found |= dict.fromkeys(entry.suffixes, entry)
    return found


FORMATS: dict[str, LogFormat] = _find_formats()
