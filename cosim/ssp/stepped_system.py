"""A system of FMUs that is stepped in Jacobi's order: in each step all FMUs use the outputs of its beginning."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Self

import numpy as np

from cosim.errors import RunError, ScenarioError
from cosim.scenario.fmu_tables import UserFmu
from cosim.simulation.fmu_map import read_fmu_of
from cosim.simulation.loaded_fmu import LoadedFmu
from cosim.simulation.signals import Array, Column
from cosim.ssp.system_description import Line, Port, SystemDescription, extract_fmus
from cosim.step.step_model import Integers
from plant_fmu import PlantError
from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.errors import printable
from plant_fmu.model_variables import ModelVariable
from plant_fmu.toml_tables import hint

_TIMEOUT = 10.0  # s of the wall clock: a step that takes longer ends the process
_MAX_TEXT = 200  # maximum number of characters of a description


class SteppedSystem:
    """The FMUs of a system, from time 0 on; step [s]. The row is the time, then the outputs."""

    def __init__(self, archive: Path, system: SystemDescription, step: float, folder: Path) -> None:
        fmus = {name: UserFmu(f"components.{name}", file, {}, {}, system.parameters[name], _TIMEOUT, {})
                for name, file in extract_fmus(archive, system, folder).items()}  # fmt: skip
        try:
            self._files = {name: read_fmu_of(fmu) for name, fmu in fmus.items()}
        except ScenarioError as error:
            text = str(error).removeprefix("components.").replace(f"{folder}{os.sep}", "")
            raise RunError(f"{archive}: {text}") from error
        self._step, self._k, self._lines = step, 0, system.lines
        for line in self._lines:
            _check_line(line, *(_variable(self._files, port) for port in (line.start, line.end)))
        self._open = contextlib.ExitStack()
        self._fmus: dict[str, LoadedFmu] = {}
        try:
            for name, fmu in fmus.items():
                self._fmus[name] = self._open.enter_context(contextlib.closing(LoadedFmu(fmu, step, "time.step")))
                self._fmus[name].enter_initialization(fmu)
            for _ in fmus:  # often enough for values to pass through all of them
                for line in self._lines:
                    self._fmus[line.end[0]].set_at_once(line.end[1], self._sent(line))
            for loaded in self._fmus.values():
                loaded.exit_initialization()
        except BaseException:
            self.close()
            raise
        ports = [(name, output) for name, loaded in self._fmus.items() for output in loaded.plant.outputs.names]
        self._others = [port for port in dict.fromkeys(line.start for line in self._lines) if port not in ports]
        self._index = {port: 1 + i for i, port in enumerate([*ports, *self._others])}
        self.columns = [Column("time", "s", "Simulated time"), *map(self._column, self._index)]
        self.row: Array = np.zeros(len(self.columns))
        self._connected = np.array(sorted({self._index[line.start] for line in self._lines}), np.int64)
        self._routes = [self._route(name) for name in self._fmus]
        self._read()

    def _sent(self, line: Line) -> float:
        return _changed(line, self._fmus[line.start[0]].get(line.start[1]))

    def _column(self, port: Port) -> Column:
        v = self._files[port[0]].model[port[1]]
        return Column(".".join(port), printable(v.unit), printable(v.description or v.name)[:_MAX_TEXT])

    def _route(self, name: str) -> tuple[LoadedFmu, Integers, Integers, list[Line]]:
        """Return an FMU, indices of inputs, those of their outputs in the row, and the lines of other inputs."""
        loaded, lines = self._fmus[name], [line for line in self._lines if line.end[0] == name]
        inputs = loaded.plant.inputs.names
        copied = [line for line in lines if line.end[1] in inputs and not line.changes]
        targets = np.array([inputs.index(line.end[1]) for line in copied], np.int64)
        sources = np.array([self._index[line.start] for line in copied], np.int64)
        return loaded, targets, sources, [line for line in lines if line not in copied]

    def step(self) -> None:
        """Advance all FMUs by a step."""
        for loaded, targets, sources, lines in self._routes:
            if targets.size:
                loaded.plant.inputs.values[targets] = self.row[sources]
            for line in lines:
                loaded.set(line.end[1], _changed(line, self.row[self._index[line.start]]))
        for loaded, *_ in self._routes:
            loaded.step(self.row[0])
        self._k += 1
        self._read()

    def _read(self) -> None:
        """Write the row of the present outputs; raise an error if one that is connected is not finite."""
        self.row[0], first = self._k * self._step, 1
        for loaded in self._fmus.values():
            values = loaded.plant.outputs.values
            self.row[first : first + len(values)] = values
            first += len(values)
        for name, variable in self._others:
            self.row[self._index[name, variable]] = self._fmus[name].get(variable)
        if not np.isfinite(self.row[self._connected]).all():
            odd = next(i for i in self._connected if not np.isfinite(self.row[i]))
            name, variable = list(self._index)[odd - 1]
            raise PlantError(
                f"{self._fmus[name].fmu.label}: t = {self.row[0]:.6g} s: {variable} is {self.row[odd]}, "
                "expected a finite number"
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the FMUs. May be called twice."""
        self._open.close()


def _variable(files: dict[str, FmuFile], port: Port) -> ModelVariable:
    name, variable = port
    model = files[name].model
    if variable not in model:
        raise RunError(f"{name}: {files[name].path.name} has no variable {variable!r}; {hint(variable, model)}")
    return model[variable]


def _check_line(line: Line, start: ModelVariable, end: ModelVariable) -> None:
    """Raise `RunError` unless a connection is from an output to an input, of numbers."""
    for port, variable, causalities in ((line.start, start, ("output", "local")), (line.end, end, ("input",))):
        if variable.causality not in causalities:
            what = f"of causality {variable.causality}, expected {causalities[0]}"
        elif variable.shape or variable.type in ("String", "Binary", "Clock"):
            what = f"{'an array' if variable.shape else f'of type {variable.type}'}, expected a number or Boolean"
        else:
            continue
        raise RunError(f"{'.'.join(port)} is connected, but {what}")


def _changed(line: Line, value: float) -> float:
    return line.factor * value + line.offset if line.changes else value
