"""Rules of an arbiter as a plain function, for loops that are run as C."""

from __future__ import annotations

import functools
from typing import Any

from controller.translator.generated import functions_of
from fuzzy_arbiter import System
from fuzzy_arbiter.export import to_python

_CALL = '''

def weigh(inputs, outputs):
    """Fill the outputs."""
    evaluate(inputs, outputs)
'''


@functools.lru_cache(maxsize=8)
def weigher_of(system: System) -> Any:
    """Return a function that weighs as the arbiter's exact engine does, to the last bit.

    Parameters
    ----------
    system : System
        Whose inputs clip, and whose outputs all have a rule that fires or a default.

    Returns
    -------
    function
        ``weigh(inputs, outputs)``, which fills the outputs.
    """
    return functions_of(to_python(system) + _CALL, {"__name__": __name__})["weigh"]
