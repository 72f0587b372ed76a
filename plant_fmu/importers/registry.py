"""The importers there are drivers for."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata

from plant_fmu.importers.fmu_file import FmuFile


@dataclass(frozen=True)
class Importer:
    """An importer, or a use of one, with a driver in a module of this package named `module`."""

    name: str
    module: str
    packages: tuple[str, ...]  # what pip must have installed; the version shown is the first one's
    interface: str  # "CS", "ME", or "" where nothing is simulated
    inapplicable: Callable[[FmuFile], str] = lambda fmu: ""  # why it does not apply to an FMU, "" if it does

    def version(self) -> str:
        """Return the version that is installed, or ``""`` if there is none."""
        try:
            versions = [metadata.version(package) for package in self.packages]  # all of them are needed
        except metadata.PackageNotFoundError:
            return ""
        return versions[0]

    def objection(self, fmu: FmuFile) -> str:
        """Return why this importer has nothing to do with an FMU, or ``""``."""
        if not self.interface:
            return self.inapplicable(fmu)
        if self.interface not in fmu.interfaces:
            return f"the FMU offers no {'co-simulation' if self.interface == 'CS' else 'model exchange'}"
        if not fmu.runs_here:
            return "the FMU has no binary for this machine"
        return self.inapplicable(fmu)


def _not_libcosim(fmu: FmuFile) -> str:
    return "" if fmu.fmi == 2 else "takes FMI 2.0 alone"  # 0.0.6 dies of a segmentation fault on any of FMI 3.0


def _not_state(fmu: FmuFile) -> str:
    if not fmu.offers("CS", "canGetAndSetFMUState"):
        return "the FMU cannot save its state (canGetAndSetFMUState)"
    return ""


def _not_casadi(fmu: FmuFile) -> str:
    if fmu.event_indicators:
        return f"integrates no FMU with state events; this one has {fmu.event_indicators} event indicators"
    if not fmu.states:
        return "the FMU has no continuous states"
    return ""


# ecospy's library needs TBB, and on Linux does not bring it along
_TBB = ("tbb",) if sys.platform == "linux" else ()

IMPORTERS = (
    Importer("FMPy validation", "fmpy_validation", ("fmpy",), ""),
    Importer("fmu-manipulation-toolbox", "toolbox", ("fmu-manipulation-toolbox",), ""),
    Importer("FMPy", "fmpy_stepping", ("fmpy",), "CS"),
    Importer("FMPy FMU state", "fmpy_state", ("fmpy",), "CS", _not_state),
    Importer("libcosim", "libcosim", ("libcosimpy",), "CS", _not_libcosim),
    Importer("Ecos", "ecos", ("ecospy", *_TBB), "CS"),
    Importer("FMPy CVode", "fmpy_cvode", ("fmpy",), "ME"),
    Importer("CasADi", "casadi_import", ("casadi",), "ME", _not_casadi),
)
