"""The layered standard FMI-LS-REF 1.0.0-beta.1 in an FMU: parameter sets and reference results, with a manifest."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from xml.etree import ElementTree as ET

import numpy as np

from plant_fmu.contents.parameter_set import parameter_set, ssv
from plant_fmu.contents.reference import COLUMNS, CURRENT, START, Reference
from plant_fmu.markup import xml_text
from plant_fmu.variables import Variable, variables
from plant_fmu.vehicle import Vehicle, load_vehicle, shipped_vehicles

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"

_MANIFEST = {
    "xmlns:fmi-ls": "http://fmi-standard.org/fmi-ls-manifest",
    "fmi-ls:fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
    # whose labels are used; its own text still names the previous release, which lacked them
    "fmi-ls:fmi-ls-version": "1.0.0-beta.1",
    # the schema of the layered standard fixes this sentence
    "fmi-ls:fmi-ls-description": "Layered Standard providing information on related files included in an FMU.",
}
_LABEL = {"name": "manoeuvre:reference", "description": "Start, inputs and results of one maneuver"}
_SSV = "application/x-ssp-parameter-set"
_START = "Start of the reference maneuver, and its current"
_DIGITS = 11  # significant: more than the plant's own integration holds


def layered_files(vehicle: Vehicle, rows: Sequence[Variable] | None = None) -> dict[str, str]:
    """Return the files of ``extra/org.fmi-standard.fmi-ls-ref``, by name."""
    name = vehicle.name
    related = [(f"{name}.ssv", _SSV, "parameter", f"Parameters of {vehicle.title}")]
    files = {f"{name}.ssv": ssv(vehicle, rows)}
    if rows is None and _is_shipped(vehicle):
        # computed once and kept: the last digits of an integration depend on the machine, those of an FMU must not
        folder = resources.files("plant_fmu.contents") / "references"
        results = [
            (f"{name}_start.ssv", _SSV, "parameter", _START),
            (f"{name}_in.csv", "text/csv", "testcase", "Inputs of the reference maneuver, held until they jump"),
            (f"{name}_out.csv", "text/csv", "result", "Its results, from an integration independent of this FMU"),
        ]
        files |= {source: (folder / source).read_text(encoding="utf-8") for source, *_ in results}
        related += results

    root = ET.Element("fmiReferences", _MANIFEST)
    for source, kind, role, description in related:
        element = ET.SubElement(root, "Related", type=kind, source=source, role=role, description=description)
        if source != f"{name}.ssv":
            ET.SubElement(element, "Label", _LABEL)
    return {"fmi-ls-manifest.xml": xml_text(root), **files}


def reference_files(vehicle: Vehicle, results: Reference) -> dict[str, str]:
    """Return reference results as files, by name."""
    values = {**START, **CURRENT}
    start = [(v, values[v.name]) for v in variables(vehicle) if v.name in values]

    def csv(header: tuple[str, ...], rows: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> str:
        lines = [",".join(f"{x:.{_DIGITS}g}" for x in row + 0.0) for row in rows]
        return "\n".join([",".join(header), *lines, ""])

    return {
        f"{vehicle.name}_start.ssv": parameter_set(f"{vehicle.name}_start", _START, start),
        f"{vehicle.name}_in.csv": csv(("time", *results.input_names), results.inputs),
        f"{vehicle.name}_out.csv": csv(COLUMNS, results.results),
    }


def _is_shipped(vehicle: Vehicle) -> bool:
    """Return True for a vehicle of the package with all its numbers, not one with the same name alone."""
    if vehicle.name not in shipped_vehicles():
        return False
    shipped = load_vehicle(vehicle.name)
    numbers = {key: value for key, value in vars(vehicle).items() if key != "autopilot"}
    return all(np.array_equal(value, vars(shipped)[key]) for key, value in numbers.items())
