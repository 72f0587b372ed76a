"""Export formats: one module for each, with its `Format` as ``FORMAT``.

Each module in this folder is a format with the module's name.

Imports: mavlink, mavlink.wire.
"""

from importlib import import_module
from pkgutil import iter_modules

from cosim.export.format import Format

__all__ = ["FORMATS"]


def _find_formats() -> dict[str, Format]:
    """Return the `Format` of each module in this folder, by name."""
    found = {}
    for module in iter_modules(__path__):
        entry = getattr(import_module(f"{__name__}.{module.name}"), "FORMAT", None)
        if not isinstance(entry, Format):
            raise TypeError(f"{__name__}.{module.name} has no FORMAT, expected its Format")
        found[module.name] = entry
    return found


FORMATS: dict[str, Format] = _find_formats()
