"""The page in an FMU: ``documentation/index.html``, one file that needs no network."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from importlib import metadata, resources
from typing import TYPE_CHECKING

from plant_fmu.contents.html_templates import make_environment
from plant_fmu.variables import Variable, variables
from plant_fmu.vehicle import Vehicle

if TYPE_CHECKING:
    from jinja2 import Environment

# role: title and remark; another role has its own name as its title
_ROLES = {
    "input": ("Inputs", "Commands; they may change at every communication point."),
    "state": ("States", "Start values may be set until initialization ends."),
    "output": ("Outputs", ""),
    "parameter": ("Parameters", "All tunable: set before a run, or between steps."),
    "derivative": ("Derivatives of the states", ""),
}


def page(vehicle: Vehicle, fmi: int, rows: Sequence[Variable] | None = None) -> str:
    """Return the documentation of a vehicle's FMU, whose variables are `rows` where they start at other values."""
    rows = variables(vehicle) if rows is None else rows
    return render_page("plant_fmu.contents/pages/index.html.j2", rows, fmi, vehicle=vehicle, icon=text("icon.svg"))


def render_page(template: str, rows: Sequence[Variable], fmi: int, **values: object) -> str:
    """Return the documentation of an FMU with variables, from its template and further values by name."""
    version = metadata.version("subreach")
    return _environment().get_template(template).render(values, roles=list(_roles(rows)), fmi=fmi, version=version)


def text(name: str) -> str:
    """Return a text file of the folder ``pages``."""
    return (resources.files("plant_fmu.contents") / "pages" / name).read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    return make_environment(start=_starts, range=_range, number=_number)


def _roles(rows: Sequence[Variable]) -> Iterator[dict[str, object]]:
    """Yield the variables of each role, with title and remark."""
    for name in dict.fromkeys([*_ROLES, *(v.role for v in rows if v.role != "time")]):
        title, remark = _ROLES.get(name, (name.capitalize(), ""))
        if members := [v for v in rows if v.role == name]:
            has_start = name in ("input", "state", "parameter")
            yield {"name": name, "title": title, "remark": remark, "variables": members, "has_start": has_start}


def _starts(v: Variable) -> str:
    """Return the start value, or those of an array; one where all are the same."""
    values = v.starts if len({*v.starts}) > 1 else (v.start,)
    return ", ".join(_value(v, value) for value in values)


def _number(x: float) -> str:
    return f"{x:.6g}".replace("-", "−")


def _value(v: Variable, value: float) -> str:
    if v.type == "boolean":
        return "true" if value else "false"
    return f"{value:.0f}" if v.type == "integer" else _number(value)


def _range(v: Variable) -> str:
    if v.type == "boolean":
        return "true, false"
    if not v.quantity.bounded:
        return ""
    return f"{_value(v, v.quantity.minimum)} … {_value(v, v.quantity.maximum)}"
