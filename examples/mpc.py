"""A predictive law to compare with: every tenth of a second it plans thruster forces for the next seconds, by CasADi.

    minimize    sum_k  |p_k - p_d| + w_u |u_k / u_max|^2 + w_m |B_r u_k - m|^2 + prices of slack,  and w_v |v_N|^2
    subject to  x_{k+1} = f(x_k, u_k),   u_min <= u_k <= u_max,   n_ik . (p_k - q_ik) >= margin - s_k

The state x is position and velocity. f knows mass, added mass and drag; an observer adds the acceleration that they do
not explain, such as by weight or current. Region i is its tangent plane where the plan before is nearest to it at stage
k; p_d is the point of the goal region nearest to the vehicle, `inset` within it, and m the moment that a PD controller
wants for the attitude. It looks no further than its horizon, so that it may wait behind a wall forever. As a script it
writes the folder runs/mpc.

    pip install ./fuzzy_arbiter '.[mpc]'
    cosim run docking --law examples/mpc.py:law --out runs/mpc
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import casadi as ca
import numpy as np

from controller import VehicleState
from controller.law import CompiledLaw, LawMemory, VehicleModel
from controller.quaternion import error, rotation_matrix
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, position_clearance
from cosim import load_scenario, run_scenario


class MpcGains(NamedTuple):
    """Chosen by hand for a BlueROV2."""

    stages: float = 14.0  # number of stages of the horizon
    interval: float = 0.35  # s, duration of a stage
    replan: float = 0.1  # s, between plans
    margin: float = 0.08  # m, kept from regions
    inset: float = 0.25  # m, depth within the goal region to aim at
    w_u: float = 0.1  # m, weight of the forces
    w_m: float = 5.0  # m, weight of the missing moment, in parts of what the thrusters give
    w_v: float = 4.0  # s2/m, weight of the last velocity
    hard: float = 1e3  # price of a meter within a hard region; a soft one costs a hundredth of it
    observer: float = 3.0  # rad/s, bandwidth of the observer
    k_p2: float = 4.0  # 1/s2, attitude
    k_v2: float = 4.0  # 1/s


class PredictiveLaw(CompiledLaw):
    """The law; `cosim run --law` makes it for the scenario's vehicle."""

    output = "thrusters"
    gains_type = MpcGains
    above_zero = ("stages", "interval", "replan", "observer")

    def __init__(
        self, vehicle: VehicleModel, gains: MpcGains, desired_quaternion: np.ndarray, period: float, n_regions: int
    ) -> None:
        self.gains, self.n_regions, self.n_forces = self.validate(gains), n_regions, vehicle.thrust_max.size
        self.memory = LawMemory(desired_quaternion=desired_quaternion, period=period)
        self.vehicle, self.mass = vehicle, np.diag(vehicle.rigid_mass + vehicle.added_mass)
        self.scale = np.maximum(vehicle.thrust_max, -vehicle.thrust_min)  # N
        self.moment_scale = np.abs(vehicle.thruster_matrix[3:]) @ self.scale + 1e-9  # N m
        self.position, self.velocity, self.unknown = np.full(3, np.nan), np.zeros(6), np.zeros(6)
        self.thrusts, self.steps, self.N = np.zeros(self.n_forces), 0, round(gains.stages)
        self.width = 6 + self.n_forces + 2  # numbers of a stage: x, u, and slack within hard and soft regions
        self.solver, self.plan = _make_solver(vehicle, gains, self.N, n_regions, self.scale), np.zeros(0)

    def step(
        self,
        state: VehicleState,
        goal: PackedRegions,
        regions: PackedRegions,
        weights: np.ndarray,
        forces: np.ndarray,
    ) -> None:
        """Write the thruster forces [N] of the plan, as `CompiledLaw.step`."""
        R, period = rotation_matrix(state.quaternion), self.memory.period
        self._observe(state, R, period)
        if self.steps % max(round(self.gains.replan / period), 1) == 0:
            self._replan(state, goal, regions, R)
        self.steps += 1
        forces[:] = self.plan[6 : 6 + self.n_forces] * self.scale
        lag = self.vehicle.thrust_time_constant
        self.thrusts += (1.0 - np.exp(-period / np.maximum(lag, 1e-9))) * (forces - self.thrusts)

    def _observe(self, state: VehicleState, R: np.ndarray, period: float) -> None:
        """Propagate position, velocity and unknown acceleration, linear ones NED, and correct them where measured."""
        measured = np.concatenate([R @ state.velocity_body[:3], state.velocity_body[3:]])
        known = np.isfinite(state.position).all() and np.isfinite(measured).all()
        if self.steps == 0 or np.isnan(self.position).any():
            self.position, self.velocity = state.position.copy(), measured
            return
        v, vehicle = np.concatenate([R.T @ self.velocity[:3], self.velocity[3:]]), self.vehicle
        drag = (vehicle.linear_damping + vehicle.quadratic_damping * np.abs(v)) * v
        a = (vehicle.thruster_matrix @ self.thrusts - drag) / self.mass
        a[:3] = R @ a[:3]
        self.position += period * self.velocity[:3]
        self.velocity += period * (a + self.unknown)
        if known:
            pole, innovation = 1.0 / (1.0 + self.gains.observer * period), measured - self.velocity
            self.position += (1.0 - pole) * (state.position - self.position)
            self.velocity += (1.0 - pole**2) * innovation
            self.unknown += (1.0 - pole) ** 2 / period * innovation

    def _replan(self, state: VehicleState, goal: PackedRegions, regions: PackedRegions, R: np.ndarray) -> None:
        N, width, m, gains = self.N, self.width, self.n_forces, self.gains
        if not self.plan.size:
            self.plan = np.tile(np.r_[self.position, np.zeros(width - 3)], N + 1)[: N * width + 6]
        path = np.vstack([self.plan[k * width : k * width + 3] for k in range(1, N + 1)])
        planes = np.zeros((N, self.n_regions, 5))  # normal towards where the region is satisfied, offset [m], 1 if hard
        normal = np.zeros(3)
        for i in range(self.n_regions):
            for k, place in enumerate(path):
                clearance = _clearance(regions, i, place - (k + 1) * gains.interval * regions.velocities[i], normal)
                planes[k, i] = *normal, clearance - normal @ place, regions.hard[i]
        inset = gains.inset - _clearance(goal, 0, self.position, normal)
        e_att = error(self.desired_quaternion, state.quaternion)[1:]
        moment = -self.mass[3:] * (gains.k_p2 * e_att + gains.k_v2 * self.velocity[3:] + self.unknown[3:])
        works = state.thruster_health > 0.0
        low, high = np.full(self.plan.size, -np.inf), np.full(self.plan.size, np.inf)
        low[:6] = high[:6] = np.r_[self.position, self.velocity[:3]]
        for k in range(N):
            u = slice(k * width + 6, k * width + 6 + m)
            low[u], high[u] = works * self.vehicle.thrust_min / self.scale, works * self.vehicle.thrust_max / self.scale
            low[u.stop : u.stop + 2] = 0.0
        p = [*R.T.ravel(), *self.unknown[:3], *(self.position + max(inset, 0.0) * normal)]
        p += [*(moment / self.moment_scale), *planes.ravel()]
        rows = 6 + self.n_regions
        lower, upper = np.zeros((N, rows)), np.zeros((N, rows))
        upper[:, 6:] = np.inf
        solution = self.solver(x0=self.plan, p=p, lbx=low, ubx=high, lbg=lower.ravel(), ubg=upper.ravel())["x"]
        if self.solver.stats()["success"]:  # else the plan before goes on
            self.plan = np.clip(solution.full().ravel(), low, high)


def _clearance(regions: PackedRegions, i: int, place: np.ndarray, normal: np.ndarray) -> float:
    """Return the distance [m] to where region i is violated, and write the direction in which it grows."""
    normal[:] = 0.0  # stays so for a region of attitude: a plan is of positions
    return position_clearance(regions, i, place, normal) if regions.kinds[i] < FIRST_OF_ATTITUDE else 0.0


def _make_solver(vehicle: VehicleModel, gains: MpcGains, N: int, n: int, scale: np.ndarray) -> ca.Function:
    """Return the solver of a plan."""
    B, mass = vehicle.thruster_matrix, (vehicle.rigid_mass + vehicle.added_mass)[:3, :3]
    m, moment_scale = scale.size, np.abs(B[3:]) @ scale + 1e-9
    R, unknown, target, moment = ca.SX.sym("R", 3, 3), *(ca.SX.sym(name, 3) for name in ("d", "p_d", "m"))
    planes = ca.SX.sym("planes", 5, N * n)
    linear, quadratic = vehicle.linear_damping[:3], vehicle.quadratic_damping[:3]

    def f(x: ca.SX, u: ca.SX) -> ca.SX:
        v = R.T @ x[3:]
        force = B[:3] @ (scale * u) - (linear + quadratic * ca.sqrt(v * v + 1e-4)) * v
        return ca.vertcat(x[3:], R @ (np.linalg.inv(mass) @ force) + unknown)

    h, x, cost = gains.interval, ca.SX.sym("x0", 6), ca.SX(0)
    variables, rows = [x], []
    for k in range(N):
        u, s, following = ca.SX.sym(f"u{k}", m), ca.SX.sym(f"s{k}", 2), ca.SX.sym(f"x{k + 1}", 6)
        k1 = f(x, u)
        k2 = f(x + h / 2.0 * k1, u)
        k3 = f(x + h / 2.0 * k2, u)
        rows += [following - x - h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + f(x + h * k3, u))]
        x, missing, away = following, B[3:] @ (scale * u) / moment_scale - moment, following[:3] - target
        cost += ca.sqrt(ca.dot(away, away) + 0.01) + gains.w_u * ca.dot(u, u) + gains.w_m * ca.dot(missing, missing)
        cost += gains.hard * (s[0] + 0.01 * s[1] + s[0] ** 2)
        for i in range(n):
            plane = planes[:, k * n + i]
            clearance = ca.dot(plane[:3], x[:3]) + plane[3] - gains.margin * ca.sumsqr(plane[:3])
            rows += [clearance + plane[4] * s[0] + (1.0 - plane[4]) * s[1]]
        variables += [u, s, x]
    cost += gains.w_v * ca.dot(x[3:], x[3:])
    parameters = ca.vertcat(ca.vec(R), unknown, target, moment, ca.vec(planes))
    problem = {"x": ca.vertcat(*variables), "p": parameters, "f": cost, "g": ca.vertcat(*rows)}
    ipopt = {"print_level": 0, "sb": "yes", "max_iter": 100, "tol": 1e-3, "mu_init": 1e-2}
    return ca.nlpsol("plan", "ipopt", problem, {"print_time": False, "error_on_fail": False, "ipopt": ipopt})


law = PredictiveLaw

if __name__ == "__main__":
    run = run_scenario(load_scenario("harbour", ["time.duration=25"]), Path("runs/mpc"), law=f"{__file__}:law")
    print(f"in the goal after {run.summary['reach_time']:.1f} s, at most {run.summary['max_force_asked']:.0f} N")
