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
    root = ET.Element("ssv:ParameterSet", _NAMESPACES, version="1.0", name=name, description=description)
    root.set("license", "BSD-3-Clause")
    root.set("generationTool", f"subreach {metadata.version('subreach')}")
    parameters = ET.SubElement(root, "ssv:Parameters")
    used: dict[str, None] = {}  # a set that keeps its order
    for v, value in values:
        parameter = ET.SubElement(parameters, "ssv:Parameter", name=v.name, description=v.description)
        element = ET.SubElement(parameter, f"ssv:{v.type.capitalize()}", value=v.text(value))
        if v.quantity.unit:
            element.set("unit", v.quantity.unit)
            used[v.quantity.unit] = None
    if used:
        units = ET.SubElement(root, "ssv:Units")
        for unit in used:
            ET.SubElement(ET.SubElement(units, "ssc:Unit", name=unit), "ssc:BaseUnit", base_unit(unit))
    return xml_text(root)
