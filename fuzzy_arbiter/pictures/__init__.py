"""Pictures of a system: its terms, its rules at a sample, and its outputs over its inputs.

Every function draws on the axes that it is given, or on those of a new figure, and returns them; none shows or saves
anything. Matplotlib is needed only when one is called.

Imports: terms, engines.
"""

import warnings

from fuzzy_arbiter.pictures.fields import decisions, surface
from fuzzy_arbiter.pictures.lines import profile, terms
from fuzzy_arbiter.pictures.rule_picture import rules
from fuzzy_arbiter.pictures.style import COLORS

__all__ = [
    "COLORS",
    "decisions",
    "profile",
    "rules",
    "surface",
    "terms",
]


def __getattr__(name: str) -> object:
    if name != "COLOURS":  # its former spelling
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn("COLOURS is now COLORS", DeprecationWarning, stacklevel=2)
    return COLORS
