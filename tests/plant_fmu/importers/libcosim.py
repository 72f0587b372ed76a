"""libcosim, of the Open Simulation Platform, stepping a co-simulation FMU of FMI 2.0."""

from __future__ import annotations

import math
from pathlib import Path

from libcosimpy._internal import get_last_error_message
from libcosimpy.CosimEnums import CosimErrorCode
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

from plant_fmu.checking.drivers import Answer
from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.checking.task import Task
from plant_fmu.errors import ImporterError

_TICKS = 10**9  # a second: libcosim counts time in whole nanoseconds


def run(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Simulate to the stop time.

    An ImporterError quotes the error of libcosim.
    """
    ticks = round(task.step * _TICKS)
    if not math.isclose(ticks / _TICKS, task.step, rel_tol=1e-12):
        raise ImporterError(f"step is {task.step:g} s, expected whole nanoseconds")
    log_output_level(CosimLogLevel.ERROR)
    references = {v.name: v.reference for v in fmu.variables}
    execution = CosimExecution.from_step_size(ticks)
    slave = execution.add_local_slave(CosimLocalSlave(str(fmu.path), "fmu"))
    if slave < 0:
        raise ImporterError(get_last_error_message())
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    for name, value in task.start.items():
        if not execution.real_initial_value(slave, references[name], value):
            raise ImporterError(f"start value of {name}: {get_last_error_message()}")
    if not execution.step(task.steps):
        raise ImporterError(get_last_error_message())
    status = execution.status()
    if status.error_code != CosimErrorCode.SUCCESS.value or status.current_time != ticks * task.steps:
        raise ImporterError(f"stopped at t = {status.current_time / _TICKS:g} s: {get_last_error_message()}")
    outputs = {v.name: v.reference for v in fmu.with_causality("output")}
    values = observer.last_real_values(slave, list(outputs.values()))
    return dict(zip(outputs, map(float, values), strict=True)), ""
