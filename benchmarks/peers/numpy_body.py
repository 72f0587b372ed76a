"""The odin vehicle in plain NumPy: Fossen's equations, a quaternion, Runge-Kutta of order four."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def skew(a: Array) -> Array:
    """Return the matrix S of the cross product, S b = a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def coriolis(momentum: Array) -> Array:
    """Return C(v) of a linear and an angular momentum (Fossen 2011, theorem 3.2)."""
    C = np.zeros((6, 6))
    C[:3, 3:] = C[3:, :3] = -skew(momentum[:3])
    C[3:, 3:] = -skew(momentum[3:])
    return C


class Body:
    """A rigid body in still water, without lag of the thrusters."""

    def __init__(self, numbers: dict[str, Any]) -> None:
        v = {key: np.array(value) for key, value in numbers.items()}
        m, S = v["mass"], skew(v["r_G"])
        self.M_A, self.M_RB = v["added_mass"], np.block([[m * np.eye(3), -m * S], [m * S, v["inertia"]]])
        self.M_inverse = np.linalg.inv(self.M_RB + self.M_A)
        self.lift = v["weight"] - v["buoyancy"]
        self.arm = v["r_G"] * v["weight"] - v["r_B"] * v["buoyancy"]
        self.linear, self.quadratic = v["linear_damping"], v["quadratic_damping"]
        self.thruster_matrix, self.thrust_min, self.thrust_max = v["thruster_matrix"], v["thrust_min"], v["thrust_max"]
        # position [m, NED], quaternion from body to world, velocity [m/s, rad/s, body frame]
        self.state = np.zeros(13)
        self.state[3] = 1.0

    def limited(self, thrust: Array) -> Array:
        """Return commanded forces [N], shape (n,), clipped to the thrusters' limits."""
        return np.clip(thrust, self.thrust_min, self.thrust_max)

    def tau(self, thrust: Array, wrench: Array) -> Array:
        """Return the body wrench of the thrusters plus an external one [N, N m]."""
        return wrench + self.thruster_matrix @ self.limited(thrust)

    def rate(self, state: Array, tau: Array) -> Array:
        """Return the time derivative of the state under a body wrench."""
        e, nu = state[3:7], state[7:]
        S = skew(e[1:])
        R = np.eye(3) + 2.0 / (e @ e) * (e[0] * S + S @ S)
        turn = 0.5 * np.vstack([-e[1:], e[0] * np.eye(3) + S])
        k = R[2]  # down, in body axes
        restoring = np.concatenate([self.lift * k, np.cross(self.arm, k)])
        damping = (self.linear + self.quadratic * np.abs(nu)) * nu
        C = coriolis(self.M_RB @ nu) + coriolis(self.M_A @ nu)
        return np.concatenate([R @ nu[:3], turn @ nu[3:], self.M_inverse @ (tau - C @ nu - damping + restoring)])

    def step(self, tau: Array, h: float) -> None:
        """Advance the state by one step of Runge-Kutta [s] under a body wrench."""
        k1 = self.rate(self.state, tau)
        k2 = self.rate(self.state + 0.5 * h * k1, tau)
        k3 = self.rate(self.state + 0.5 * h * k2, tau)
        k4 = self.rate(self.state + h * k3, tau)
        self.state += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        self.state[3:7] /= np.linalg.norm(self.state[3:7])


def steps(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that runs a given number of steps, one call each, and converts thrusts to a wrench in each."""
    body, h = Body(setup["vehicle"]), setup["step"]
    thrust, wrench = np.array(setup["thrust"]), np.array(setup["wrench"])

    def work(count: int) -> None:
        for _ in range(count):
            body.step(body.tau(thrust, wrench), h)

    return work
