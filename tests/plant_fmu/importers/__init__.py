"""Importers of other tools, for the tests: each runs on an FMU in a process of its own, as those of `check` do."""

import sys
from importlib import metadata

import fmpy

from plant_fmu.checking.check import IMPORTERS as CHECKED
from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.checking.process import Importer

MAX_SEARCHED = 20_000  # variables of an FMU for importers that search them one by one: 10 s


def _not_libcosim(fmu: FmuFile) -> str:
    return "" if fmu.fmi == 2 else "takes FMI 2.0 alone"  # 0.0.6 dies of a segmentation fault on any of FMI 3.0


def _not_many(fmu: FmuFile) -> str:
    count = len(fmu.variables)
    return "" if count <= MAX_SEARCHED else f"takes time with the square of the variables; this FMU has {count}"


def _not_casadi(fmu: FmuFile) -> str:
    description = fmpy.read_model_description(str(fmu.path), validate=False)
    if description.numberOfEventIndicators:
        return (
            f"integrates no FMU with state events; this one has {description.numberOfEventIndicators} event indicators"
        )
    if not description.numberOfContinuousStates:
        return "the FMU has no continuous states"
    return _not_many(fmu)


def _importer(name, driver, interface, package, inapplicable=lambda fmu: ""):
    return Importer(name, f"{__name__}.{driver}", interface, inapplicable, package)


IMPORTERS = (
    *CHECKED,
    _importer("fmu-manipulation-toolbox", "toolbox:run", "", "fmu-manipulation-toolbox"),
    _importer("libcosim", "libcosim:run", "CS", "libcosimpy", _not_libcosim),
    _importer("Ecos", "ecos:run", "CS", "ecospy", _not_many),
    _importer("CasADi", "casadi_import:run", "ME", "casadi", _not_casadi),
)
JACOBIAN = _importer("CasADi Jacobian", "casadi_import:differentiate", "ME", "casadi", _not_casadi)


def missing(importer: Importer) -> str:
    """The package that an importer lacks here, "" if it lacks none."""
    # ecospy's library needs TBB, and on Linux does not bring it along
    needed = [importer.package, *(["tbb"] if importer.name == "Ecos" and sys.platform == "linux" else [])]
    found = {distribution.name.lower().replace("_", "-") for distribution in metadata.distributions()}
    return next((package for package in needed if package not in found), "")


def installed() -> tuple[Importer, ...]:
    """The importers that can run here."""
    return tuple(importer for importer in IMPORTERS if not missing(importer))
