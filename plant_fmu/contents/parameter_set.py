"""Parameter sets in the format of SSP 1.0 (SSV): the numbers of a vehicle for any tool."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib import metadata
from xml.etree import ElementTree as ET

from plant_fmu.markup import xml_text
from plant_fmu.quantities import base_unit
from plant_fmu.variables import Variable, variables
from plant_fmu.vehicle import Vehicle

_NAMESPACES = {
    "xmlns:ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
    "xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
}


def ssv(vehicle: Vehicle, rows: Sequence[Variable] | None = None) -> str:
    """Return the parameter set of a vehicle: every parameter of its FMU, with the vehicle's value."""
    values = [(v, v.start) for v in (variables(vehicle) if rows is None else rows) if v.role == "parameter"]
    return parameter_set(vehicle.name, f"{vehicle.title}. {vehicle.source}", values)


def parameter_set(name: str, description: str, values: Iterable[tuple[Variable, float]]) -> str:
    """Return values of variables as a parameter set."""
    rows = ((v.name, v.description, v.type.capitalize(), v.text(value), v.quantity.unit) for v, value in values)
    return parameter_file(name, description, rows)


def parameter_file(name: str, description: str, rows: Iterable[tuple[str, str, str, str, str]]) -> str:
    """Return a parameter set of rows of name, description, type, text of the value, and unit."""
    root = ET.Element("ssv:ParameterSet", _NAMESPACES, version="1.0", name=name, description=description)
    root.set("license", "BSD-3-Clause")
    root.set("generationTool", f"subreach {metadata.version('subreach')}")
    parameters = ET.SubElement(root, "ssv:Parameters")
    used: dict[str, None] = {}  # a set that keeps its order
    for parameter_name, about, kind, text, unit in rows:
        parameter = ET.SubElement(parameters, "ssv:Parameter", name=parameter_name, description=about)
        element = ET.SubElement(parameter, f"ssv:{kind}", value=text)
        if unit:
            element.set("unit", unit)
            used[unit] = None
    if used:
        units = ET.SubElement(root, "ssv:Units")
        for unit in used:
            ET.SubElement(ET.SubElement(units, "ssc:Unit", name=unit), "ssc:BaseUnit", base_unit(unit))
    return xml_text(root)
