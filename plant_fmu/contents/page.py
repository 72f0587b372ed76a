"""The page in an FMU: ``documentation/index.html``, one file that needs no network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib import metadata, resources
from string import Template

import numpy as np
from numpy.typing import NDArray

from plant_fmu.variables import Variable, variables
from plant_fmu.vehicle import Vehicle

# role: title and remark; another role has its own name as its title
_ROLES = {
    "input": ("Inputs", "Commands; they may change at every communication point."),
    "state": ("States", "Start values may be set until initialisation ends."),
    "output": ("Outputs", ""),
    "parameter": ("Parameters", "All tunable: set before a run, or between steps."),
    "derivative": ("Derivatives of the states", ""),
}


def page(vehicle: Vehicle, fmi: int, rows: Sequence[Variable] | None = None) -> str:
    """Return the documentation of a vehicle's FMU.

    Parameters
    ----------
    vehicle : Vehicle
        Vehicle of the FMU.
    fmi : int
        FMI version, 2 or 3.
    rows : sequence of Variable, optional
        Variables of its FMU, where they start at other values than the vehicle's own.

    Returns
    -------
    str
        HTML page: the equations from ``pages/index.html`` in the package, and tables of the variables.
    """
    return Template(text("index.html")).substitute(
        name=escape(vehicle.name),
        title=escape(vehicle.title),
        source=escape(vehicle.source),
        fmi=f"{fmi}.0",
        version=escape(metadata.version("subreach")),
        icon=text("icon.svg"),
        glance="\n".join(_glance(vehicle)),
        variables=tables(variables(vehicle) if rows is None else rows),
    )


def text(name: str) -> str:
    """Return a text file of the folder ``pages``.

    Parameters
    ----------
    name : str
        Name of the file.

    Returns
    -------
    str
        Content of the file.
    """
    return (resources.files("plant_fmu.contents") / "pages" / name).read_text(encoding="utf-8")


def tables(rows: Sequence[Variable]) -> str:
    """Return tables of variables, one for each role.

    Parameters
    ----------
    rows : sequence of Variable
        Variables of an FMU.

    Returns
    -------
    str
        Tables as HTML.
    """
    shown = [v for v in rows if v.role != "time"]
    roles = list(dict.fromkeys([*_ROLES, *(v.role for v in shown)]))
    sections = [(role, [v for v in shown if v.role == role]) for role in roles]
    return "\n".join(line for role, members in sections if members for line in _table(role, members))


def _glance(vehicle: Vehicle) -> list[str]:
    """Return the vehicle's chief numbers as rows of a table."""
    least, most = vehicle.thrust_min.min(), vehicle.thrust_max.max()
    rows = (
        ("Mass", f"{vehicle.mass:g} kg"),
        ("Weight, buoyancy", f"{vehicle.weight:g} N, {vehicle.buoyancy:g} N"),
        ("Thrusters", f"{vehicle.n_thrusters}, within {least:g} N and {most:g} N"),
        ("Centres of gravity and buoyancy", f"{_point(vehicle.r_G)}, {_point(vehicle.r_B)} m, body frame"),
    )
    return [f"<tr><th>{escape(what)}</th><td>{escape(value).replace('-', '−')}</td></tr>" for what, value in rows]


def _point(values: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{x:g}" for x in values) + ")"


def _table(role: str, members: list[Variable]) -> list[str]:
    title, remark = _ROLES.get(role, (role.capitalize(), ""))
    started = any(v.role in ("input", "state", "parameter") for v in members)
    names = ["name", "unit", *(["start"] if started else []), "range", "description"]
    lines = [f'<h3 id="{escape(role)}">{escape(title)}</h3>']
    lines += [f"<p>{escape(remark)}</p>"] if remark else []
    lines += ['<div class="wide"><table class="variables">']
    lines += ["<thead><tr>" + "".join(f"<th>{name}</th>" for name in names) + "</tr></thead>", "<tbody>"]
    for v in members:
        cells = [f"<code>{escape(v.name)}</code>", escape(v.quantity.unit)]
        cells += [_value(v, v.start)] if started else []
        cells += [_range(v), escape(v.description) + (" (not an output)" if v.local and v.role == "state" else "")]
        lines.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    return [*lines, "</tbody>", "</table></div>"]


def _value(v: Variable, value: float) -> str:
    if v.type == "boolean":
        return "true" if value else "false"
    return f"{value:.0f}" if v.type == "integer" else f"{value:.6g}".replace("-", "−")


def _range(v: Variable) -> str:
    if v.type == "boolean":
        return "true, false"
    if not v.quantity.bounded:
        return ""
    return f"{_value(v, v.quantity.minimum)} … {_value(v, v.quantity.maximum)}"
