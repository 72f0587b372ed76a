"""Read the description of an FMU file, without running anything of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import fmpy

from plant_fmu.checking.task import Task
from plant_fmu.unpacking import library_names, open_fmu, read_description

NATIVE = (fmpy.platform, fmpy.platform_tuple)  # names of this machine in FMI 2.0 and 3.0

_INTERFACES = {"CoSimulation": "CS", "ModelExchange": "ME"}


@dataclass(frozen=True)
class FmuVariable:
    """A scalar variable, as the model description gives it."""

    name: str
    reference: int
    kind: str  # FMI's type, such as "Real" or "Float64"
    causality: str

    @property
    def is_real(self) -> bool:
        """True if it is a double precision number."""
        return self.kind in ("Real", "Float64")


@dataclass(frozen=True)
class FmuFile:
    """An FMU file that is safe to extract, with the content of its model description."""

    path: Path
    fmi: int  # FMI version, 2 or 3
    interfaces: dict[str, dict[str, str]]  # attributes of each interface, by "CS" and "ME"
    variables: tuple[FmuVariable, ...]
    stop_time: float  # s, end of its default experiment
    step: float  # s, step of its default experiment
    libraries: frozenset[str]  # interfaces, of "CS" and "ME", for which it has a library for this machine

    def with_causality(self, causality: str) -> tuple[FmuVariable, ...]:
        """Return the scalar double precision variables of a causality, such as ``"output"``."""
        return tuple(v for v in self.variables if v.is_real and v.causality == causality)

    def offers(self, interface: str, capability: str) -> bool:
        """Return True if an interface has a capability, which is named as in FMI 3.0."""
        attributes = {name.lower(): value for name, value in self.interfaces.get(interface, {}).items()}
        return attributes.get(capability.lower()) in ("true", "1")  # FMI 2.0 writes canGetAndSetFMUstate


def read_fmu(path: Path) -> FmuFile:
    """Read the model description of an FMU."""
    path = Path(path)
    with open_fmu(path) as archive:
        root = read_description(path, archive, NATIVE)
        libraries = {
            _INTERFACES.get(interface)
            for interface, name in library_names(root, NATIVE).items()
            if name in archive.namelist()
        }
    fmi = int(root.get("fmiVersion", "")[0])
    experiment = root.find("DefaultExperiment")
    times = {} if experiment is None else experiment.attrib
    default = Task()
    return FmuFile(
        path=path.absolute(),
        fmi=fmi,
        interfaces={short: dict(e.attrib) for e in root if (short := _INTERFACES.get(e.tag))},
        variables=tuple(_variables(root, fmi)),
        stop_time=float(times.get("stopTime", default.stop_time)),
        step=float(times.get("stepSize", default.step)),
        libraries=frozenset(filter(None, libraries)),
    )


def _variables(root: ET.Element, fmi: int) -> Iterator[FmuVariable]:
    for element in root.iterfind("ModelVariables/*"):
        if element.find("Dimension") is not None:
            continue  # arrays: not all importers read them
        kind = next((child.tag for child in element if child.tag != "Annotations"), "") if fmi == 2 else element.tag
        causality = element.get("causality", "local")
        yield FmuVariable(element.attrib["name"], int(element.attrib["valueReference"]), kind, causality)
