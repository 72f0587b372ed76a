"""The variables of a model description, of FMI 2.0 or 3.0."""

# FMPy reads them too, but refuses what other tools take, such as a parameter without variability in FMI 2.0.

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from xml.etree import ElementTree as ET

_FMI2_TYPES = ("Real", "Integer", "Boolean", "String", "Enumeration")


@dataclass(frozen=True)
class ModelVariable:
    """A variable, as the model description gives it; "" for what is not given."""

    name: str
    reference: int
    type: str  # FMI's, such as "Real" or "Float64"
    causality: str
    variability: str
    initial: str
    start: str
    unit: str
    minimum: str
    maximum: str
    description: str
    shape: tuple[int, ...]  # () of a scalar

    @property
    def is_real(self) -> bool:
        """True if it is a double precision scalar."""
        return self.type in ("Real", "Float64") and not self.shape


@functools.lru_cache(maxsize=16)
def model_variables(root: ET.Element) -> dict[str, ModelVariable]:
    """Return the variables of a model description by name, with aliases of FMI 3.0, in their order."""
    fmi, aliases = int(root.get("fmiVersion", "")[0]), []
    types = {e.get("name"): next(iter(e), e) if fmi == 2 else e for e in root.iterfind("TypeDefinitions/*")}
    starts = {e.get("valueReference", ""): e.get("start", "1") for e in root.iterfind("ModelVariables/*")}
    variables: dict[str, ModelVariable] = {}
    for element in root.iterfind("ModelVariables/*"):
        value = element if fmi == 3 else next((e for e in element if e.tag in _FMI2_TYPES), None)
        if value is None:
            continue
        declared = types.get(value.get("declaredType"))
        variable = _variable(element, value, declared if declared is not None else value, fmi, starts)
        variables[variable.name] = variable
        aliases += [replace(variable, name=e.get("name", "")) for e in element.iterfind("Alias")]
    return variables | {alias.name: alias for alias in aliases}


def _variable(
    element: ET.Element, value: ET.Element, declared: ET.Element, fmi: int, starts: dict[str, str]
) -> ModelVariable:
    def text(key: str) -> str:
        return value.get(key, "") or declared.get(key, "")

    causality = element.get("causality", "local")
    is_parameter = causality in ("parameter", "calculatedParameter", "structuralParameter")
    is_continuous = fmi == 2 or value.tag in ("Float32", "Float64")
    variability = element.get("variability") or (
        "fixed" if is_parameter else "continuous" if is_continuous else "discrete"
    )
    is_exact = variability == "constant" or causality in ("input", "parameter", "structuralParameter")
    start = element.find("Start")
    return ModelVariable(
        name=element.get("name", ""),
        reference=int(element.get("valueReference", "")),
        type=value.tag,
        causality=causality,
        variability=variability,
        initial=element.get("initial") or ("exact" if is_exact else "calculated"),
        start=value.get("start", "") if start is None else start.get("value", ""),
        unit=text("unit"),
        minimum=text("min"),
        maximum=text("max"),
        description=element.get("description", ""),
        shape=tuple(_lengths(element, starts)),
    )


def _lengths(element: ET.Element, starts: dict[str, str]) -> Iterator[int]:
    for dimension in element.iterfind("Dimension"):
        yield int(dimension.get("start") or starts.get(dimension.get("valueReference", "")) or 1)


def unit_definitions(root: ET.Element) -> dict[str, dict[str, str]]:
    """Return the attributes of ``BaseUnit`` of each unit of a model description; none of a unit without."""
    units = root.iterfind("UnitDefinitions/Unit")
    return {unit.get("name", ""): dict(base.attrib) for unit in units if (base := unit.find("BaseUnit")) is not None}
