"""The odin vehicle for Numba: the same equations as in NumPy, in loops over preallocated arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = tuple[Array, Array, Array, float, Array, Array, Array]  # M_RB, M_A, M_inverse, lift, arm, dampings


@numba.njit
def rate(s: Array, tau: Array, numbers: Numbers, force: Array, out: Array) -> None:
    """Write the time derivative of the state under a body wrench into `out`; `force`, shape (6,), is scratch space."""
    M_RB, M_A, M_inverse, lift, arm, linear, quadratic = numbers
    e0, e1, e2, e3 = s[3], s[4], s[5], s[6]
    two = 2.0 / (e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3)
    r00, r01, r02 = 1.0 - two * (e2 * e2 + e3 * e3), two * (e1 * e2 - e0 * e3), two * (e1 * e3 + e0 * e2)
    r10, r11, r12 = two * (e1 * e2 + e0 * e3), 1.0 - two * (e1 * e1 + e3 * e3), two * (e2 * e3 - e0 * e1)
    r20, r21, r22 = two * (e1 * e3 - e0 * e2), two * (e2 * e3 + e0 * e1), 1.0 - two * (e1 * e1 + e2 * e2)
    u, v, w, p, q, r = s[7], s[8], s[9], s[10], s[11], s[12]
    out[0] = r00 * u + r01 * v + r02 * w
    out[1] = r10 * u + r11 * v + r12 * w
    out[2] = r20 * u + r21 * v + r22 * w
    out[3] = 0.5 * (-e1 * p - e2 * q - e3 * r)
    out[4] = 0.5 * (e0 * p - e3 * q + e2 * r)
    out[5] = 0.5 * (e3 * p + e0 * q - e1 * r)
    out[6] = 0.5 * (-e2 * p + e1 * q + e0 * r)
    # momenta of body and added mass, and the forces of their rotation with the body frame
    m0 = m1 = m2 = m3 = m4 = m5 = 0.0
    for j in range(6):
        x = s[7 + j]
        m0 += (M_RB[0, j] + M_A[0, j]) * x
        m1 += (M_RB[1, j] + M_A[1, j]) * x
        m2 += (M_RB[2, j] + M_A[2, j]) * x
        m3 += (M_RB[3, j] + M_A[3, j]) * x
        m4 += (M_RB[4, j] + M_A[4, j]) * x
        m5 += (M_RB[5, j] + M_A[5, j]) * x
    force[0] = m1 * r - m2 * q + lift * r20
    force[1] = m2 * p - m0 * r + lift * r21
    force[2] = m0 * q - m1 * p + lift * r22
    force[3] = m1 * w - m2 * v + m4 * r - m5 * q + arm[1] * r22 - arm[2] * r21
    force[4] = m2 * u - m0 * w + m5 * p - m3 * r + arm[2] * r20 - arm[0] * r22
    force[5] = m0 * v - m1 * u + m3 * q - m4 * p + arm[0] * r21 - arm[1] * r20
    for i in range(6):
        x = s[7 + i]
        force[i] += tau[i] - (linear[i] + quadratic[i] * abs(x)) * x
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += M_inverse[i, j] * force[j]
        out[7 + i] = total


@numba.njit
def step(
    s: Array, thrust: Array, wrench: Array, B: Array, low: Array, high: Array, numbers: Numbers, h: float, work: Array
) -> None:
    """Advance the state by one step of Runge-Kutta [s]; `work`, shape (7, 13), is scratch space."""
    tau, k1, k2, k3, k4, there, force = work[0], work[1], work[2], work[3], work[4], work[5], work[6]
    for i in range(6):
        tau[i] = wrench[i]
        for j in range(thrust.size):
            tau[i] += B[i, j] * min(max(thrust[j], low[j]), high[j])
    rate(s, tau, numbers, force, k1)
    for i in range(13):
        there[i] = s[i] + 0.5 * h * k1[i]
    rate(there, tau, numbers, force, k2)
    for i in range(13):
        there[i] = s[i] + 0.5 * h * k2[i]
    rate(there, tau, numbers, force, k3)
    for i in range(13):
        there[i] = s[i] + h * k3[i]
    rate(there, tau, numbers, force, k4)
    for i in range(13):
        s[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])
    norm = np.sqrt(s[3] ** 2 + s[4] ** 2 + s[5] ** 2 + s[6] ** 2)
    for i in range(3, 7):
        s[i] /= norm


@numba.njit
def many(
    s: Array, thrust: Array, wrench: Array, B: Array, low: Array, high: Array, numbers: Numbers, h: float, work: Array,
    count: int,
) -> None:  # fmt: skip
    """Run `count` steps."""
    for _ in range(count):
        step(s, thrust, wrench, B, low, high, numbers, h, work)


def arguments(setup: dict[str, Any]) -> tuple[Any, ...]:
    """Return the arguments of `step` for a setup."""
    v = {key: np.array(value, dtype=np.float64) for key, value in setup["vehicle"].items()}
    (x, y, z), m = v["r_G"], float(v["mass"])
    S = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    M_RB = np.block([[m * np.eye(3), -m * S], [m * S, v["inertia"]]])
    lift, arm = float(v["weight"] - v["buoyancy"]), v["r_G"] * v["weight"] - v["r_B"] * v["buoyancy"]
    M_inverse = np.ascontiguousarray(np.linalg.inv(M_RB + v["added_mass"]))
    numbers = (M_RB, v["added_mass"], M_inverse, lift, arm, v["linear_damping"], v["quadratic_damping"])
    state = np.zeros(13)
    state[3] = 1.0
    thrust, wrench = np.array(setup["thrust"]), np.array(setup["wrench"])
    limits = v["thrust_min"], v["thrust_max"]
    return state, thrust, wrench, v["thruster_matrix"], *limits, numbers, setup["step"], np.zeros((7, 13))


def steps(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that runs a given number of steps, one call from Python each."""
    known = arguments(setup)

    def work(count: int) -> None:
        for _ in range(count):
            step(*known)

    return work


def loop(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that runs a given number of steps in compiled code."""
    known = arguments(setup)
    return lambda count: many(*known, count)
