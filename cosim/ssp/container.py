"""A system of FMUs as one FMU, by the container of FMU Manipulation Toolbox, which steps in Jacobi's order."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from pathlib import Path

from cosim.errors import ExportError
from cosim.ssp.structure import identifier
from cosim.ssp.system_description import extract_fmus, read_system
from plant_fmu.archive import require_writable, temporary_folder, write_atomic
from plant_fmu.checking.fmu_file import read_fmu
from plant_fmu.installing import install_hint

_NEEDS = "fmu-manipulation-toolbox>=2.0"
_TOOLBOX = "fmu_manipulation_toolbox"


def write_container(system_file: Path, out: Path, fmi: int = 2) -> Path:
    """Write an SSP file as one FMU, with parameters, outputs and free inputs of all as ``plant.position.x``."""
    try:
        from fmu_manipulation_toolbox.container import FMUContainer, FMUContainerError
    except ModuleNotFoundError as error:
        if not (error.name or "").startswith(_TOOLBOX):
            raise
        raise ExportError(f"--to fmu needs {_TOOLBOX} (the extra container); {install_hint(_NEEDS)}") from error
    system = read_system(system_file)
    if not system.step > 0.0:
        raise ExportError(f"{system_file}: states no step, expected one for an FMU")
    require_writable(out)
    with temporary_folder("cosim-") as folder, _quiet():
        try:
            container = FMUContainer(identifier(out.stem), folder, fmi_version=fmi)
            for name, file in extract_fmus(system_file, system, folder).items():
                file.rename(folder / _file(name))
                container.get_fmu(_file(name))
            for line in system.lines:
                if line.changes:
                    raise ExportError(f"{'.'.join(line.end)}: an FMU of several cannot convert what it receives")
                container.add_link(_file(line.start[0]), line.start[1], _file(line.end[0]), line.end[1])
            connected = {line.end for line in system.lines}
            for name, parameters in system.parameters.items():
                for variable in read_fmu(folder / _file(name)).variables:
                    here, shown = (_file(name), variable.name), f"{name}.{variable.name}"
                    if variable.name in parameters:
                        value = parameters[variable.name]
                        container.add_start_value(*here, value if isinstance(value, bool) else str(value))
                    if variable.causality == "output":
                        container.add_output(*here, shown)
                    elif variable.causality in ("input", "parameter") and (name, variable.name) not in connected:
                        container.add_input(shown, *here)
            container.make_fmu("loop.fmu", system.step)
        except FMUContainerError as error:
            raise ExportError(f"{system_file}: {error}") from error
        write_atomic(out, (folder / "loop.fmu").read_bytes())
    return out


def _file(name: str) -> str:
    """Return the file of an FMU, from which the toolbox names local variables: not as the outputs that they equal."""
    return f"link.{name}.fmu"


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Leave out what the toolbox logs, such as outputs that are not connected."""
    logger = logging.getLogger(_TOOLBOX)
    before = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(before)
