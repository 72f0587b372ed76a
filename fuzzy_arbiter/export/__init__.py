"""Export to code that does not depend on this package.

Imports: terms, engines.
"""

from fuzzy_arbiter.export.c import to_c
from fuzzy_arbiter.export.python import to_python

__all__ = ["to_c", "to_python"]
