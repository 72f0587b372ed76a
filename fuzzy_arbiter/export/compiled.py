"""The arbiter as a function that Numba compiles, to be called from compiled loops."""

from __future__ import annotations

from types import FunctionType
from typing import Any

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.export.python import to_python


def compiled(system: System) -> Any:
    """Return a compiled function ``evaluate(inputs, outputs) -> int``."""
    try:
        import numba
    except ImportError:
        raise EngineError("compiled: Numba is not installed, expected the extra fuzzy-arbiter[numba]") from None
    namespace: dict[str, Any] = {}

    exec(compile(to_python(system), f"<{system.name}>", "exec"), namespace)  # noqa: S102
    # each function finds those it calls in the same namespace
    for name, function in list(namespace.items()):
        if isinstance(function, FunctionType) and name != "weights":
            namespace[name] = numba.njit(function)
    return namespace["evaluate"]
