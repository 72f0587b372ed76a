"""CasADi's import of a model exchange FMU: the ODE integrated with CVODES, and its Jacobian."""

from __future__ import annotations

from pathlib import Path

import casadi
import fmpy
import numpy as np
from numpy.typing import NDArray

from plant_fmu.checking.drivers import Answer
from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.checking.task import Task
from plant_fmu.errors import ImporterError

TOLERANCE = 1e-12  # relative and absolute tolerance of the integrator
_MAX_STEPS = 10**6
_ARGUMENTS = ["t", "x", "u"]

Vector = NDArray[np.float64]


def run(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Simulate to the stop time."""
    model, outputs, x0, u0 = _load(fmu, task, folder)
    ode = model.create("ode", _ARGUMENTS, ["ode", "y"])
    t, x, u = casadi.MX.sym("t"), casadi.MX.sym("x", len(x0)), casadi.MX.sym("u", len(u0))
    problem = {"t": t, "x": x, "u": u, "ode": ode(t, x, u)[0]}
    options = {"reltol": TOLERANCE, "abstol": TOLERANCE, "max_num_steps": _MAX_STEPS}
    integrator = casadi.integrator("run", "cvodes", problem, 0.0, task.stop_time, options)
    end = integrator(x0=x0, u=u0)["xf"]
    y = np.array(ode(task.stop_time, end, u0)[1]).ravel()
    return dict(zip(outputs, y.tolist(), strict=True)), "CasADi knows no time events"


def differentiate(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Take the Jacobian of the states' derivatives at the start; values are by "state, state or input"."""
    model, _, x0, u0 = _load(fmu, task, folder)
    blocks = model.create("jacobian", _ARGUMENTS, ["jac_ode_x", "jac_ode_u"])(0.0, x0, u0)
    rows = np.hstack([np.array(casadi.DM(block)) for block in blocks]).tolist()
    knowns = (*model.x(), *model.u())
    how = "from directional derivatives" if model.provides_directional_derivatives() else "by finite differences"
    return {
        f"{state}, {known}": value
        for state, row in zip(model.x(), rows, strict=True)
        for known, value in zip(knowns, row, strict=True)
    }, f"Jacobian {how}"


def _load(fmu: FmuFile, task: Task, folder: Path) -> tuple[casadi.DaeBuilder, list[str], Vector, Vector]:
    """Load the FMU; return it with the names of its outputs, and start values of states and inputs."""
    model = casadi.DaeBuilder("fmu", str(fmpy.extract(fmu.path, folder)), {})
    outputs = [v.name for v in fmu.with_causality("output")]
    model.set_all("y", outputs)  # without the Boolean ones, which CasADi would read as numbers
    states, inputs = model.x(), model.u()
    # parameters become constants of the functions; what a function is given as an argument is given here too
    for name, value in task.start.items():
        if name not in states and name not in inputs:
            model.set(name, value)
    x0, u0 = (_start(model, names, task) for names in (states, inputs))
    if not np.isfinite(x0).all():
        raise ImporterError(f"no start value of {states[int(np.argmin(np.isfinite(x0)))]} in the model description")
    return model, outputs, x0, u0


def _start(model: casadi.DaeBuilder, names: list[str], task: Task) -> Vector:
    given = zip(names, model.start(names), strict=True)
    return np.array([task.start.get(name, value) for name, value in given], dtype=float)
