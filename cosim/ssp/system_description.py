"""A system of FMUs, as the description in its file (SSP 1.0 or 2.0) has it: FMUs, parameters and connections."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

from cosim.errors import RunError
from cosim.ssp.schema import require_valid
from plant_fmu.unpacking import open_fmu, parse_member

SSD = "SystemStructure.ssd"
_FMU, _SET = "application/x-fmu-sharedlibrary", "application/x-ssp-parameter-set"  # types of parts
_MAPPING = "application/x-ssp-parameter-mapping"
_MAX_DEPTH = 100  # maximum number of nested systems

Port = tuple[str, str]  # name of an FMU or a system, of the outer ones with dots before it; and a variable of it
Value = float | bool | str  # also whole numbers


class Line(NamedTuple):
    """A connection: the variable at its end is ``factor * start + offset``."""

    start: Port
    end: Port
    factor: float = 1.0
    offset: float = 0.0

    @property
    def changes(self) -> bool:
        """True if the end has another value than the start."""
        return (self.factor, self.offset) != (1.0, 0.0)


class SystemDescription(NamedTuple):
    """FMUs with their parameters, and how their variables are connected."""

    name: str
    sources: dict[str, str]  # member of the archive of each FMU
    parameters: dict[str, dict[str, Value]]  # of each FMU
    lines: tuple[Line, ...]  # from outputs of FMUs to inputs
    step: float  # s; NaN if it states none
    start_time: float  # s
    stop_time: float  # s; NaN if it states none


def read_system(path: Path) -> SystemDescription:
    """Read the description in an SSP file; raise `RunError` for what is not supported."""
    with open_fmu(path, SSD, "SSP") as archive:
        return _Reader(path, archive).read()


def extract_fmus(path: Path, system: SystemDescription, folder: Path) -> dict[str, Path]:
    """Extract the FMUs of a system; return the file of each."""
    with open_fmu(path, SSD, "SSP") as archive:
        return {name: Path(archive.extract(source, folder / str(i)))
                for i, (name, source) in enumerate(system.sources.items())}  # fmt: skip


class _Reader:
    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self._path, self._archive = path, archive
        self._root = self._document(SSD)
        self._names: set[str] = set()  # of systems and FMUs
        self._sources: dict[str, str] = {}
        self._parameters: dict[str, dict[str, Value]] = {}
        self._incoming: dict[Port, Line] = {}
        self._constants: dict[Port, Value] = {}  # parameters of systems, which connections pass to FMUs
        self._units: dict[Port, str] = {}

    def read(self) -> SystemDescription:
        system = self._root.find("{*}System")
        if system is None:
            raise self._error("has no System")
        self._read_system(system, ())
        lines = tuple(line for end in self._incoming if end[0] in self._sources for line in self._traced(end))
        experiment = self._root.find("{*}DefaultExperiment")
        times = {} if experiment is None else dict(experiment.attrib)
        steps = ((".//{*}FixedStepAlgorithm", "baseStepSize"), (".//{*}FixedStepMaster", "stepSize"))
        stated = (e.get(key) for path, key in steps for e in self._root.iterfind(path))
        times["step"] = next((text for text in stated if text), "")
        return SystemDescription(
            self._root.get("name") or self._path.stem, self._sources, self._parameters, lines,
            *(self._number(key, times[key]) if times.get(key) else usual
              for key, usual in (("step", math.nan), ("startTime", 0.0), ("stopTime", math.nan))),
        )  # fmt: skip

    # ---- systems and FMUs ----

    def _read_system(self, system: ET.Element, above: tuple[str, ...]) -> None:
        if len(above) > _MAX_DEPTH:
            raise self._error(f"systems are nested deeper than {_MAX_DEPTH}")
        self._read_connectors(system, _joined(above))
        for element in system.iterfind("{*}Elements/*"):
            parts = (*above, element.get("name", ""))
            if _joined(parts) in self._names or not parts[-1]:
                raise self._error(f"name {_joined(parts)!r} of a {_tag(element)} is empty or taken, expected another")
            self._names.add(_joined(parts))
            if _tag(element) == "System":
                self._read_system(element, parts)
            elif _tag(element) == "Component":
                self._read_fmu(element, _joined(parts))
            else:
                raise self._error(f"{_joined(parts)} is a {_tag(element)}, expected a Component or a System")
        for connection in system.iterfind("{*}Connections/{*}Connection"):
            self._connect(connection, above)
        for name, value in self._bound_parameters(system):
            self._assign(_joined((*above, name)), value)

    def _read_fmu(self, element: ET.Element, name: str) -> None:
        source, kind = element.get("source", ""), element.get("type", _FMU)
        if kind != _FMU:
            raise self._error(f"{name} is of type {kind!r}, expected {_FMU}")
        if element.get("implementation", "any") == "ModelExchange":
            raise self._error(f"{name} is for ModelExchange, expected CoSimulation")
        self._sources[name], self._parameters[name] = self._member(name, source), {}
        self._read_connectors(element, name)
        for variable, value in self._bound_parameters(element):
            self._parameters[name][variable] = value

    def _read_connectors(self, element: ET.Element, name: str) -> None:
        for connector in element.iterfind("{*}Connectors/{*}Connector"):
            unit = next((kind.get("unit", "") for kind in connector if kind.get("unit")), "")
            self._units[name, connector.get("name", "")] = unit

    def _member(self, name: str, source: str) -> str:
        member = source.removeprefix("./")
        if member not in self._archive.namelist():
            raise self._error(f"{name}: source is {source!r}, expected a file in it")
        return member

    # ---- connections ----

    def _connect(self, connection: ET.Element, above: tuple[str, ...]) -> None:
        start, end = (
            (_joined((*above, connection.get(f"{which}Element", ""))), connection.get(f"{which}Connector", ""))
            for which in ("start", "end")
        )
        if end in self._incoming:
            raise self._error(f"{_joined(end)} is connected twice")
        change = next((e for e in connection if _tag(e).endswith(("Transformation", "Mapping"))), None)
        factor, offset = self._transformation(change, _joined(end))
        if change is None and connection.get("suppressUnitConversion") not in ("true", "1"):
            factor, offset = self._unit_conversion(start, end)
        self._incoming[end] = Line(start, end, factor, offset)

    def _traced(self, end: Port) -> Iterator[Line]:
        """Yield the line from the output of an FMU, through connectors of systems, to an input, if there is one."""
        line = self._incoming[end]
        for _ in range(_MAX_DEPTH * 2):
            if line.start[0] in self._sources:
                yield line
                return
            if line.start in self._constants:
                self._parameters[end[0]].setdefault(end[1], self._constants[line.start])
                return
            before = self._incoming.get(line.start)
            if before is None:
                return
            line = Line(before.start, end, line.factor * before.factor, line.factor * before.offset + line.offset)
        raise self._error(f"{_joined(end)} is connected in a cycle of systems")

    def _transformation(self, element: ET.Element | None, where: str) -> tuple[float, float]:
        """Return factor and offset of a connection or a parameter's mapping."""
        if element is None:
            return 1.0, 0.0
        if _tag(element) != "LinearTransformation":
            raise self._error(f"{where}: {_tag(element)} is not supported, expected LinearTransformation")
        return self._pair(element.attrib)

    def _unit_conversion(self, start: Port, end: Port) -> tuple[float, float]:
        units = [self._units.get(port, "") for port in (start, end)]
        if units[0] == units[1] or not all(units):
            return 1.0, 0.0
        definitions = {unit.get("name"): unit.find("{*}BaseUnit") for unit in self._root.iterfind("{*}Units/{*}Unit")}
        bases = [base.attrib for unit in units if (base := definitions.get(unit)) is not None]
        if len(bases) < 2:
            raise self._error(f"{_joined(end)} is in {units[1]!r}, expected {units[0]!r} of {_joined(start)}")
        (f0, o0), (f1, o1) = map(self._pair, bases)
        powers = [{k: p for k, p in base.items() if k not in ("factor", "offset") and p != "0"} for base in bases]
        if powers[0] != powers[1] or f1 == 0.0:
            raise self._error(f"{_joined(end)} is in {units[1]!r}, which {units[0]!r} of {_joined(start)} is not")
        return f0 / f1, (o0 - o1) / f1

    def _pair(self, attributes: Mapping[str, str]) -> tuple[float, float]:
        """Return factor and offset of a linear transformation or a base unit."""
        factor, offset = attributes.get("factor", "1"), attributes.get("offset", "0")
        return self._number("factor", factor), self._number("offset", offset)

    # ---- parameters ----

    def _assign(self, name: str, value: Value) -> None:
        """Set the parameter of an FMU, or of a system, which overrides what the FMU's own bindings say."""
        for fmu in sorted(self._sources, key=len, reverse=True):
            if name.startswith(f"{fmu}."):
                self._parameters[fmu][name[len(fmu) + 1 :]] = value
                return
        owner = max((one for one, _ in self._units if name.startswith(f"{one}.")), key=len, default="")
        port = (owner, name[len(owner) + 1 :] if owner else name)
        if port not in self._units:
            raise self._error(f"parameter {name} is of no FMU and no connector of it")
        self._constants[port] = value

    def _bound_parameters(self, element: ET.Element) -> Iterator[tuple[str, Value]]:
        for binding in element.iterfind("{*}ParameterBindings/{*}ParameterBinding"):
            values = self._part(binding, "ParameterValues", "ParameterSet", _SET)
            mapping = binding.find("{*}ParameterMapping")
            entries: dict[str, list[ET.Element]] = {}
            if mapping is not None:
                for entry in self._part(mapping, "", "ParameterMapping", _MAPPING).iterfind("{*}MappingEntry"):
                    entries.setdefault(entry.get("source", ""), []).append(entry)
            for parameter in values.iterfind("{*}Parameters/{*}Parameter"):
                name = f"{binding.get('prefix', '')}{parameter.get('name', '')}"
                value = self._value(name, parameter)
                if mapping is None:
                    yield name, value
                for entry in entries.get(name, ()):
                    target = entry.get("target", "")
                    factor, offset = self._transformation(next(iter(entry), None), target)
                    is_number = not isinstance(value, bool | str) and (factor, offset) != (1.0, 0.0)
                    yield target, factor * value + offset if is_number else value  # type: ignore[operator]

    def _part(self, element: ET.Element, inside: str, tag: str, kind: str) -> ET.Element:
        """Return a parameter set or mapping: in the description itself, or in a file of the archive."""
        if element.get("type", kind) != kind or element.get("sourceBase", "SSD") != "SSD":
            odd = element.get("type", kind) if element.get("type", kind) != kind else "in a component"
            raise self._error(f"{_tag(element)} is {odd!r}, expected {kind} in it")
        if source := element.get("source"):
            return self._document(self._member(_tag(element), source))
        part = element.find(f"{{*}}{inside}/{{*}}{tag}" if inside else f"{{*}}{tag}")
        if part is None:
            raise self._error(f"{_tag(element)} has neither source nor {tag}")
        return part

    def _value(self, name: str, parameter: ET.Element) -> Value:
        element = next((e for e in parameter if e.get("value") is not None), None)
        if element is None or _tag(element) in ("Enumeration", "Binary"):
            kind = "without a value" if element is None else f"of type {_tag(element)}"
            raise self._error(f"parameter {name} is {kind}, expected a number, Boolean or text")
        text = element.get("value", "")
        if _tag(element) == "String":
            return text
        if _tag(element) == "Boolean":
            return text in ("true", "1")
        number = self._number(f"parameter {name}", text)
        return int(number) if "Int" in _tag(element) and number == int(number) else number

    # ---- texts ----

    def _document(self, member: str) -> ET.Element:
        where = f"{self._path}: {member}"
        root = parse_member(where, self._archive, member)
        require_valid(where, self._archive.read(member))
        return root

    def _number(self, what: str, text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise self._error(f"{what} is {text!r}, expected a finite number")
        return number

    def _error(self, text: str) -> RunError:
        return RunError(f"{self._path}: {text}")


def _joined(parts: tuple[str, ...] | Port) -> str:
    return ".".join(filter(None, parts))


def _tag(element: ET.Element) -> str:
    return element.tag.rpartition("}")[2]
