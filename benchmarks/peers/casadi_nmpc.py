"""Nonlinear model predictive control by CasADi and its solver fatrop, over a horizon of N stages.

    minimize    sum_k  w_p (sqrt(|p_k - p_d|^2 + 1) - 1) + w_u |u_k|^2 + w_m |B_r u_k - m_k|^2 + the slack's price
                + w_s sum_j depth(d_jk + margin - n_jk . p_k) of soft regions, and w_v |v_N|^2 at the end
    subject to  x_{k+1} = f(x_k, u_k),   u_min <= u_k <= u_max,   s_k >= 0,   of each obstacle and each plane
                |p_k - c_i(t_k)| >= r_i + margin - s_k,   n_jk . p_k >= d_jk + margin - s_k

The state x is position and velocity; the inputs u are the thrusters' forces, in shares of the greatest. f is the
nominal model with the measured attitude, drag against still water, and a constant disturbance from an observer outside.
m_k is the moment that the attitude controller commands. Obstacles and goal keep their velocity. A plane bounds a depth,
or is the tangent of another region where the plan before comes nearest. Hard regions have planes that constrain, soft
ones have planes with a price: depth(v) = (v + sqrt(v^2 + e^2)) / 2, smooth within e = 0.05 m.

The solver runs in a child process, since in some problems without a solution its iterations do not end: a plan that
takes too long ends this process, and the plan before goes on. So it needs `os.fork`.

Vehicle, weights and interval are parameters of the program, so that it is compiled once for a number of stages.
"""

from __future__ import annotations

import mmap
import os
import shutil
import signal
import time
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

_FAR = (0.0, 0.0, -1e3, 0.1, 0.0, 0.0, 0.0)  # m, m/s, an unused obstacle: parked center, radius, velocity
_NO_PLANE = (0.0, 0.0, 0.0, -1e3)  # plane that is always satisfied, with nearly no cost
_SLACK = 1e4  # 1/m, 1/m2, weight of the slack, and of its square
_LONGEST = 0.3  # s, longest computation of a plan
_THRUSTERS = 8
_SMOOTH = 0.05  # m, width in which the depth within soft regions is smooth
_ANGULAR = 1.5154  # rad/s2, scale of missing moments: ODIN's acceleration by 27 N, one thruster, at an arm of 0.449 m
_WEIGHTS = ("interval", "margin", "w_p", "w_u", "w_m", "w_v", "w_s")


def controller(setup: dict[str, Any]) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """Return a function from measurements, goal and obstacles to thruster forces.

    Parameters
    ----------
    setup : dict
        ``stages``, ``iterations`` of the solver at most, ``period`` between plans [s], and the greatest numbers of
        ``obstacles`` and of planes of ``hard`` and ``soft`` regions.

    Returns
    -------
    callable
        Function of a dict with ``position`` and ``velocity`` [m, m/s, NED]; ``R`` from body to world; ``disturbance``
        [m/s2, NED]; the attitude loop's moments now, ``moment``, and later, ``hold`` [N m]; ``goal`` and
        ``goal_velocity`` [m, m/s, NED]; ``spheres`` (n, 7: center, radius, velocity); planes of ``hard`` and ``soft``
        regions, each (stages, 4: normal, least coordinate along it); ``weights``; ``again``, True at the start of a
        flight, and then ``vehicle``. It returns ``forces`` [N]; ``success``, True if the solver converged; ``path``
        (stages, 3), expected positions at the stages of the next plan [m, NED]; ``seconds``, computation time. A
        vehicle has ``mass`` (3, 3) [kg], ``inertia`` (3,) [kg m2], ``linear`` and ``quadratic`` drag (3,),
        ``thrusters`` (6, 8), ``least`` and ``most`` forces (8,) [N].
    """
    program = _Program(setup)
    plan = np.zeros(0)  # the plan before
    vehicle: dict[str, Any] = {}

    def solve(given: dict[str, Any]) -> dict[str, Any]:
        nonlocal plan
        if given["again"]:
            vehicle.update({name: np.array(value, dtype=float) for name, value in given["vehicle"].items()})
            vehicle["scale"] = scale = np.maximum(vehicle["most"], -vehicle["least"])
            program.bound_inputs(vehicle["least"] / scale, vehicle["most"] / scale)
            B = vehicle["thrusters"]
            program.set(
                inverse=np.linalg.inv(vehicle["mass"]), linear=vehicle["linear"], quadratic=vehicle["quadratic"],
                B=B * scale, moment_scale=_ANGULAR * vehicle["inertia"],
            )  # fmt: skip
            plan = program.rest(given["position"])
        program.set(**{name: given["weights"][name] for name in _WEIGHTS})
        program.set(**{name: given[name] for name in ("disturbance", "moment", "hold", "goal", "goal_velocity")})
        program.set(
            start=[*given["position"], *given["velocity"]],
            R=given["R"],
            spheres=_nearest(given["spheres"], given["position"], setup["obstacles"]),
            planes=_all_planes(given, setup),
        )
        before = time.perf_counter()
        solution, success = program.solve(plan)
        taken = time.perf_counter() - before
        if not np.isfinite(solution).all():
            solution, success = plan, False
        forces = np.clip(program.first_inputs(solution) * vehicle["scale"], vehicle["least"], vehicle["most"])
        plan = program.shifted(solution, setup["period"] / given["weights"]["interval"])
        return {
            "forces": forces.tolist(), "success": success, "path": program.positions(plan).tolist(), "seconds": taken,
        }  # fmt: skip

    return solve


class _Program:
    """The compiled nonlinear program, with the arrays of its arguments."""

    def __init__(self, setup: dict[str, Any]) -> None:
        self._stages, n = setup["stages"], setup["obstacles"]
        planes = setup["hard"] + setup["soft"]
        shapes = {
            "start": (6, 1), "R": (3, 3), "disturbance": (3, 1), "moment": (3, 1), "hold": (3, 1), "goal": (3, 1),
            "goal_velocity": (3, 1), "inverse": (3, 3), "linear": (3, 1), "quadratic": (3, 1), "B": (6, _THRUSTERS),
            "moment_scale": (3, 1), "spheres": (7, n), "planes": (4, planes * self._stages),
        } | dict.fromkeys(_WEIGHTS, (1, 1))  # fmt: skip
        known = {name: ca.SX.sym(name, *shape) for name, shape in shapes.items()}
        self._p = _shared(sum(a * b for a, b in shapes.values()))
        self._parts: dict[str, Any] = {}
        first = 0
        for name, (rows, columns) in shapes.items():  # column-major, like CasADi
            part = self._p[first : first + rows * columns]
            self._parts[name] = part.reshape(columns, rows).T
            first += rows * columns
        self._width = 7 + _THRUSTERS
        symbols, bounds = _symbols(known, setup)
        options = {
            "structure_detection": "auto",
            "equality": [a == b for a, b in zip(*bounds, strict=True)],
            "jit": shutil.which("gcc") is not None,  # else CasADi's own interpreter
            "compiler": "shell",
            "jit_options": {"flags": ["-O1"], "verbose": False},
            "print_time": False,
            "error_on_fail": False,
            "fatrop": {"print_level": 0, "max_iter": setup["iterations"], "tol": 1e-4, "mu_init": 0.01},
        }
        self._solver = ca.nlpsol("nmpc", "fatrop", symbols, options)
        count = self._stages * self._width + 7
        self._guess, self._found, self._low, self._high = (_shared(count) for _ in range(4))
        self._low[:], self._high[:] = -np.inf, np.inf
        for k in range(self._stages + 1):
            self._low[k * self._width + (6 + _THRUSTERS if k < self._stages else 6)] = 0.0  # the slack
        self._buffer, self._run = self._solver.buffer()
        arguments = (self._guess, self._p, self._low, self._high, *(np.array(bound) for bound in bounds))
        for i, argument in enumerate(arguments):
            self._buffer.set_arg(i, memoryview(argument))
        self._buffer.set_res(0, memoryview(self._found))
        self._kept = arguments  # the buffer refers to these arrays
        self._child: tuple[int, int, int] | None = None  # process id, file descriptors of the pipes to and from it

    def set(self, **values: Any) -> None:
        """Set parameters by name."""
        for name, value in values.items():
            part = self._parts[name]
            part[...] = np.asarray(value, dtype=float).reshape(part.shape)

    def bound_inputs(self, least: np.ndarray, most: np.ndarray) -> None:
        """Set the bounds of the inputs of all stages, shape (8,), as fractions of the greatest forces."""
        for k in range(self._stages):
            inputs = slice(k * self._width + 6, k * self._width + 6 + _THRUSTERS)
            self._low[inputs], self._high[inputs] = least, most

    def solve(self, guess: np.ndarray) -> tuple[np.ndarray, bool]:
        """Solve from a guess; return the plan, and True if the solver converged. Return the guess after a timeout."""
        self._guess[:] = guess
        self._child = self._child or self._fork()
        process, asks, answers = self._child
        os.write(asks, b"?")
        if answer := os.read(answers, 1):
            return self._found.copy(), answer == b"1"
        os.waitpid(process, 0)
        os.close(asks)
        os.close(answers)
        self._child = None
        return guess.copy(), False

    def _fork(self) -> tuple[int, int, int]:
        """Start a child process that solves for each byte in its pipe; it ends with the pipe, or by the timer."""
        (asked, asks), (answers, answered) = os.pipe(), os.pipe()
        process = os.fork()
        if process == 0:
            os.close(asks)
            os.close(answers)
            try:
                while os.read(asked, 1):
                    signal.setitimer(signal.ITIMER_VIRTUAL, _LONGEST)
                    self._run()
                    signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
                    os.write(answered, b"1" if self._solver.stats(1)["success"] else b"0")  # 1: memory of the buffer
            finally:
                os._exit(0)
        os.close(asked)
        os.close(answered)
        return process, asks, answers

    def rest(self, position: list[float]) -> np.ndarray:
        """Return the plan to rest at a position."""
        plan = np.zeros(self._guess.size)
        for k in range(self._stages + 1):
            plan[k * self._width : k * self._width + 3] = position
        return plan

    def shifted(self, plan: np.ndarray, share: float) -> np.ndarray:
        """Return a plan shifted in time by a fraction of an interval."""
        later = plan.copy()
        now = plan[: self._stages * self._width].reshape(self._stages, self._width)
        later[: now.size - self._width] += share * (now[1:] - now[:-1]).ravel()
        return later

    def first_inputs(self, plan: np.ndarray) -> np.ndarray:
        """Return the inputs of the first stage, shape (8,), as fractions of the greatest forces."""
        return plan[6 : 6 + _THRUSTERS]

    def positions(self, plan: np.ndarray) -> np.ndarray:
        """Return the positions after each stage, shape (stages, 3) [m, NED]."""
        return plan[[[k * self._width + axis for axis in range(3)] for k in range(1, self._stages + 1)]]


def _shared(count: int) -> np.ndarray:
    """Return an array of zeros in memory that child processes share."""
    return np.frombuffer(mmap.mmap(-1, 8 * count))


def _symbols(
    known: dict[str, ca.SX], setup: dict[str, Any]
) -> tuple[dict[str, ca.SX], tuple[list[float], list[float]]]:
    """Return the symbols of the program, and the lower and upper bounds of its constraints."""
    N, n, hard = setup["stages"], setup["obstacles"], setup["hard"]
    count = hard + setup["soft"]
    variables, rows, cost, following = [], [], ca.SX(0), None
    low: list[float] = []
    high: list[float] = []
    constraints: list[ca.SX] = []  # constraints of the previous stage
    for k in range(N + 1):
        x, s = ca.SX.sym(f"x{k}", 6), ca.SX.sym(f"s{k}")
        # fatrop finds the stages by this order: variables of a stage, its dynamics, its constraints
        if following is not None:
            rows += [x - following, *constraints]
            low += [0.0] * (6 + (6 if k == 1 else len(constraints)))
            high += [0.0] * 12 if k == 1 else [0.0] * 6 + [ca.inf] * len(constraints)
        after = k * known["interval"]
        error = x[:3] - known["goal"] - after * known["goal_velocity"]
        cost += known["w_p"] * (ca.sqrt(ca.dot(error, error) + 1.0) - 1.0) + _SLACK * (s + s * s)
        variables.append(x)
        if k < N:
            u = ca.SX.sym(f"u{k}", _THRUSTERS)
            missing = (known["B"][3:, :] @ u - known["moment" if k == 0 else "hold"]) / known["moment_scale"]
            cost += known["w_u"] * ca.dot(u, u) + known["w_m"] * ca.dot(missing, missing)
            following = _next(x, u, known)
            variables.append(u)
        else:
            cost += known["w_v"] * ca.dot(x[3:], x[3:])
        variables.append(s)
        if k == 0:
            constraints = [x - known["start"]]
            continue
        constraints = []
        for i in range(n):
            between = x[:3] - known["spheres"][:3, i] - after * known["spheres"][4:, i]
            away = ca.sqrt(ca.dot(between, between) + 1e-6)
            constraints.append(away - known["spheres"][3, i] - known["margin"] + s)
        for i in range(count):
            plane = known["planes"][:, (k - 1) * count + i]
            clearance = ca.dot(plane[:3], x[:3]) - plane[3] - known["margin"]
            if i < hard:
                constraints.append(clearance + s)
            else:
                cost += known["w_s"] * 0.5 * (ca.sqrt(clearance * clearance + _SMOOTH**2) - clearance)
    rows += constraints
    low += [0.0] * len(constraints)
    high += [ca.inf] * len(constraints)
    parameters = ca.vertcat(*(ca.vec(symbol) for symbol in known.values()))
    return {"x": ca.vertcat(*variables), "p": parameters, "f": cost, "g": ca.vertcat(*rows)}, (low, high)


def _next(x: ca.SX, u: ca.SX, known: dict[str, ca.SX]) -> ca.SX:
    """Return the state after one interval, by an exponential Rosenbrock step.

    A midpoint step is unstable where the slope of the drag, divided by the mass, exceeds 2 / interval, as for a
    BlueROV2 from 0.3 m/s on.
    """
    R, h = known["R"], known["interval"]
    body = R.T @ x[3:]
    speed = ca.sqrt(body * body + 1e-4)
    thrust = known["B"][:3, :] @ u
    acceleration = known["inverse"] @ (thrust - (known["linear"] + known["quadratic"] * speed) * body)
    acceleration += R.T @ known["disturbance"]
    slope = ca.diag(known["inverse"]) * (known["linear"] + known["quadratic"] * (speed + body * body / speed))
    z = -h * slope - 1e-3  # above rounding in the quotients
    first = (ca.exp(z) - 1.0) / z
    second = (first - 1.0) / z
    velocity, place = R @ (h * first * acceleration), R @ (h * h * second * acceleration)
    return ca.vertcat(x[:3] + h * x[3:] + place, x[3:] + velocity)


def _nearest(spheres: list[list[float]], position: list[float], count: int) -> np.ndarray:
    """Return the nearest spheres, padded with parked ones, shape (7, count)."""
    balls = np.array(spheres, dtype=float).reshape(-1, 7)
    near = np.argsort(np.linalg.norm(balls[:, :3] - position, axis=1) - balls[:, 3])[:count]
    return np.vstack([balls[near], *[_FAR] * (count - len(near))]).reshape(-1, 7).T


def _all_planes(given: dict[str, Any], setup: dict[str, Any]) -> np.ndarray:
    """Return the planes of all stages, hard ones first in each, shape (4, stages * n)."""
    planes = np.tile(np.array(_NO_PLANE), (setup["stages"], setup["hard"] + setup["soft"], 1))
    for first, kind in ((0, "hard"), (setup["hard"], "soft")):
        for i, plane in enumerate(given[kind][: setup[kind]]):
            planes[:, first + i] = plane
    return planes.reshape(-1, 4).T
