"""The odin vehicle, one step of Runge-Kutta in 10 ms: from Python, and in compiled code."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

from benchmarks.c_loop import c_loop
from benchmarks.contest import Contest, Entry
from benchmarks.peer_environment import Environment
from benchmarks.peer_process import peer
from benchmarks.timing import Contestant, InProcess, repeat_call
from benchmarks.vehicle_numbers import vehicle_numbers
from plant_fmu import Plant, load_vehicle
from plant_fmu.build import cached_fmu

VEHICLE = "odin"
STEP = 0.01  # s, common integration step
THRUST = [3.0, 0.0, 0.0, 0.0, 0.0, -2.0, 0.0, 0.0]  # N, commanded force of each thruster
WRENCH = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]  # N, N m, body frame, external wrench
START = {"thrust[1]": THRUST[0], "thrust[6]": THRUST[5], "wrench.Y": WRENCH[1], "substep": STEP}


def contests(environment: Environment) -> Iterator[Contest]:
    """Yield the contests of the plant."""
    yield Contest(
        "A step of the plant, called from Python: inputs set, outputs read",
        {f"Plant.step, FMI {fmi}": _plant(fmi) for fmi in (3, 2)},
        {
            "FMPy, FMU3Slave in a loop": _fmpy(environment, "loop", 3),
            "FMPy, FMU2Slave in a loop": _fmpy(environment, "loop", 2),
            "FMPy, simulate_fmu": _fmpy(environment, "simulate", 3),
            "NumPy, 6 DOF": _body(environment, "numpy", "numpy_body", "steps"),
            "Numba, 6 DOF": _body(environment, "numba", "numba_body", "steps"),
            "MuJoCo, free body in a fluid": _body(environment, "mujoco", "mujoco_body", "steps"),
            "PythonVehicleSimulator": _body(environment, "python-vehicle-simulator", "vehicle_simulator", "steps"),
        },
        (
            ("Plant.step, FMI 3", "FMPy, FMU3Slave in a loop"),
            ("Plant.step, FMI 2", "FMPy, FMU2Slave in a loop"),
            ("Plant.step, FMI 3", "FMPy, simulate_fmu"),
            ("Plant.step, FMI 3", "NumPy, 6 DOF"),
            ("Plant.step, FMI 3", "Numba, 6 DOF"),
            ("Plant.step, FMI 3", "MuJoCo, free body in a fluid"),
            ("Plant.step, FMI 3", "PythonVehicleSimulator"),
        ),
    )
    yield Contest(
        "A step of the plant in compiled code",
        {
            "FMU in a loop in C, all inputs and outputs": _in_c(step_only=False),
            "FMU in a loop in C, doStep alone": _in_c(step_only=True),
        },
        {
            "Numba, 6 DOF, compiled loop": _body(environment, "numba", "numba_body", "loop"),
            "MuJoCo, free body in a fluid, nstep": _body(environment, "mujoco", "mujoco_body", "loop"),
        },
    )


def _plant(fmi: int) -> Entry:
    def entry(stack: ExitStack) -> Contestant:
        plant = stack.enter_context(Plant(load_vehicle(VEHICLE), fmi))
        plant.set(START)
        plant.initialize()

        def step() -> None:
            plant.step(STEP)
            plant.read_flags()

        return InProcess(repeat_call(step))

    return entry


def _in_c(*, step_only: bool) -> Entry:
    path = cached_fmu(load_vehicle(VEHICLE), 3)
    return lambda stack: InProcess(stack.enter_context(c_loop(path, START, STEP, step_only=step_only)))


def _fmpy(environment: Environment, function: str, fmi: int) -> Entry:
    def entry(stack: ExitStack) -> Contestant:
        setup = {"fmu": str(cached_fmu(load_vehicle(VEHICLE), fmi)), "start": START, "step": STEP}
        return stack.enter_context(peer(environment, "fmpy", "fmpy_steps", function, setup))

    return entry


def _body(environment: Environment, package: str, module: str, function: str) -> Entry:
    def entry(stack: ExitStack) -> Contestant:
        setup: dict[str, Any] = {"vehicle": vehicle_numbers(VEHICLE), "step": STEP, "thrust": THRUST, "wrench": WRENCH}
        return stack.enter_context(peer(environment, package, module, function, setup))

    return entry
