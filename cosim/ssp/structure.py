"""The description of a system of FMUs in the format of SSP 1.0: ``SystemStructure.ssd``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from xml.etree import ElementTree as ET

from plant_fmu.component import Component
from plant_fmu.markup import xml_text
from plant_fmu.quantities import UNITS, base_unit
from plant_fmu.variables import Variable

_NAMESPACES = {
    "xmlns:ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    # declared at the root: libcosim would read a namespace attribute of the element below as an algorithm
    "xmlns:osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
    "xmlns:oms": "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd",
}


@dataclass(frozen=True)
class Part:
    """One FMU of the system."""

    name: str
    source: str  # path of the FMU in the archive
    component: Component
    connectors: tuple[str, ...]  # names of the inputs and outputs with a connector

    @property
    def parameters(self) -> str:
        """Path of its parameter set in the archive."""
        return self.source.replace(".fmu", ".ssv")


@dataclass(frozen=True)
class Wire:
    """Connection of outputs of one part to the inputs of the same names of another."""

    start: str  # name of the part with the outputs
    end: str  # name of the part with the inputs
    names: tuple[str, ...]  # names of the variables


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
        connected = [v for v in part.component.variables if v.name in part.connectors]
        units |= {v.quantity.unit for v in connected}
        _add_part(elements, part, connected)
    connections = ET.SubElement(system, "ssd:Connections")
    for wire in wires:
        for signal in wire.names:
            ET.SubElement(
                connections, "ssd:Connection",
                startElement=wire.start, startConnector=signal, endElement=wire.end, endConnector=signal,
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


def _add_part(parent: ET.Element, part: Part, variables: Sequence[Variable]) -> None:
    element = ET.SubElement(
        parent, "ssd:Component",
        name=part.name, type="application/x-fmu-sharedlibrary", source=part.source, implementation="CoSimulation",
        description=part.component.description,
    )  # fmt: skip
    connectors = ET.SubElement(element, "ssd:Connectors")
    for v in variables:
        kind = "input" if v.role == "input" else "output"
        connector = ET.SubElement(connectors, "ssd:Connector", name=v.name, kind=kind, description=v.description)
        ET.SubElement(connector, "ssc:Real", {"unit": v.quantity.unit} if v.quantity.unit else {})
    bindings = ET.SubElement(element, "ssd:ParameterBindings")
    ET.SubElement(bindings, "ssd:ParameterBinding", type="application/x-ssp-parameter-set", source=part.parameters)
