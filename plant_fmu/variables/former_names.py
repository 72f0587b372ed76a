"""Former names of variables: they began with words that Modelica reserves."""

from __future__ import annotations

import functools
import logging
from collections.abc import Container

log = logging.getLogger(__name__)

_PRESENT = {"external": "load", "initial": "start"}  # first parts of names


def present_name(name: str, known: Container[str]) -> str:
    """Return the name of a known variable in place of its former one; any other name as it is."""
    first, dot, rest = name.partition(".")
    present = f"{_PRESENT.get(first, first)}{dot}{rest}"
    if present == name or name in known or present not in known:
        return name
    _log_former_name(name, present)
    return present


@functools.cache  # one line, however often a name is used
def _log_former_name(name: str, present: str) -> None:
    log.warning("variable %s is now %s", name, present)
