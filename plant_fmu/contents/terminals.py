"""Terminals of the FMI 3.0 FMU: its inputs and outputs in groups that a tool can connect at one go, and its icon."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.etree import ElementTree as ET

from plant_fmu.markup import xml_text
from plant_fmu.variables import Variable

_DESCRIPTIONS = {
    "pose": "Position and attitude of the vehicle",
    "position": "Position of the body origin, world frame NED",
    "quaternion": "Unit quaternion from body to world, scalar first",
    "attitude": "Euler angles, in the order yaw, pitch, roll",
    "velocity": "Velocity over ground, body frame",
    "thrusters": "All thrusters",
    "wrench": "Commanded wrench on the body, in addition to the thrusters",
    "actuation": "Wrench of all actuators on the body",
    "water_velocity": "Velocity of the water at the vehicle, world frame NED",
    "measured": "Samples of the sensors",
    "measured.velocity": "Velocity over ground from the DVL, body frame",
    "measured.acceleration": "Specific force from the IMU, body frame",
    "measured.angular_velocity": "Angular velocity from the IMU, body frame",
    "measured.position": "Position from the USBL, world frame NED",
    "measured.time": "Time of each sensor's sample",
}
_POSE = ("position", "quaternion", "attitude")
# variables name[i] of thruster i, and their names within its terminal
_THRUSTER = {"thrust": "command", "thruster_force": "force", "thrust_saturated": "saturated"}


@dataclass
class _Terminal:
    members: list[tuple[str, str]] = field(default_factory=list)  # name of the member and of its variable
    nested: dict[str, _Terminal] = field(default_factory=dict)

    def at(self, path: tuple[str, ...]) -> _Terminal:
        """Return the terminal at a path below this one; make it where it is missing."""
        if not path:
            return self
        return self.nested.setdefault(path[0], _Terminal()).at(path[1:])


def terminals_and_icons(rows: Sequence[Variable]) -> str:
    """Return ``terminalsAndIcons.xml`` of FMI 3.0."""
    root = _Terminal()
    for v in rows:
        location = _locate(v)
        if location:
            path, member = location
            root.at(path).members.append((member, v.name))

    # FMI Library refuses such a file of another FMI version as damaged, so this one is for FMI 3.0 alone
    document = ET.Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    picture = ET.SubElement(document, "GraphicalRepresentation")
    square = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
    ET.SubElement(picture, "CoordinateSystem", square, suggestedScalingFactorTo_mm="0.1")
    ET.SubElement(picture, "Icon", square)
    _write(ET.SubElement(document, "Terminals"), root, "")
    return xml_text(document)


def _locate(v: Variable) -> tuple[tuple[str, ...], str] | None:
    """Return the terminal of a variable and its name there."""
    # a signal must be an input or an output (FMI 3.0.2, predefined kinds of variables)
    if v.local or v.role not in ("input", "state", "output") or v.type == "clock":
        return None
    if v.name in _THRUSTER:  # an array
        return ("thrusters",), _THRUSTER[v.name]
    if v.name in _POSE:
        return ("pose",), v.name
    indexed = re.fullmatch(r"(\w+)\[(\d+)\]", v.name)
    if indexed:
        name, number = indexed.groups()
        return ("thrusters", f"thruster[{number}]"), _THRUSTER.get(name, name)
    *path, member = v.name.split(".")
    if path and path[0] in _POSE:
        path.insert(0, "pose")
    return (tuple(path), member) if path else None


def _write(parent: ET.Element, terminal: _Terminal, prefix: str) -> None:
    for name, child in terminal.nested.items():
        # a plug connects whole or not at all; where a tool may leave out parts it is a bus
        is_plug = child.members and not child.nested and not name.startswith("thruster[")
        element = ET.SubElement(parent, "Terminal", name=name, matchingRule="plug" if is_plug else "bus")
        description = _DESCRIPTIONS.get(prefix + name)
        if name.startswith("thruster["):
            description = f"Thruster {name[9:-1]}: command in, force out"
        if description:
            element.set("description", description)
        for member, variable in child.members:
            attributes = {"variableName": variable, "memberName": member, "variableKind": "signal"}
            ET.SubElement(element, "TerminalMemberVariable", attributes)
        _write(element, child, "" if name == "pose" else f"{prefix}{name}.")
