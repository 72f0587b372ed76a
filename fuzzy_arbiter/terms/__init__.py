"""Terms beyond straight lines: curves by name, values of Sugeno outputs, and the expressions that both are made of.

Imports: nothing.
"""

from fuzzy_arbiter.terms.curves import Curve, curve
from fuzzy_arbiter.terms.values import Constant, Formula, Linear

__all__ = ["Constant", "Curve", "Formula", "Linear", "curve"]
