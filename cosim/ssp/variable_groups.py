"""Groups of an FMU's variables in the format of the Open Simulation Platform: ``NAME_OspModelDescription.xml``."""

from __future__ import annotations

import re
from collections.abc import Iterable
from xml.etree import ElementTree as ET

from plant_fmu.component import Component
from plant_fmu.markup import xml_text

_NAMESPACE = "https://open-simulation-platform.com/OspModelDescription/1.0.0"
LAST_PART = re.compile(r"(?:\.[^.\[\]]+|\[\d+\])$")  # last part of a structured name


def osp_model_description(component: Component, names: Iterable[str]) -> str:
    """Write the groups of variables that are connected together, such as a position or all thruster commands."""
    connectors = set(names)
    groups: dict[tuple[str, bool], list[str]] = {}
    for v in component.variables:
        if v.name in connectors:
            groups.setdefault((LAST_PART.sub("", v.name), v.role == "input"), []).append(v.name)
    root = ET.Element("OspModelDescription", xmlns=_NAMESPACE, version="1.0")
    group_list = ET.SubElement(root, "VariableGroups")
    for (name, is_input), members in groups.items():
        if len(members) > 1:
            both = (name, not is_input) in groups
            group = ET.SubElement(group_list, "Generic", name=f"{name}.{'in' if is_input else 'out'}" if both else name)
            for member in members:
                ET.SubElement(group, "Variable", ref=member)
    return xml_text(root)
