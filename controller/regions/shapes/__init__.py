"""Shapes: one file each, which defines all properties of the shape as its ``ENTRY``.

Each file in this folder is a shape, with the file's name; C code of the same name may be beside it.

Imports: nothing.
"""

from importlib import import_module
from pkgutil import iter_modules

from controller.regions.entry import Entry


def _find_entries() -> dict[str, Entry]:
    """Return the entries of all files in this folder, those of position first, each with its kind."""
    entries = {}
    for module in iter_modules(__path__):
        entry = getattr(import_module(f"{__name__}.{module.name}"), "ENTRY", None)
        if not isinstance(entry, Entry):
            raise TypeError(f"{__name__}.{module.name} has no ENTRY, expected the Entry of its shape")
        entries[module.name] = entry
    ordered = dict(sorted(entries.items(), key=lambda item: (item[1].of_attitude, item[0])))
    for kind, entry in enumerate(ordered.values()):
        entry.shape.kind = kind
    return ordered


ENTRIES: dict[str, Entry] = _find_entries()
