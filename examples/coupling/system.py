"""A vehicle on a tether in a current: two FMUs of pythonfmu beside a coupled plant, in one file (SSP 1.0).

    python examples/coupling/system.py      writes hanging.ssp and flies it in FMPy

ODIN, 20 N too heavy, sinks from the surface until its tether is taut, and then hangs in the current. Any master of
SSP runs the file; pythonfmu's FMUs need a Python where they run.
"""

import tempfile
from pathlib import Path
from xml.etree import ElementTree as ET

from fmpy.ssp.simulation import simulate_ssp
from pythonfmu.builder import FmuBuilder

from plant_fmu import load_vehicle
from plant_fmu.archive import write_archive
from plant_fmu.build import cached_fmu
from plant_fmu.vehicle_component import make_vehicle_component

START = {"weight": 1248.25}  # N, of a buoyancy of 1228.25 N
POSE = {f"position.{axis}": f"position_{axis}" for axis in "xyz"} | {f"quaternion.e{i}": f"e{i}" for i in range(4)}
# connections: from an output to an input
CONNECTIONS = {
    ("plant", "current"): {"position.z": "depth"},
    ("plant", "tether"): POSE | {f"velocity.{name}": name for name in "uvwpqr"},
    ("current", "plant"): {f"velocity_{axis}": f"current_input.{axis}" for axis in "xy"}
    | {f"rate_{axis}": f"current_input_rate.{axis}" for axis in "xy"},
    ("tether", "plant"): {f"force_{axis}": f"external.world.force.{axis}" for axis in "xyz"}
    | {f"acts_{axis}": f"external.world.point.{axis}" for axis in "xyz"},
}
OSP = "http://opensimulationplatform.com/SSP/OSPAnnotations"


def structure(stop_time: float, step: float) -> bytes:
    """Return SystemStructure.ssd; libcosim reads the step from its annotation."""
    root = ET.Element(
        "ssd:SystemStructureDescription",
        {"xmlns:ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription", "xmlns:osp": OSP}
        | {"xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon", "version": "1.0", "name": "hanging"},
    )
    system = ET.SubElement(root, "ssd:System", name="root")
    elements, connections = ET.SubElement(system, "ssd:Elements"), ET.Element("ssd:Connections")
    for part in ("plant", "current", "tether"):
        component = ET.SubElement(
            elements, "ssd:Component", name=part, type="application/x-fmu-sharedlibrary", source=f"resources/{part}.fmu"
        )
        connectors = ET.SubElement(component, "ssd:Connectors")
        outputs = {one: "output" for (start, _), names in CONNECTIONS.items() if start == part for one in names}
        inputs = {one: "input" for (_, end), names in CONNECTIONS.items() if end == part for one in names.values()}
        for name, kind in (outputs | inputs).items():
            ET.SubElement(ET.SubElement(connectors, "ssd:Connector", name=name, kind=kind), "ssc:Real")
    for (start, end), names in CONNECTIONS.items():
        for one, other in names.items():
            ET.SubElement(
                connections, "ssd:Connection",
                startElement=start, startConnector=one, endElement=end, endConnector=other,
            )  # fmt: skip
    system.append(connections)
    experiment = ET.SubElement(root, "ssd:DefaultExperiment", startTime="0.0", stopTime=repr(stop_time))
    annotations = ET.SubElement(experiment, "ssd:Annotations")
    annotation = ET.SubElement(annotations, "ssc:Annotation", type="com.opensimulationplatform")
    ET.SubElement(ET.SubElement(annotation, "osp:Algorithm"), "osp:FixedStepAlgorithm", baseStepSize=repr(step))
    return ET.tostring(root, encoding="utf-8", xml_declaration=True)


def write_system(out: Path, stop_time: float, step: float) -> Path:
    """Write the three FMUs and their connections."""
    plant = make_vehicle_component(load_vehicle("odin"), START, coupled=True)
    members = {"SystemStructure.ssd": structure(stop_time, step)}
    members["resources/plant.fmu"] = cached_fmu(plant, 2).read_bytes()
    with tempfile.TemporaryDirectory() as folder:
        for part in ("current", "tether"):
            FmuBuilder.build_FMU(Path(__file__).with_name(f"{part}.py"), folder)
            members[f"resources/{part}.fmu"] = (Path(folder) / f"{part.capitalize()}.fmu").read_bytes()
    write_archive(out, members)
    return out


if __name__ == "__main__":
    result = simulate_ssp(str(write_system(Path("hanging.ssp"), 250.0, 0.02)), stop_time=249.99, step_size=0.02)
    north, east, depth = (result[f"plant.position.{axis}"][-1] for axis in "xyz")
    pull = sum(result[f"tether.force_{axis}"][-1] ** 2 for axis in "xyz") ** 0.5
    print(f"hangs {north:.3f} m north and {east:.3f} m east of the anchor, {depth:.3f} m deep, pulled by {pull:.2f} N")
