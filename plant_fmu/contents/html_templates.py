"""HTML pages from Jinja2 templates, which escape all that they show."""

from __future__ import annotations

from collections.abc import Callable
from importlib import resources
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jinja2 import Environment


def make_environment(**filters: Callable[..., object]) -> Environment:
    """Return an environment whose templates are named PACKAGE/FILE, with further filters."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    environment = Environment(
        loader=FunctionLoader(_read), autoescape=True, undefined=StrictUndefined, finalize=_join_percent,
        trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    environment.filters |= {"verbatim": environment.filters["escape"], **filters}  # verbatim: its spaces stay
    return environment


def _read(template: str) -> str:
    package, _, file = template.partition("/")
    return (resources.files(package) / file).read_text(encoding="utf-8")


def _join_percent(value: object) -> object:
    """Put a no-break space between a number and its percent sign, in texts that are not HTML yet."""
    if isinstance(value, str) and not hasattr(value, "__html__"):
        return value.replace(" %", "\N{NO-BREAK SPACE}%")
    return value
