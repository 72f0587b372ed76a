"""Gains of a law from texts such as ``k_p1=10``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from controller import LAWS
from cosim.errors import RunError
from plant_fmu.toml_tables import hint


def law_named(name: str) -> Any:
    """Return the class of a law.

    Parameters
    ----------
    name : str
        Name of the law, a key of `controller.LAWS`.

    Returns
    -------
    type of CompiledLaw
        Class of the law, whose ``gains_type`` has the defaults of the gains.

    Raises
    ------
    RunError
        If there is no such law.
    """
    if name not in LAWS:
        raise RunError(f"law {name!r} is unknown; {hint(name, LAWS)}")
    return LAWS[name]


def gains_from(law: str, settings: Sequence[str] = ()) -> Any:
    """Return the gains of a law with settings applied.

    Parameters
    ----------
    law : str
        Name of the law, a key of `controller.LAWS`.
    settings : sequence of str
        Settings ``key=value`` with numbers as values.

    Returns
    -------
    NamedTuple
        Gains, an instance of the law's ``gains_type``; their values are not validated.

    Raises
    ------
    RunError
        If there is no such law, it has no such gain, or the value is not a number.
    """
    gains = law_named(law).gains_type()
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
    """Return the gains of several laws with settings applied.

    Parameters
    ----------
    laws : sequence of str
        Names of the laws, keys of `controller.LAWS`.
    settings : sequence of str
        Settings ``law.key=value`` with numbers as values.

    Returns
    -------
    dict of str to NamedTuple
        Gains of each law; their values are not validated.

    Raises
    ------
    RunError
        If a law or a gain is unknown, or the value is not a number.
    """
    by_law: dict[str, list[str]] = {law: [] for law in laws}
    for text in settings:
        law, dot, rest = text.strip().partition(".")
        if not dot or law not in by_law:
            raise RunError(f"--set {text!r}: expected LAW.KEY=VALUE with one of {', '.join(laws)}")
        by_law[law].append(rest)
    return {law: gains_from(law, of_law) for law, of_law in by_law.items()}
