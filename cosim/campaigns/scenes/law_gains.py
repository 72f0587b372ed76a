"""Gains of a law from texts such as ``k_p1=10``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from controller import LAWS
from cosim.errors import RunError
from plant_fmu.toml_tables import hint


def law_class(name: str) -> Any:
    """Return the class of a law."""
    if name not in LAWS:
        raise RunError(f"law {name!r} is unknown; {hint(name, LAWS)}")
    return LAWS[name]


def gains_from(law: str, settings: Sequence[str] = ()) -> Any:
    """Return the gains of a law with settings applied."""
    gains = law_class(law).gains_type()
    for text in settings:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise RunError(f"--set {text!r}: expected key=value")
        if key not in gains._fields:
            raise RunError(f"--set {key}: the law {law} has no such gain; {hint(key, gains._fields)}")
        try:
            gains = gains._replace(**{key: float(value)})
        except ValueError as error:
            raise RunError(f"--set {key}: {value!r} is no number") from error
    return gains


def gains_by_law(laws: Sequence[str], settings: Sequence[str] = ()) -> dict[str, Any]:
    """Return the gains of several laws with settings applied."""
    by_law: dict[str, list[str]] = {law: [] for law in laws}
    for text in settings:
        law, dot, rest = text.strip().partition(".")
        if not dot or law not in by_law:
            raise RunError(f"--set {text!r}: expected LAW.KEY=VALUE with one of {', '.join(laws)}")
        by_law[law].append(rest)
    return {law: gains_from(law, of_law) for law, of_law in by_law.items()}
