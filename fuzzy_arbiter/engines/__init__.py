"""The engines: ways to evaluate one and the same system, chosen by name.

Imports: terms.
"""

from __future__ import annotations

from typing import Literal, get_args

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.engines.clipped_centroid import Centroid
from fuzzy_arbiter.engines.closed import ClosedEngine
from fuzzy_arbiter.engines.engine import Engine
from fuzzy_arbiter.engines.exact import ExactEngine
from fuzzy_arbiter.engines.grid import GridEngine
from fuzzy_arbiter.engines.normal_form import NoClosedFormError
from fuzzy_arbiter.errors import EngineError

EngineName = Literal["auto", "closed", "exact", "grid", "skfuzzy"]
ENGINES: tuple[str, ...] = get_args(EngineName)


def choose(system: System, engine: str) -> tuple[Engine, str]:
    """Return the engine that evaluates a system, and the reason for the choice."""
    if engine == "auto":
        try:
            return ClosedEngine(
                system
            ), "the outputs' cuts are h and 1 - h for all inputs, so that there is a closed form"
        except NoClosedFormError as error:
            exact = ExactEngine(system)
            inexact = [f"{name!r}: {method}" for name, method in exact.methods.items() if method != Centroid.method]
            return exact, "; ".join([f"there is no closed form: {error.reason}", *inexact])
    if engine not in ENGINES:
        raise EngineError(f"engine is {engine!r}, expected one of {', '.join(ENGINES)}")
    if engine == "skfuzzy":
        try:
            from fuzzy_arbiter.engines.scikit import ScikitEngine  # a second of imports
        except ModuleNotFoundError as error:
            raise EngineError(
                f"engine 'skfuzzy': {error.name} is not installed, expected the extra fuzzy-arbiter[skfuzzy]"
            ) from None
        return ScikitEngine(system), "requested"
    return {"closed": ClosedEngine, "exact": ExactEngine, "grid": GridEngine}[engine](system), "requested"
