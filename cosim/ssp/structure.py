"""The description of a system of FMUs in the format of SSP 1.0: ``SystemStructure.ssd``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib import metadata
from typing import NamedTuple
from xml.etree import ElementTree as ET

from plant_fmu.markup import xml_text
from plant_fmu.quantities import UNITS, base_unit

_NAMESPACES = {
    "xmlns:ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    # declared at the root: libcosim would read a namespace attribute of the element below as an algorithm
    "xmlns:osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
    "xmlns:oms": "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd",
}


class Connector(NamedTuple):
    """An input or output with a connector."""

    name: str
    kind: str  # "input" or "output"
    unit: str
    description: str


class Part(NamedTuple):
    """One FMU of the system."""

    name: str
    source: str  # path of the FMU in the archive
    description: str
    connectors: tuple[Connector, ...]

    @property
    def parameters(self) -> str:
        """Path of its parameter set in the archive."""
        return self.source.replace(".fmu", ".ssv")


class Wire(NamedTuple):
    """Connections of outputs of one part to inputs of another."""

    start: str  # name of the part with the outputs
    end: str  # name of the part with the inputs
    names: tuple[tuple[str, str], ...]  # names of each output and its input


def structure(
    name: str, description: str, parts: Sequence[Part], wires: Sequence[Wire], stop_time: float, step: float
) -> str:
    """Write the text of ``SystemStructure.ssd``; stop_time, step [s]."""
    version = metadata.version("subreach")
    root = ET.Element(
        "ssd:SystemStructureDescription", _NAMESPACES, version="1.0", name=identifier(name), description=description,
        license="BSD-3-Clause", generationTool=f"subreach {version}",
    )  # fmt: skip
    system = ET.SubElement(root, "ssd:System", name="root")
    elements = ET.SubElement(system, "ssd:Elements")
    units: set[str] = set()
    for part in parts:
        units |= {connector.unit for connector in part.connectors}
        _add_part(elements, part)
    connections = ET.SubElement(system, "ssd:Connections")
    for wire in wires:
        for start, end in wire.names:
            ET.SubElement(
                connections, "ssd:Connection",
                startElement=wire.start, startConnector=start, endElement=wire.end, endConnector=end,
            )  # fmt: skip

    _annotate_for_omsimulator(system, step)

    unit_list = ET.SubElement(root, "ssd:Units")
    for unit in (unit for unit in UNITS if unit in units):
        ET.SubElement(ET.SubElement(unit_list, "ssc:Unit", name=unit), "ssc:BaseUnit", base_unit(unit))
    experiment = ET.SubElement(root, "ssd:DefaultExperiment", startTime="0.0", stopTime=repr(float(stop_time)))
    annotation = ET.SubElement(
        ET.SubElement(experiment, "ssd:Annotations"), "ssc:Annotation", type="com.opensimulationplatform"
    )
    algorithm = ET.SubElement(annotation, "osp:Algorithm")
    ET.SubElement(algorithm, "osp:FixedStepAlgorithm", baseStepSize=repr(float(step)))
    return xml_text(root)


def identifier(name: str) -> str:
    """Replace characters that are invalid in an identifier by underscores, since OMSimulator requires one as name."""
    words = re.sub(r"\W", "_", name, flags=re.ASCII)
    return words if words and not words[0].isdigit() else f"_{words}"


def _annotate_for_omsimulator(system: ET.Element, step: float) -> None:
    """Add the step in the annotation that OMSimulator reads."""
    annotation = ET.SubElement(ET.SubElement(system, "ssd:Annotations"), "ssc:Annotation", type="org.openmodelica")
    information = ET.SubElement(ET.SubElement(annotation, "oms:Annotations"), "oms:SimulationInformation")
    ET.SubElement(
        information, "oms:FixedStepMaster",
        description="oms-ma", stepSize=repr(float(step)), absoluteTolerance="0.0001", relativeTolerance="0.0001",
    )  # fmt: skip


def _add_part(parent: ET.Element, part: Part) -> None:
    element = ET.SubElement(
        parent, "ssd:Component",
        name=part.name, type="application/x-fmu-sharedlibrary", source=part.source, implementation="CoSimulation",
        description=part.description,
    )  # fmt: skip
    connectors = ET.SubElement(element, "ssd:Connectors")
    for name, kind, unit, description in part.connectors:
        connector = ET.SubElement(connectors, "ssd:Connector", name=name, kind=kind, description=description)
        ET.SubElement(connector, "ssc:Real", {"unit": unit} if unit else {})
    bindings = ET.SubElement(element, "ssd:ParameterBindings")
    ET.SubElement(bindings, "ssd:ParameterBinding", type="application/x-ssp-parameter-set", source=part.parameters)
