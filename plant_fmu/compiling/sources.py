"""The C sources of FMUs: the plant's, the common wrappers', and the generated ones."""

from __future__ import annotations

import re
from collections.abc import Iterable
from importlib import resources
from xml.etree import ElementTree as ET

from plant_fmu.component import Component
from plant_fmu.markup import xml_text
from plant_fmu.t200 import t200_header

# a function is named after its file, at the beginning of a line; data are declared extern
_DECLARED = re.compile(
    r"^(?!static|typedef)(?:\w[\w ]*[ *]+)([a-z]\w*)\(|^extern [^;\[]*?(\w+)(?:\[\])?;", re.MULTILINE
)

_OTHER_WRAPPER = {2: "fmi3", 3: "fmi2"}


def plant_sources() -> dict[str, bytes]:
    """Return the C files of the plant, without the wrappers and the generated ``vehicle.h``."""
    return _files("csrc") | {"t200.h": t200_header().encode()}


def c_sources(component: Component, fmi: int) -> dict[str, bytes]:
    """Return the C files of a component's FMU, without the generated header and those of FMI."""
    other = _OTHER_WRAPPER[fmi]
    wrapper = {name: code for name, code in _files("csrc/wrapper").items() if not name.startswith(other)}
    return dict(sorted({**wrapper, **component.sources}.items()))


def all_sources(component: Component, fmi: int, token: str) -> dict[str, bytes]:
    """Return the C files of a component's FMU and the header that is generated from its variables."""
    return c_sources(component, fmi) | {component.header: header(component, token).encode()}


def _files(folder: str) -> dict[str, bytes]:
    """Return the C files and headers of a folder of this package, by name."""
    root = resources.files("plant_fmu").joinpath(*folder.split("/"))
    return {file.name: file.read_bytes() for file in root.iterdir() if file.name.endswith((".c", ".h"))}


def _external_names(headers: Iterable[bytes]) -> list[str]:
    """Return the names of functions and data that C files share, which the linker resolves, in alphabetical order."""
    texts = (header.decode() for header in headers)
    return sorted({name for text in texts for groups in _DECLARED.findall(text) for name in groups if name})


def compiled_files(component: Component, fmi: int) -> list[str]:
    """Return the names of the C files that a compiler is given, without headers."""
    return [name for name in c_sources(component, fmi) if name.endswith(".c")]


def header(component: Component, token: str) -> str:
    """Return the generated header, which holds the table of variables for the C code."""
    rows, name, guard = component.variables, component.name, component.header.upper().replace(".", "_")
    files = _files("csrc/wrapper") | dict(component.sources)
    shared = _external_names(data for file, data in files.items() if file.endswith(".h"))
    roles = ("state", "derivative", "input")
    first = {f"FIRST_{role.upper()}": next((i for i, v in enumerate(rows) if v.role == role), 0) for role in roles}
    clocks = [i for i, v in enumerate(rows) if v.type == "clock"]
    constants = {
        **component.constants, **first, "FIRST_CLOCK": min(clocks, default=0), "N_CLOCK_VARIABLES": len(clocks),
        "N_ARRAYS": sum(v.size > 1 for v in rows),
    }  # fmt: skip
    lines = [
        f"/* {name}: generated from the table of variables. */",
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        f'#define INSTANTIATION_TOKEN "{token}"',
        "",
        "/* Names of this component's own, so that several link into one program; a shared library overrides those",
        " * of FMI, which importers look up as they stand in the standard. */",
        f"#define FMI2_FUNCTION_PREFIX {name}_",
        f"#define FMI3_FUNCTION_PREFIX {name}_",
        *(f"#define {shared_name} {name}_{shared_name}" for shared_name in shared),
        "",
        f"enum {{ {', '.join(f'{key} = {value}' for key, value in constants.items())} }};",
        "",
        "#define COMPONENT_VARIABLES \\",
    ]
    for v in rows:
        role = "OUTPUT" if v.role == "derivative" else v.role.upper()
        numbers = (v.start, v.quantity.minimum, v.quantity.maximum, v.nominal)
        values = ", ".join(repr(float(x)) for x in numbers)
        lines.append(f'    {{"{v.name}", TYPE_{v.type.upper()}, {role}, {v.size}, AT({v.member}), {values}}}, \\')
    lines[-1] = lines[-1].removesuffix(" \\")
    return "\n".join([*lines, "", "#endif", ""])


def build_description(component: Component) -> str:
    """Return FMI 3.0's ``sources/buildDescription.xml``."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    for platform in (None, "x86-windows", "x86_64-windows", "aarch64-windows"):
        configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=component.name)
        files = ET.SubElement(configuration, "SourceFileSet", language="C99")
        for name in compiled_files(component, 3):
            ET.SubElement(files, "SourceFile", name=name)
        ET.SubElement(
            files, "PreprocessorDefinition", name="FMI3_OVERRIDE_FUNCTION_PREFIX", value="", optional="true",
            description="FMI's functions by their plain names, for a shared library",
        )  # fmt: skip
        if platform:
            configuration.set("platform", platform)
        else:
            ET.SubElement(configuration, "Library", name="m", external="true", description="C's mathematics")
    return xml_text(root)
