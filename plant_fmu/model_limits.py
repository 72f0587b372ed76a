"""Limits of a model description, checked before an importer uses it."""

from __future__ import annotations

import math
import re
from pathlib import Path
from xml.etree import ElementTree as ET

from plant_fmu.errors import FmuFileError

MAX_REFERENCE = 2**32 - 1  # maximum value reference: 32 bits in FMI 2.0 and 3.0
MAX_NAME = 10_000  # maximum number of characters of a variable's name
MAX_INDICATORS = 1_000_000  # maximum number of event indicators, for which an importer allocates memory
MAX_ENTRIES = 100_000_000  # maximum number of entries of an array, for which an importer allocates memory

# part of the path of the library that is loaded
_IDENTIFIER = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+ -]{0,199}")
INTERFACES = ("CoSimulation", "ModelExchange", "ScheduledExecution")


def validate_description(path: Path, root: ET.Element) -> None:
    """Refuse a model description whose numbers or names could harm an importer."""
    version = root.get("fmiVersion", "")
    if root.tag != "fmiModelDescription" or not (version == "2.0" or version.startswith("3.0")):
        raise FmuFileError(f"{path}: FMI version is {_quote(version)}, expected 2.0 or 3.0")
    for interface in INTERFACES:
        for element in root.findall(interface):
            identifier = element.get("modelIdentifier", "")
            if not _IDENTIFIER.fullmatch(identifier):
                raise FmuFileError(
                    f"{path}: modelIdentifier of {interface} is {_quote(identifier)}, expected a name of letters, "
                    "digits and _"
                )
    indicators = root.get("numberOfEventIndicators")
    if indicators is not None:
        _parse_integer(f"{path}: numberOfEventIndicators", indicators, MAX_INDICATORS)
    for times in root.findall("DefaultExperiment"):
        for key in ("startTime", "stopTime", "stepSize", "tolerance"):
            _require_finite(
                f"{path}: DefaultExperiment.{key}", times.get(key), above_zero=key in ("stepSize", "tolerance")
            )
    _check_variables(path, root)


def _check_variables(path: Path, root: ET.Element) -> None:
    starts: dict[str, str] = {}
    arrays: list[tuple[str, list[ET.Element]]] = []
    for element in root.iterfind("ModelVariables/*"):
        name, reference = element.get("name"), element.get("valueReference")
        if name is None or reference is None:
            missing = "name" if name is None else "valueReference"
            raise FmuFileError(f"{path}: a variable of modelDescription.xml has no {missing}, expected one")
        if not 0 < len(name) <= MAX_NAME:
            raise FmuFileError(
                f"{path}: a variable's name has {len(name)} characters ({_quote(name)}), expected 1 to {MAX_NAME}"
            )
        _parse_integer(f"{path}: valueReference of {_quote(name)}", reference, MAX_REFERENCE)
        if dimensions := element.findall("Dimension"):
            arrays.append((name, dimensions))
        elif (start := element.get("start")) is not None:
            starts[reference] = start
    for name, dimensions in arrays:
        entries = 1
        for dimension in dimensions:
            length = dimension.get("start") or starts.get(dimension.get("valueReference", ""), "1")
            entries *= _parse_integer(f"{path}: a dimension of {_quote(name)}", length, MAX_ENTRIES)
            if entries > MAX_ENTRIES:
                raise FmuFileError(f"{path}: {_quote(name)} has {entries} entries, expected at most {MAX_ENTRIES}")


def _parse_integer(key: str, text: str, maximum: int) -> int:
    number = int(text) if len(text) <= 20 and re.fullmatch(r"\s*\+?[0-9]+\s*", text, re.ASCII) else maximum + 1
    if number > maximum:
        raise FmuFileError(f"{key} is {_quote(text)}, expected a whole number of at most {maximum}")
    return number


def _require_finite(key: str, text: str | None, *, above_zero: bool) -> None:
    try:
        number = 1.0 if text is None else float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and (number > 0.0 or not above_zero)):
        raise FmuFileError(f"{key} is {_quote(text or '')}, expected a finite number{' above 0' if above_zero else ''}")


def _quote(text: str) -> str:
    return repr(text if len(text) <= 60 else f"{text[:60]}...")
