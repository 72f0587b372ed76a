"""The REMUS 100 of PythonVehicleSimulator: one step of its dynamics and attitude, by Euler's rule, as it ships."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from python_vehicle_simulator.lib.gnc import attitudeEuler
from python_vehicle_simulator.vehicles import remus100


def steps(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that runs a given number of steps, with the simulator's own autopilot."""
    vehicle = remus100("depthHeadingAutopilot", 30.0, 50.0, 1525.0, 0.5, 170.0)
    h, eta = setup["step"], np.zeros(6)
    nu, u_actual = vehicle.nu, vehicle.u_actual

    def work(count: int) -> None:
        nonlocal eta, nu, u_actual
        for _ in range(count):
            u_control = vehicle.depthHeadingAutopilot(eta, nu, h)
            nu, u_actual = vehicle.dynamics(eta, nu, u_actual, u_control, h)
            eta = attitudeEuler(eta, nu, h)

    return work
