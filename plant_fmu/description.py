"""Generate files from the table of variables: modelDescription.xml (FMI 2.0 and 3.0), the docs page."""

from __future__ import annotations

import hashlib
from importlib import metadata
from xml.etree import ElementTree as ET

from plant_fmu.compiling.sources import c_sources, compiled_files, header
from plant_fmu.component import Component
from plant_fmu.markup import xml_text
from plant_fmu.quantities import DISPLAY_UNITS, QUANTITIES, UNITS, base_unit
from plant_fmu.variables import Variable, described, variables
from plant_fmu.vehicle import Vehicle

DEFAULT_TOLERANCE = 1e-6  # relative tolerance of the default experiment

_CAUSALITY = {"time": "independent", "state": "output", "input": "input", "output": "output", "derivative": "local",
              "parameter": "parameter"}  # fmt: skip
_INITIAL = {"state": "exact", "output": "calculated", "derivative": "calculated", "parameter": "exact"}
_ELEMENT = {  # XML element of a variable, by FMI version and type
    2: {"real": "Real", "integer": "Integer", "boolean": "Boolean"},
    3: {"real": "Float64", "integer": "Int32", "boolean": "Boolean", "clock": "Clock"},
}
_CAPABILITIES = {  # by FMI version; derivatives are those of a component with states
    2: ("canGetAndSetFMUstate", "canSerializeFMUstate", "providesDirectionalDerivative",
        "canNotUseMemoryManagementFunctions"),
    3: ("canGetAndSetFMUState", "canSerializeFMUState", "providesDirectionalDerivatives", "providesAdjointDerivatives"),
}  # fmt: skip
_LOG_CATEGORIES = {
    "logEvents": "Initialization, and samples in model exchange",
    "logStatusWarning": "Values that were mended, steps that do not fit; logged until switched off",
    "logStatusDiscard": "States that an integrator tried and that lie outside the plant's domain",
    "logStatusError": "Refused values and calls; logged until switched off",
    "logAll": "All of these",
}


def _number(value: float) -> str:
    """Write a float so that it reads back to the same bits."""
    return repr(float(value))


def token(component: Component, fmi: int) -> str:
    """Return the token that ties a description to the binary made with it."""
    text = model_description(component, fmi, "") + header(component, "")
    digest = hashlib.sha256(text.encode() + b"".join(c_sources(component, fmi).values())).hexdigest()
    return "{" + "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])) + "}"


def model_description(component: Component, fmi: int, token: str) -> str:
    """Return ``modelDescription.xml``."""
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{fmi}.0",
            "modelName": component.name,
            "guid" if fmi == 2 else "instantiationToken": token,
            "description": component.description,
            "author": "subreach authors",
            "version": metadata.version("subreach"),
            "copyright": "subreach authors",
            "license": "BSD-3-Clause",
            "generationTool": f"subreach {metadata.version('subreach')}",
            "variableNamingConvention": "structured",
        },
    )
    if fmi == 2:
        root.set("numberOfEventIndicators", "0")
    for interface in ("ModelExchange", "CoSimulation") if component.has_model_exchange else ("CoSimulation",):
        offers = [c for c in _CAPABILITIES[fmi] if component.has_states or not c.startswith("provides")]
        element = ET.SubElement(root, interface, dict.fromkeys(offers, "true"), modelIdentifier=component.name)
        if interface == "CoSimulation":
            element.set("canHandleVariableCommunicationStepSize", "true")
            if component.has_clocks:
                element.set("hasEventMode", "true")
        elif fmi == 2:
            element.set("completedIntegratorStepNotNeeded", "true")
        if fmi == 2:  # FMI 3.0 lists them in sources/buildDescription.xml
            files = ET.SubElement(element, "SourceFiles")
            for name in compiled_files(component, fmi):
                ET.SubElement(files, "File", name=name)

    # FMI 2.0 needs no variable for the time, and some importers fail on one
    rows = [(vr, v) for vr, v in described(component.variables) if fmi == 3 or v.role != "time"]
    units = ET.SubElement(root, "UnitDefinitions")
    used = {v.quantity.unit for _, v in rows}
    for name in (name for name in UNITS if name in used):
        unit = ET.SubElement(units, "Unit", name=name)
        ET.SubElement(unit, "BaseUnit", base_unit(name))
        for display, factor in DISPLAY_UNITS.get(name, {}).items():
            ET.SubElement(unit, "DisplayUnit", name=display, factor=_number(factor))

    _add_types(root, sorted({_type_of(v) for _, v in rows} - {""}), fmi)
    log = ET.SubElement(root, "LogCategories")
    for category, what in _LOG_CATEGORIES.items():
        ET.SubElement(log, "Category", name=category, description=what)
    ET.SubElement(
        root, "DefaultExperiment",
        startTime="0.0", stopTime=_number(component.stop_time), tolerance=_number(DEFAULT_TOLERANCE),
        stepSize=_number(component.step),
    )  # fmt: skip

    # FMI 2.0 names variables by their position in the list, FMI 3.0 by value reference
    number = {v.name: str(i + 1 if fmi == 2 else vr) for i, (vr, v) in enumerate(rows)}
    number |= {v.name: number[v.array] for v in component.variables if v.array in number}
    model_variables = ET.SubElement(root, "ModelVariables")
    for vr, v in rows:
        _add_variable(model_variables, vr, v, fmi, number)
    _add_structure(ET.SubElement(root, "ModelStructure"), [v for _, v in rows], fmi, number)

    return xml_text(root)


def _type_of(v: Variable) -> str:
    """Return the name of a variable's type, "" for none; a gain's unit does not say what it is."""
    return QUANTITIES.get(v.quantity.unit, "") if v.type == "real" and not v.quantity.is_gain else ""


def _add_types(root: ET.Element, names: list[str], fmi: int) -> None:
    if not names:
        return
    units = {name: unit for unit, name in QUANTITIES.items()}
    types = ET.SubElement(root, "TypeDefinitions")
    for name in names:
        kind = {"quantity": name, "unit": units[name]}
        if fmi == 2:
            ET.SubElement(ET.SubElement(types, "SimpleType", name=name), "Real", kind)
        else:
            ET.SubElement(types, "Float64Type", kind, name=name)


def _add_variable(parent: ET.Element, vr: int, v: Variable, fmi: int, number: dict[str, str]) -> None:
    real, parameter = v.type == "real", v.role == "parameter"
    is_clocked = v.clock in number
    common = {
        "name": v.name,
        "valueReference": str(vr),
        "causality": "local" if v.local else _CAUSALITY[v.role],
        "variability": "tunable" if parameter else "continuous" if real and not is_clocked else "discrete",
        "description": v.description,
    }
    if is_clocked:
        common["clocks"] = number[v.clock]
    if v.type == "clock":
        ET.SubElement(parent, "Clock", common, intervalVariability="triggered")
        return
    if v.role in _INITIAL:
        common["initial"] = _INITIAL[v.role]
    kind = {"declaredType": _type_of(v)} if _type_of(v) else {}
    if v.quantity.unit:
        kind["unit"] = v.quantity.unit
    if v.quantity.display_unit:
        kind["displayUnit"] = v.quantity.display_unit
    if v.quantity.bounded and v.type != "boolean":
        kind |= {"min": v.text(v.quantity.minimum), "max": v.text(v.quantity.maximum)}
    if real and v.role != "time":
        kind["nominal"] = _number(v.nominal)
    if v.role in ("state", "input", "parameter"):
        kind["start"] = " ".join(map(v.text, v.starts or (v.start,)))
    if v.role == "state" and v.local:
        kind["reinit"] = "true"  # at events, where they have no lag
    if v.role == "derivative":
        kind["derivative"] = number[v.name.removeprefix("der(").removesuffix(")")]

    element = _ELEMENT[fmi][v.type]
    if fmi == 2:
        ET.SubElement(ET.SubElement(parent, "ScalarVariable", common), element, kind)
    else:
        variable = ET.SubElement(parent, element, common | kind)
        for length in v.shape:
            ET.SubElement(variable, "Dimension", start=str(length))


def _add_structure(parent: ET.Element, rows: list[Variable], fmi: int, number: dict[str, str]) -> None:
    """Add outputs and derivatives with their direct dependencies, and the unknowns of initialization."""
    continuous = {number[v.name] for v in rows if v.role in ("time", "state", "input")}
    starting = [v for v in rows if v.role in ("output", "derivative") and v.clock not in number]
    sections = (
        ("Outputs", "Output", [v for v in rows if v.role in ("state", "output") and not v.local], True),
        ("Derivatives", "ContinuousStateDerivative", [v for v in rows if v.role == "derivative"], True),
        ("InitialUnknowns", "InitialUnknown", starting, False),
    )
    for section, tag, unknowns, instant in sections:
        if not unknowns:
            continue
        section_element = ET.SubElement(parent, section) if fmi == 2 else parent
        for v in unknowns:
            depends = (v.name,) if v.role == "state" else v.depends
            knowns = {number[name] for name in depends if name in number}
            attribute = "index" if fmi == 2 else "valueReference"
            references = " ".join(sorted(knowns & continuous if instant else knowns, key=int))
            ET.SubElement(
                section_element, "Unknown" if fmi == 2 else tag, {attribute: number[v.name], "dependencies": references}
            )


def documentation(vehicle: Vehicle) -> str:
    """Return the docs page of the variables, as Markdown."""
    rows = variables(vehicle)
    uncoupled = {v.name for v in rows}
    titles = {
        "input": "Inputs",
        "state": "States (outputs; start values may be set before initialization ends)",
        "output": "Outputs",
        "derivative": "Derivatives of the states",
        "parameter": "Parameters (tunable)",
    }
    lines = [f"# Variables of the `{vehicle.name}` FMU", "", vehicle.title + ".", "", vehicle.source]
    tables = [(title, [v for v in rows if v.role == role]) for role, title in titles.items()]
    coupled_only = [v for v in variables(vehicle, coupled=True) if v.name not in uncoupled]
    tables.append(("Further inputs and parameters of a coupled plant", coupled_only))
    for title, section_rows in tables:
        lines += [
            "",
            f"## {title}",
            "",
            "| name | unit | start | min | max | description |",
            "|---|---|---|---|---|---|",
        ]
        for v in section_rows:
            q = v.quantity
            start = f"{v.start:g}" if v.type == "real" else v.text(v.start)
            if v.role in ("output", "derivative"):
                start = ""
            minimum, maximum = (f"{q.minimum:g}", f"{q.maximum:g}") if q.bounded and v.type != "boolean" else ("", "")
            lines.append(f"| `{v.name}` | {q.unit} | {start} | {minimum} | {maximum} | {v.description} |")
    return "\n".join([*lines, ""])
