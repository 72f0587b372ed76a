"""The arbiter's closed form as a plain function, for loops that are run as C."""

from __future__ import annotations

from typing import Any

from controller.translator.generated import functions_of
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.export import to_python

# of memberships, shape (3,), and weights, shape (3,), which it fills; it returns what `to_python` says
weigh: Any = functions_of(to_python(Arbiter().system), {"__name__": __name__})["evaluate"]
