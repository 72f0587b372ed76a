"""Terms beyond straight lines: curves by name, values, expressions; and the norms that join degrees.

Imports: nothing.
"""

from fuzzy_arbiter.terms.curves import Curve, curve
from fuzzy_arbiter.terms.values import Constant, Formula, Linear

__all__ = ["Constant", "Curve", "Formula", "Linear", "curve"]
