"""The importers that have drivers."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata

from packaging.requirements import Requirement

from plant_fmu.importers.fmu_file import FmuFile

MAX_SEARCHED = 20_000  # greatest number of variables for importers that search them one by one: 10 s


@dataclass(frozen=True)
class Importer:
    """An importer, or a use of one, with a driver in a module of this package named `module`."""

    name: str
    module: str
    packages: tuple[str, ...]  # requirements that pip must have installed; the first is the importer itself
    interface: str  # "CS", "ME", or "" for a validator without simulation
    inapplicable: Callable[[FmuFile], str] = lambda fmu: ""  # reason why it does not apply to an FMU, "" if it does

    def version(self) -> str:
        """Return the installed version, or ``""`` if there is none."""
        return _installed(Requirement(self.packages[0]))

    def missing(self) -> list[str]:
        """Return the packages that are missing or too old."""
        needed = {package: Requirement(package) for package in self.packages}
        return [package for package, r in needed.items() if not (v := _installed(r)) or v not in r.specifier]

    def objection(self, fmu: FmuFile) -> str:
        """Return the reason why this importer does not apply to an FMU, or ``""``."""
        if not self.interface:
            return self.inapplicable(fmu)
        if self.interface not in fmu.interfaces:
            return f"the FMU offers no {'co-simulation' if self.interface == 'CS' else 'model exchange'}"
        if self.interface not in fmu.libraries:
            return "the FMU has no binary for this machine"
        return self.inapplicable(fmu)


def _installed(package: Requirement) -> str:
    try:
        return metadata.version(package.name)
    except metadata.PackageNotFoundError:
        return ""


def _not_libcosim(fmu: FmuFile) -> str:
    return "" if fmu.fmi == 2 else "takes FMI 2.0 alone"  # 0.0.6 dies of a segmentation fault on any of FMI 3.0


def _not_state(fmu: FmuFile) -> str:
    if not fmu.offers("CS", "canGetAndSetFMUState"):
        return "the FMU cannot save its state (canGetAndSetFMUState)"
    return ""


def _not_many(fmu: FmuFile) -> str:
    count = len(fmu.variables)
    return "" if count <= MAX_SEARCHED else f"takes time with the square of the variables; this FMU has {count}"


def _not_casadi(fmu: FmuFile) -> str:
    if fmu.event_indicators:
        return f"integrates no FMU with state events; this one has {fmu.event_indicators} event indicators"
    if not fmu.states:
        return "the FMU has no continuous states"
    return _not_many(fmu)


# ecospy's library needs TBB, and on Linux does not bring it along
_TBB = ("tbb>=2021.13",) if sys.platform == "linux" else ()

IMPORTERS = (
    Importer("FMPy validation", "fmpy_validation", ("fmpy>=0.3.30",), ""),
    Importer("fmu-manipulation-toolbox", "toolbox", ("fmu-manipulation-toolbox>=2.0",), ""),
    Importer("FMPy", "fmpy_stepping", ("fmpy>=0.3.30",), "CS"),
    Importer("FMPy FMU state", "fmpy_state", ("fmpy>=0.3.30",), "CS", _not_state),
    Importer("Plant, through FMPy", "plant_stepping", ("fmpy>=0.3.30",), "CS"),
    Importer("libcosim", "libcosim", ("libcosimpy>=0.0.6",), "CS", _not_libcosim),
    Importer("Ecos", "ecos", ("ecospy>=0.7", *_TBB), "CS", _not_many),
    Importer("FMPy CVode", "fmpy_cvode", ("fmpy>=0.3.30",), "ME"),
    Importer("CasADi", "casadi_import", ("casadi>=3.8",), "ME", _not_casadi),
)
