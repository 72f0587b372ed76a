"""CasADi's import of a model exchange FMU: the ODE integrated with CVODES, and its Jacobian."""

from __future__ import annotations

from pathlib import Path

import casadi
import fmpy
import numpy as np
from numpy.typing import NDArray

from plant_fmu.errors import ImporterError
from plant_fmu.importers.fmu_file import FmuFile
from plant_fmu.importers.task import Answer, Jacobian, Task

TOLERANCE = 1e-12  # relative and absolute tolerance of the integrator
_MAX_STEPS = 10**6


def run(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Simulate to the stop time; take the Jacobian of the states' derivatives at the start.

    An ImporterError names a state without a start value.
    """
    model = casadi.DaeBuilder("fmu", str(fmpy.extract(fmu.path, folder)), {})
    outputs = [v.name for v in fmu.of("output")]
    model.set_all("y", outputs)  # without the Boolean ones, which CasADi would read as numbers
    states, inputs = model.x(), model.u()
    # parameters become constants of the functions; what a function is given as an argument is given here too
    for name, value in task.start.items():
        if name not in states and name not in inputs:
            model.set(name, value)
    x0, u0 = (_start(model, names, task) for names in (states, inputs))
    if not np.isfinite(x0).all():
        raise ImporterError(f"no start value of {states[int(np.argmin(np.isfinite(x0)))]} in the model description")

    arguments = ["t", "x", "u"]
    ode = model.create("ode", arguments, ["ode", "y"])
    jacobian: Jacobian = {}
    blocks = model.create("jacobian", arguments, ["jac_ode_x", "jac_ode_u"])(0.0, x0, u0)
    for state, row in zip(states, np.hstack([np.array(casadi.DM(block)) for block in blocks]).tolist(), strict=True):
        jacobian[state] = dict(zip((*states, *inputs), row, strict=True))

    t, x, u = casadi.MX.sym("t"), casadi.MX.sym("x", len(x0)), casadi.MX.sym("u", len(u0))
    problem = {"t": t, "x": x, "u": u, "ode": ode(t, x, u)[0]}
    options = {"reltol": TOLERANCE, "abstol": TOLERANCE, "max_num_steps": _MAX_STEPS}
    integrator = casadi.integrator("run", "cvodes", problem, 0.0, task.stop_time, options)
    end = integrator(x0=x0, u=u0)["xf"]
    y = np.array(ode(task.stop_time, end, u0)[1]).ravel()
    values = dict(zip(outputs, y.tolist(), strict=True))
    how = "from directional derivatives" if model.provides_directional_derivatives() else "by finite differences"
    return Answer(values, jacobian, f"Jacobian {how}; CasADi knows no time events")


def _start(model: casadi.DaeBuilder, names: list[str], task: Task) -> NDArray[np.float64]:
    given = zip(names, model.start(names), strict=True)
    return np.array([task.start.get(name, value) for name, value in given], dtype=float)
