"""A scenario's plant with the FMUs beside it as a system of other masters (SSP 1.0), connected as the scenario says."""

from xml.etree import ElementTree as ET

from plant_fmu.archive import write_archive
from plant_fmu.build import cached_fmu
from plant_fmu.vehicle_component import make_vehicle_component

OSP = "http://opensimulationplatform.com/SSP/OSPAnnotations"


def write_coupled_system(scenario, out):
    """Write plant and components; the law is left out: no force acts."""
    plant = make_vehicle_component(scenario.vehicle, {"weight": scenario.plant.parameters["weight"]}, coupled=True)
    members = {f"resources/{fmu.name}.fmu": fmu.file.read_bytes() for fmu in scenario.components}
    members["resources/plant.fmu"] = cached_fmu(plant, 2).read_bytes()
    members["SystemStructure.ssd"] = _structure(scenario, connections(scenario))
    write_archive(out, members)
    return out


def connections(scenario):
    """Return start, its output, end and its input of each connection."""
    to_plant = [(fmu.name, start, "plant", end) for fmu in scenario.components for start, end in fmu.outputs.items()]
    return to_plant + [
        ("plant", start, fmu.name, end) for fmu in scenario.components for end, start in fmu.inputs.items()
    ]


def _structure(scenario, lines):
    """Return SystemStructure.ssd; libcosim reads the step from its annotation."""
    root = ET.Element(
        "ssd:SystemStructureDescription",
        {"xmlns:ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription", "xmlns:osp": OSP}
        | {"xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon", "version": "1.0", "name": "coupled"},
    )
    system = ET.SubElement(root, "ssd:System", name="root")
    elements, wires = ET.SubElement(system, "ssd:Elements"), ET.SubElement(system, "ssd:Connections")
    for part in ("plant", *(fmu.name for fmu in scenario.components)):
        component = ET.SubElement(
            elements, "ssd:Component", name=part, type="application/x-fmu-sharedlibrary", source=f"resources/{part}.fmu"
        )
        connectors = ET.SubElement(component, "ssd:Connectors")
        kinds = {output: "output" for start, output, _, _ in lines if start == part}
        kinds |= {name: "input" for _, _, end, name in lines if end == part}
        for name, kind in kinds.items():
            ET.SubElement(ET.SubElement(connectors, "ssd:Connector", name=name, kind=kind), "ssc:Real")
    for line in lines:
        names = ("startElement", "startConnector", "endElement", "endConnector")
        ET.SubElement(wires, "ssd:Connection", dict(zip(names, line, strict=True)))
    experiment = ET.SubElement(root, "ssd:DefaultExperiment", startTime="0.0", stopTime=repr(scenario.time.duration))
    annotations = ET.SubElement(experiment, "ssd:Annotations")
    annotation = ET.SubElement(annotations, "ssc:Annotation", type="com.opensimulationplatform")
    algorithm = ET.SubElement(ET.SubElement(annotation, "osp:Algorithm"), "osp:FixedStepAlgorithm")
    algorithm.set("baseStepSize", repr(scenario.time.step))
    return ET.tostring(root, encoding="utf-8", xml_declaration=True)
