"""A co-simulation instance in FMPy, as its drivers use it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import fmpy
from fmpy.simulation import instantiate_fmu

from plant_fmu.importers.fmu_file import FmuFile


class FmpySlave:
    """One instance of an FMU. FMPy prints its messages on the standard output.

    Parameters
    ----------
    fmu : FmuFile
        The FMU.
    folder : Path
        Folder to which it is extracted.
    """

    def __init__(self, fmu: FmuFile, folder: Path) -> None:
        self._fmu = fmu
        self._references = {v.name: v.reference for v in fmu.variables}
        self._outputs = {v.name: v.reference for v in fmu.of("output")}
        description = fmpy.read_model_description(str(folder), validate=False)
        self.instance = instantiate_fmu(str(folder), description, "CoSimulation")

    def initialise(self, start: Mapping[str, float], stop_time: float) -> None:
        """Initialise at time 0 with start values; `stop_time` [s] is passed to the FMU."""
        if self._fmu.fmi == 2:
            self.instance.setupExperiment(startTime=0.0, stopTime=stop_time)
            self._set(start)
            self.instance.enterInitializationMode()
        else:
            self._set(start)
            self.instance.enterInitializationMode(startTime=0.0, stopTime=stop_time)
        self.instance.exitInitializationMode()

    def step(self, first: int, last: int, step: float) -> None:
        """Take the steps from number `first` up to, not including, number `last`."""
        for k in range(first, last):
            self.instance.doStep(k * step, step)

    def outputs(self) -> dict[str, float]:
        """Return the real outputs by name."""
        get = self.instance.getReal if self._fmu.fmi == 2 else self.instance.getFloat64
        return dict(zip(self._outputs, get(list(self._outputs.values())), strict=True))

    def close(self) -> None:
        """Free the instance."""
        self.instance.freeInstance()

    def _set(self, values: Mapping[str, float]) -> None:
        set_values = self.instance.setReal if self._fmu.fmi == 2 else self.instance.setFloat64
        set_values([self._references[name] for name in values], list(values.values()))
