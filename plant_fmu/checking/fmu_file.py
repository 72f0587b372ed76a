"""Read the description of an FMU file, without running anything of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import fmpy

from plant_fmu.checking.task import Task
from plant_fmu.model_variables import ModelVariable, model_variables, unit_definitions
from plant_fmu.unpacking import library_names, open_fmu, read_description, terminal_members

NATIVE = (fmpy.platform, fmpy.platform_tuple)  # names of this machine in FMI 2.0 and 3.0

_INTERFACES = {"CoSimulation": "CS", "ModelExchange": "ME"}


@dataclass(frozen=True)
class FmuFile:
    """An FMU file that is safe to extract, with the content of its model description."""

    path: Path
    fmi: int  # FMI version, 2 or 3
    interfaces: dict[str, dict[str, str]]  # attributes of each interface, by "CS" and "ME"
    token: str  # guid or instantiation token
    variables: tuple[ModelVariable, ...]  # scalars alone: not all importers read arrays
    model: dict[str, ModelVariable]  # all variables by name
    units: dict[str, dict[str, str]]  # attributes of ``BaseUnit`` of its units, by name
    terminals: dict[str, list[tuple[str, ...]]]  # paths of each variable in terminals, that of its member last
    stop_time: float  # s, end of its default experiment
    default_step: float  # s, step of its default experiment; 0 if it states none
    step: float  # s, step of its default experiment, else its fixed internal one
    libraries: frozenset[str]  # interfaces, of "CS" and "ME", for which it has a library for this machine

    def with_causality(self, causality: str) -> tuple[ModelVariable, ...]:
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
        terminals = terminal_members(path, archive)
        libraries = {
            _INTERFACES.get(interface)
            for interface, name in library_names(root, NATIVE).items()
            if name in archive.namelist()
        }
    fmi = int(root.get("fmiVersion", "")[0])
    experiment = root.find("DefaultExperiment")
    times = {} if experiment is None else experiment.attrib
    default = Task()
    interfaces = {short: dict(e.attrib) for e in root if (short := _INTERFACES.get(e.tag))}
    return FmuFile(
        path=path.absolute(),
        fmi=fmi,
        interfaces=interfaces,
        token=root.get("guid" if fmi == 2 else "instantiationToken", ""),
        variables=tuple(v for v in model_variables(root).values() if not v.shape),
        model=model_variables(root),
        units=unit_definitions(root),
        terminals=terminals,
        stop_time=float(times.get("stopTime", default.stop_time)),
        default_step=float(times.get("stepSize", 0.0)),
        step=float(times.get("stepSize") or interfaces.get("CS", {}).get("fixedInternalStepSize") or default.step),
        libraries=frozenset(filter(None, libraries)),
    )
