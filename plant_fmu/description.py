"""Files made from the table of variables: modelDescription.xml (FMI 2.0 and 3.0), the C header, the docs page."""

from __future__ import annotations

import hashlib
import math
from importlib import metadata
from xml.etree import ElementTree as ET

from plant_fmu.variables import UNITS, Variable, variables
from plant_fmu.vehicle import Vehicle

DEFAULT_STOP_TIME = 10.0  # s
DEFAULT_STEP = 0.01  # s

_CAUSALITY = {"time": "independent", "state": "output", "input": "input", "output": "output", "parameter": "parameter",
              "flag": "output"}  # fmt: skip
_VARIABILITY = {"parameter": "tunable", "flag": "discrete"}
_INITIAL = {"state": "exact", "output": "calculated", "flag": "calculated", "parameter": "exact"}


def _number(value: float) -> str:
    """Write a float so that it reads back to the same bits."""
    return repr(float(value))


def header(vehicle: Vehicle, token: str) -> str:
    """Return ``vehicle.h``, which holds all that the C code knows of one vehicle.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    token : str
        The FMU's guid (FMI 2.0) or instantiation token (FMI 3.0).

    Returns
    -------
    str
        C99 text.
    """
    lines = [
        f"/* {vehicle.name}: generated from plant_fmu's table of variables. */",
        "#ifndef VEHICLE_H",
        "#define VEHICLE_H",
        "",
        f'#define INSTANTIATION_TOKEN "{token}"',
        "",
        f"enum {{ N_THRUSTERS = {vehicle.n_thrusters} }};",
        "",
    ]
    rows = variables(vehicle)
    for macro, flags in (("VEHICLE_REALS", False), ("VEHICLE_FLAGS", True)):
        lines.append(f"#define {macro} \\")
        for v in rows:
            if (v.role == "flag") == flags:
                role = "OUTPUT" if flags else v.role.upper()
                numbers = ", ".join(_number(x) for x in (v.start, v.quantity.minimum, v.quantity.maximum))
                lines.append(f'    {{"{v.name}", {role}, AT({v.member}), {numbers}}}, \\')
        lines[-1] = lines[-1].removesuffix(" \\")
        lines.append("")
    return "\n".join([*lines, "#endif", ""])


def token(vehicle: Vehicle, fmi: int, sources: bytes) -> str:
    """Return the token that ties a description to the binary made with it.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    fmi : int
        2 or 3.
    sources : bytes
        The C sources.

    Returns
    -------
    str
        Changes whenever the description or the sources do.
    """
    text = model_description(vehicle, fmi, "") + header(vehicle, "")
    digest = hashlib.sha256(text.encode() + sources).hexdigest()
    return "{" + "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])) + "}"


def model_description(vehicle: Vehicle, fmi: int, token: str) -> str:
    """Return ``modelDescription.xml``.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.
    fmi : int
        2 for FMI 2.0, 3 for FMI 3.0.
    token : str
        The FMU's guid or instantiation token.

    Returns
    -------
    str
        XML text.
    """
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{fmi}.0",
            "modelName": vehicle.name,
            "guid" if fmi == 2 else "instantiationToken": token,
            "description": f"Underwater vehicle, six degrees of freedom: {vehicle.title}",
            "author": "subreach authors",
            "version": metadata.version("subreach"),
            "copyright": "subreach authors",
            "license": "BSD-3-Clause",
            "generationTool": f"subreach {metadata.version('subreach')}",
            "variableNamingConvention": "structured",
        },
    )
    interface = ET.SubElement(root, "CoSimulation", modelIdentifier=vehicle.name)
    interface.set("canHandleVariableCommunicationStepSize", "true")
    if fmi == 2:
        interface.set("canNotUseMemoryManagementFunctions", "true")

    units = ET.SubElement(root, "UnitDefinitions")
    for name, exponents in UNITS.items():
        unit = ET.SubElement(units, "Unit", name=name)
        ET.SubElement(unit, "BaseUnit", {key: str(power) for key, power in exponents.items()})
        if name == "rad":
            ET.SubElement(unit, "DisplayUnit", name="deg", factor=_number(math.degrees(1.0)))

    log = ET.SubElement(root, "LogCategories")
    ET.SubElement(log, "Category", name="logStatusError", description="Refused values and calls; always logged")
    ET.SubElement(
        root, "DefaultExperiment",
        startTime="0.0", stopTime=_number(DEFAULT_STOP_TIME), stepSize=_number(DEFAULT_STEP),
    )  # fmt: skip

    # FMI 2.0 needs no variable for the time, and some importers stumble over one
    rows = [(vr, v) for vr, v in enumerate(variables(vehicle)) if fmi == 3 or v.role != "time"]
    model_variables = ET.SubElement(root, "ModelVariables")
    for vr, v in rows:
        _add_variable(model_variables, vr, v, fmi)
    _add_structure(ET.SubElement(root, "ModelStructure"), rows, fmi)

    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _add_variable(parent: ET.Element, vr: int, v: Variable, fmi: int) -> None:
    common = {
        "name": v.name,
        "valueReference": str(vr),
        "causality": _CAUSALITY[v.role],
        "variability": _VARIABILITY.get(v.role, "continuous"),
        "description": v.description,
    }
    if v.role in _INITIAL:
        common["initial"] = _INITIAL[v.role]
    kind: dict[str, str] = {}
    if v.quantity.unit:
        kind["unit"] = v.quantity.unit
    if v.quantity.unit == "rad":
        kind["displayUnit"] = "deg"
    if v.role not in ("time", "flag"):
        kind |= {"min": _number(v.quantity.minimum), "max": _number(v.quantity.maximum), "nominal": _number(v.nominal)}
    if v.role in ("state", "input", "parameter"):
        kind["start"] = _number(v.start)

    if fmi == 2:
        element = ET.SubElement(parent, "ScalarVariable", common)
        ET.SubElement(element, "Boolean" if v.role == "flag" else "Real", kind)
    else:
        ET.SubElement(parent, "Boolean" if v.role == "flag" else "Float64", common | kind)


def _add_structure(parent: ET.Element, rows: list[tuple[int, Variable]], fmi: int) -> None:
    """Add the outputs with what they follow from directly, and the unknowns of initialisation."""
    # FMI 2.0 names variables by their position in the list, FMI 3.0 by value reference
    number = {v.name: i + 1 if fmi == 2 else vr for i, (vr, v) in enumerate(rows)}
    inputs = {v.name for _, v in rows if v.role == "input"}

    def entry(parent: ET.Element, tag: str, v: Variable, knowns: tuple[str, ...]) -> None:
        references = " ".join(str(number[name]) for name in sorted(knowns, key=number.__getitem__))
        attribute = "index" if fmi == 2 else "valueReference"
        ET.SubElement(parent, tag, {attribute: str(number[v.name]), "dependencies": references})

    outputs = [v for _, v in rows if v.role in ("state", "output", "flag")]
    unknowns = [v for v in outputs if v.role != "state"]
    of_outputs = ET.SubElement(parent, "Outputs") if fmi == 2 else parent
    for v in outputs:
        entry(of_outputs, "Unknown" if fmi == 2 else "Output", v, tuple(d for d in v.depends if d in inputs))
    of_start = ET.SubElement(parent, "InitialUnknowns") if fmi == 2 else parent
    for v in unknowns:
        entry(of_start, "Unknown" if fmi == 2 else "InitialUnknown", v, v.depends)


def documentation(vehicle: Vehicle) -> str:
    """Return the docs page of the variables, as Markdown.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle.

    Returns
    -------
    str
        A table for each role.
    """
    titles = {
        "input": "Inputs",
        "state": "States (outputs; start values may be set before initialisation ends)",
        "output": "Outputs",
        "flag": "Boolean outputs",
        "parameter": "Parameters (tunable)",
    }
    lines = [f"# Variables of the `{vehicle.name}` FMU", "", vehicle.title + ".", "", vehicle.source]
    for role, title in titles.items():
        lines += [
            "",
            f"## {title}",
            "",
            "| name | unit | start | min | max | description |",
            "|---|---|---|---|---|---|",
        ]
        for v in variables(vehicle):
            if v.role == role:
                numbers = (
                    ["", "", ""]
                    if role == "flag"
                    else [f"{x:g}" for x in (v.start, v.quantity.minimum, v.quantity.maximum)]
                )
                if role == "output":
                    numbers[0] = ""
                lines.append(f"| `{v.name}` | {v.quantity.unit} | {' | '.join(numbers)} | {v.description} |")
    return "\n".join([*lines, ""])
