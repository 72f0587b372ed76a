"""Nonlinear model predictive control by CasADi and its solver fatrop, over a horizon of N stages.

    minimise    sum_k  w_p (sqrt(|p_k - p_d|^2 + 1) - 1) + w_u |u_k|^2 + w_m |B_r u_k - m_k|^2 + slack's price,
                and w_v |v_N|^2 at the end
    subject to  x_{k+1} = f(x_k, u_k),   u_min <= u_k <= u_max,   s_k >= 0,   of each obstacle and each depth
                |p_k - c_i(t_k)| >= r_i + margin - s_k,   z_min + margin - s_k <= z_k <= z_max - margin + s_k

The state x is position and velocity; the inputs u are the thrusters' forces. f is the nominal model with the measured
attitude, drag against still water, and a constant disturbance from an observer outside. m_k is the
moment that the attitude controller commands. Obstacles keep their velocity.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

_FAR = (0.0, 0.0, -1e3, 0.1, 0.0, 0.0, 0.0)  # parked position of unused obstacles
_SLACK = 1e4  # price of a metre, and of its square


def controller(setup: dict[str, Any]) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """Return a function from measurements, goal and obstacles to thruster forces.

    Parameters
    ----------
    setup : dict
        ``stages``, ``interval`` and ``period`` between plans [s], ``obstacles`` (the greatest number), weights ``w_p``,
        ``w_u``, ``w_m``, ``w_v``, ``iterations``; of the vehicle ``mass`` (3, 3), ``linear`` and ``quadratic`` drag
        (3,), ``thrusters`` (6, m), ``least`` and ``most`` (m,).

    Returns
    -------
    callable
        Given ``position``, ``velocity`` (world), ``R``, ``disturbance`` [m/s2], ``moment`` and ``hold`` [N m], now and
        later, ``goal``, ``spheres`` (n, 7: centre, radius, velocity), ``band`` [m], ``margin`` [m], and ``again`` at
        the start of a flight, it returns ``forces`` [N], ``success``, and ``seconds`` that the solver took.
    """
    N, n, m = setup["stages"], setup["obstacles"], len(setup["least"])
    inputs = {"start": 6, "R": 9, "disturbance": 3, "moment": 3, "hold": 3, "goal": 3, "band": 2}
    inputs |= {"margin": 1, "spheres": 7 * n}
    known = {name: ca.SX.sym(name, size) for name, size in inputs.items()}
    move = _motion(setup)
    B = np.array(setup["thrusters"])
    arm = float(np.sqrt(np.sum(B[3:] ** 2) / np.sum(B[:3] ** 2)))  # m, typical
    spheres = ca.reshape(known["spheres"], 7, n)

    variables, low, high = [], [], []
    rows, g_low, g_high = [], [], []
    cost, following = ca.SX(0), None
    constraints, least, most = [], [], []  # of the stage before
    for k in range(N + 1):
        x, s = ca.SX.sym(f"x{k}", 6), ca.SX.sym(f"s{k}")
        # fatrop finds the stages by this order: variables of a stage, its dynamics, its constraints
        if following is not None:
            rows.append(x - following)
            g_low += [0.0] * 6
            g_high += [0.0] * 6
            rows += constraints
            g_low += least
            g_high += most
        error = x[:3] - known["goal"]
        cost += setup["w_p"] * (ca.sqrt(ca.dot(error, error) + 1.0) - 1.0) + _SLACK * (s + s * s)
        variables.append(x)
        low += [-ca.inf] * 6
        high += [ca.inf] * 6
        if k < N:
            u = ca.SX.sym(f"u{k}", m)
            missing = (ca.DM(B[3:]) @ u - known["moment" if k == 0 else "hold"]) / arm
            cost += setup["w_u"] * ca.dot(u, u) + setup["w_m"] * ca.dot(missing, missing)
            following = move(x, u, known["R"], known["disturbance"])
            variables.append(u)
            low += setup["least"]
            high += setup["most"]
        else:
            cost += setup["w_v"] * ca.dot(x[3:], x[3:])
        variables.append(s)
        low.append(0.0)
        high.append(ca.inf)
        if k == 0:
            constraints, least, most = [x - known["start"]], [0.0] * 6, [0.0] * 6
        else:
            constraints = _clearances(x, k * setup["interval"], spheres, known["band"], known["margin"], s)
            least, most = [0.0] * (n + 2), [ca.inf] * (n + 2)
    rows += constraints
    g_low += least
    g_high += most
    program = {"x": ca.vertcat(*variables), "p": ca.vertcat(*known.values()), "f": cost, "g": ca.vertcat(*rows)}
    options = {
        "structure_detection": "auto",
        "equality": [a == b for a, b in zip(g_low, g_high, strict=True)],
        "jit": shutil.which("gcc") is not None,  # else CasADi's own interpreter
        "compiler": "shell",
        "jit_options": {"flags": ["-O1"], "verbose": False},
        "print_time": False,
        "error_on_fail": False,
        "fatrop": {"print_level": 0, "max_iter": setup["iterations"], "tol": 1e-4, "mu_init": 0.1},
    }
    solver = ca.nlpsol("nmpc", "fatrop", program, options)
    last: list[np.ndarray] = []  # the plan before

    def solve(given: dict[str, Any]) -> dict[str, Any]:
        if given["again"]:
            last.clear()
        balls = np.array(given["spheres"], dtype=float).reshape(-1, 7)
        near = np.argsort(np.linalg.norm(balls[:, :3] - given["position"], axis=1) - balls[:, 3])[:n]
        padded = np.vstack([balls[near], np.tile(_FAR, (n - len(near), 1))])
        values = {
            "start": [*given["position"], *given["velocity"]],
            "R": np.array(given["R"]).ravel(order="F"),
            "spheres": padded.ravel(),
            "margin": [given["margin"]],
        }
        p = np.concatenate([values.get(name, given.get(name)) for name in inputs])
        guess = _shifted(last[0], N, 7 + m, setup["period"] / setup["interval"]) if last else _rest(given, N, m)
        before = time.perf_counter()
        found = solver(x0=guess, p=p, lbx=low, ubx=high, lbg=g_low, ubg=g_high)
        taken = time.perf_counter() - before
        plan = np.array(found["x"]).ravel()
        last.clear()
        if np.isfinite(plan).all():
            last.append(plan)
        else:
            plan = guess
        forces = np.clip(plan[6 : 6 + m], setup["least"], setup["most"])
        return {"forces": forces.tolist(), "success": bool(solver.stats()["success"]), "seconds": taken}

    return solve


def _motion(setup: dict[str, Any]) -> ca.Function:
    """Return the next state of a state and forces, with an attitude (9,) and a disturbance, by the midpoint rule."""
    x, u, h = ca.SX.sym("x", 6), ca.SX.sym("u", len(setup["least"])), setup["interval"]
    inverse, B = ca.DM(np.linalg.inv(setup["mass"])), ca.DM(np.array(setup["thrusters"])[:3])
    linear, quadratic = ca.DM(setup["linear"]), ca.DM(setup["quadratic"])
    turned, disturbance = ca.SX.sym("R", 9), ca.SX.sym("d", 3)
    R = ca.reshape(turned, 3, 3)

    def acceleration(velocity: ca.SX) -> ca.SX:
        body = R.T @ velocity
        drag = (linear + quadratic * ca.sqrt(body * body + 1e-4)) * body
        return R @ (inverse @ (B @ u - drag)) + disturbance

    p, v = x[:3], x[3:]
    a = acceleration(v + 0.5 * h * acceleration(v))
    return ca.Function("move", [x, u, turned, disturbance], [ca.vertcat(p + h * v + 0.5 * h * h * a, v + h * a)])


def _clearances(x: ca.SX, after: float, spheres: ca.SX, band: ca.SX, margin: ca.SX, s: ca.SX) -> list[ca.SX]:
    """Return the constraints g >= 0 after a time [s]: clearances less the margin, plus the slack."""
    found = []
    for i in range(spheres.shape[1]):
        between = x[:3] - spheres[:3, i] - after * spheres[4:, i]
        found.append(ca.sqrt(ca.dot(between, between) + 1e-6) - spheres[3, i] - margin + s)
    return [*found, x[2] - band[0] - margin + s, band[1] - margin - x[2] + s]


def _rest(given: dict[str, Any], stages: int, m: int) -> np.ndarray:
    """Return the plan to stay."""
    plan = np.zeros(stages * (7 + m) + 7)
    for k in range(stages + 1):
        plan[k * (7 + m) : k * (7 + m) + 3] = given["position"]
    return plan


def _shifted(plan: np.ndarray, stages: int, width: int, share: float) -> np.ndarray:
    """Return a plan, a share of an interval later."""
    later = plan.copy()
    for k in range(stages - 1):
        now = slice(k * width, (k + 1) * width)
        later[now] += share * (plan[(k + 1) * width : (k + 2) * width] - plan[now])
    return later
