"""The C sources of the plant, and the list of them that goes into an FMU."""

from __future__ import annotations

import re
from importlib import resources
from xml.etree import ElementTree as ET

from plant_fmu.markup import xml_text

# a function is named after its file, at the beginning of a line; data are declared extern
_DECLARED = re.compile(
    r"^(?!static|typedef)(?:\w[\w ]*[ *]+)([a-z]\w*)\(|^extern [^;\[]*?(\w+)(?:\[\])?;", re.MULTILINE
)

_OTHER_WRAPPER = {2: "fmi3.c", 3: "fmi2.c"}


def c_sources(fmi: int) -> dict[str, bytes]:
    """Return the C files of one FMI version, without the generated ``vehicle.h`` and the headers of FMI.

    Parameters
    ----------
    fmi : int
        2 or 3.

    Returns
    -------
    dict of str to bytes
        Contents by name, in alphabetical order.
    """
    folder = resources.files("plant_fmu") / "csrc"
    files = sorted((file for file in folder.iterdir()), key=lambda file: file.name)
    return {
        file.name: file.read_bytes()
        for file in files
        if file.name.endswith((".c", ".h")) and file.name != _OTHER_WRAPPER[fmi]
    }


def external_names() -> list[str]:
    """Return the names that the C files share with each other, which the linker sees.

    Returns
    -------
    list of str
        Functions and data that the headers declare, in alphabetical order.
    """
    folder = resources.files("plant_fmu") / "csrc"
    headers = (file.read_text(encoding="utf-8") for file in folder.iterdir() if file.name.endswith(".h"))
    return sorted({name for text in headers for groups in _DECLARED.findall(text) for name in groups if name})


def compiled_files(fmi: int) -> list[str]:
    """Return the names of those C files that a compiler is given, the rest being headers.

    Parameters
    ----------
    fmi : int
        2 or 3.

    Returns
    -------
    list of str
        Names relative to the FMU's folder ``sources``.
    """
    return [name for name in c_sources(fmi) if name.endswith(".c")]


def build_description(model_identifier: str) -> str:
    """Return FMI 3.0's ``sources/buildDescription.xml``.

    Parameters
    ----------
    model_identifier : str
        As in ``modelDescription.xml``.

    Returns
    -------
    str
        XML text. One configuration is for any platform and links libm; those of Windows, which has none, do not.
    """
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    for platform in (None, "x86-windows", "x86_64-windows", "aarch64-windows"):
        configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=model_identifier)
        files = ET.SubElement(configuration, "SourceFileSet", language="C99")
        for name in compiled_files(3):
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
