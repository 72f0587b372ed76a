"""FMUs of others, for the tests: one in C that behaves well or badly, compiled for FMI 2.0 or 3.0."""

import re
from xml.etree import ElementTree as ET

from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from plant_fmu.archive import temporary_folder, write_archive
from plant_fmu.compiling.compiler import compile_library, find_compiler
from plant_fmu.compiling.libraries import FMI_HEADERS
from plant_fmu.compiling.platforms import native_platform
from tests.architecture.modules import ROOT

MODES = (
    "ok", "error", "fatal", "discard", "end", "hang", "nan", "null message", "short", "warned", "percent", "no input",
    "formats", "tether", "current", "puck",
)  # fmt: skip
PARAMETERS = {"mode": 0, "at": 1, "gain": 2}
INPUTS = {f"u{i}": 10 + i for i in range(8)}
OUTPUTS = {f"y{i}": 20 + i for i in range(8)}
STATE = {2: "canGetAndSetFMUstate", 3: "canGetAndSetFMUState"}


def build_foreign_fmu(
    path, fmi, inputs=INPUTS, outputs=OUTPUTS, units=(), array=False, parameters=PARAMETERS, **attributes
):
    """Write the FMU, with variables by name and value reference, and further attributes of CoSimulation; return it."""
    token = "{foreign}"
    root = ET.Element(
        "fmiModelDescription", fmiVersion=f"{fmi}.0", modelName="foreign", variableNamingConvention="flat"
    )
    root.set("guid" if fmi == 2 else "instantiationToken", token)
    interface = {"modelIdentifier": "foreign", "canHandleVariableCommunicationStepSize": "true"} | attributes
    ET.SubElement(root, "CoSimulation", {key: value for key, value in interface.items() if value})
    if units:
        definitions = ET.SubElement(root, "UnitDefinitions")
        for unit in sorted(set(dict(units).values())):
            ET.SubElement(definitions, "Unit", name=unit)
    listed = ET.SubElement(root, "ModelVariables")
    kinds = (("parameter", "tunable", parameters), ("input", "continuous", inputs), ("output", "continuous", outputs))
    for causality, variability, variables in kinds:
        for name, reference in variables.items():
            common = {
                "name": name,
                "valueReference": str(reference),
                "causality": causality,
                "variability": variability,
            }
            value = {} if causality == "output" else {"start": "1.0" if name == "gain" else "0.0"}
            value |= {"unit": dict(units)[name]} if name in dict(units) else {}
            if fmi == 2:
                ET.SubElement(ET.SubElement(listed, "ScalarVariable", common), "Real", value)
            else:
                ET.SubElement(listed, "Float64", common | value)
    if array:
        common = {"name": "A", "valueReference": "30", "causality": "parameter", "variability": "tunable"}
        matrix = ET.SubElement(listed, "Float64", common | {"start": "0 0 0 0"})
        for _ in range(2):
            ET.SubElement(matrix, "Dimension", start="2")
    structure = ET.SubElement(root, "ModelStructure")
    if fmi == 2:
        first = 1 + len(parameters) + len(inputs)
        section = ET.SubElement(structure, "Outputs")
        for i in range(len(outputs)):
            ET.SubElement(section, "Unknown", index=str(first + i))
    else:
        for reference in outputs.values():
            ET.SubElement(structure, "Output", valueReference=str(reference))
    platform = native_platform()
    library = path.with_suffix(platform.suffix)
    source = ROOT / "tests" / "foreign_fmu.c"
    with temporary_folder("foreign-") as scratch:
        compile_library(
            find_compiler(), platform, [source, _stubs(source, fmi, scratch)], [FMI_HEADERS], library,
            [f"-DFMI={fmi}", "-w"],
        )  # fmt: skip
    folder = platform.fmi2_names[0] if fmi == 2 else platform.name
    members = {
        "modelDescription.xml": ET.tostring(root),
        f"binaries/{folder}/foreign{platform.suffix}": library.read_bytes(),
    }
    library.unlink()
    write_archive(path, members)
    return path


def _stubs(source, fmi, folder):
    """Write the functions that FMPy looks for and the FMU lacks: all of them fail."""
    has = set(re.findall(rf"fmi{fmi}\w+|S\(\w+\)", source.read_text()))
    has |= {f"fmi{fmi}{name[2:-1]}" for name in has if name.startswith("S(")}
    names = [name for name in dir(FMU2Slave if fmi == 2 else FMU3Slave) if name.startswith(f"fmi{fmi}")]
    stubs = folder / "stubs.c"
    export = (
        "__declspec(dllexport)" if native_platform().system == "windows" else '__attribute__((visibility("default")))'
    )
    stubs.write_text("".join(f"{export} int {name}(void) {{ return 3; }}\n" for name in names if name not in has))
    return stubs
