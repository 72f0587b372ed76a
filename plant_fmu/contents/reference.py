"""Reference results: a maneuver of all six degrees of freedom, integrated apart from the FMU."""

# The C core is not used; only the vehicle's numbers are shared. Fossen's equations are here in matrix form and in the
# velocity relative to the water, in which a steady current drops out of them (Fossen 2011, Property 8.1); attitude is a
# rotation matrix, C(ν) does not depend on the linear velocity, and the integrator is DOP853 of SciPy with error
# control.

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]

HOLD, INTERVAL = 1.0, 0.2  # s: time for which a command is held, and time between rows of the results

STATES = (
    *(f"position.{a}" for a in "xyz"),
    *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{a}" for a in "uvwpqr"),
)
COLUMNS = ("time", *STATES, "attitude.roll", "attitude.pitch", "attitude.yaw")

# moving and turning at the start, in a current; well below the surface
START = dict(zip(STATES, (0.0, 0.0, 10.0, 0.96, 0.0, 0.0, 0.28, 0.2, -0.1, 0.05, 0.05, -0.04, 0.1), strict=True))
_START_QUATERNION = np.array([START[f"quaternion.e{i}"] for i in range(4)])
CURRENT = {"current.x": 0.3, "current.y": -0.2, "current.z": 0.05}  # m/s, world frame

# Command of each axis in each second: an amount of either sign, or nothing. The thrusters follow it unchanged,
# the wrench input backwards and by half. Moments sum up to nothing: not every vehicle rights itself.
_TABLE = {
    "X": "+++00000----++++",
    "Y": "0+++000---00++--",
    "Z": "00++000--0++0--+",
    "K": "+--+000+--+-++-0",
    "M": "0+--+0000-++-+-0",
    "N": "00+--00++--+0+-0",
}
_FORCE = 0.25  # commanded force, as a fraction of the maximum that the thrusters give
_ANGULAR_ACCELERATION = 0.6  # rad/s2, effect of a commanded moment on a vehicle at rest
_FULL_AHEAD, _OVERDRIVE = 6, 1.2  # second in which the command is beyond the thrusters' limits; by which factor

RATE_LIMITED_LAG = 1e-3  # s, the minimum time constant of a thruster with a rate limit, as the plant defines it


@dataclass(frozen=True)
class Reference:
    """A maneuver and its results."""

    input_names: tuple[str, ...]  # names of the columns of `inputs` after the time
    inputs: Array  # (rows, 1 + inputs), time [s] and inputs [N, N m]; two rows of one time are a jump
    results: Array  # (rows, 17), a column for each of COLUMNS


def reference(vehicle: Vehicle) -> Reference:
    """Compute the reference results of a vehicle."""
    from scipy.integrate import solve_ivp  # half a second, and needed for nothing else

    names, commands = _commands(vehicle)
    plant = _Plant(vehicle)
    y = plant.start()
    rows = [np.concatenate(([0.0], plant.outputs(y, _START_QUATERNION)))]
    for k, command in enumerate(commands):
        plant.command(command)
        times = HOLD * k + np.linspace(INTERVAL, HOLD, round(HOLD / INTERVAL))
        span = (HOLD * k, HOLD * (k + 1))
        solution = solve_ivp(plant.rate, span, y, method="DOP853", t_eval=times, rtol=1e-12, atol=1e-12)
        for t, column in zip(times, solution.y.T, strict=True):
            rows.append(np.concatenate(([t], plant.outputs(column, rows[-1][4:8]))))
        y = solution.y[:, -1]
    return Reference(names, _jumps(commands), np.array(rows))


def _commands(vehicle: Vehicle) -> tuple[tuple[str, ...], Array]:
    """Return names and values of the inputs, a row for each time in which they are held."""
    names = (*(f"thrust[{i + 1}]" for i in range(vehicle.n_thrusters)), *(f"wrench.{a}" for a in _TABLE))
    signs = np.array([[{"-": -1.0, "0": 0.0, "+": 1.0}[c] for c in row] for row in _TABLE.values()]).T
    max_wrench = np.abs(vehicle.thruster_matrix) @ np.maximum(-vehicle.thrust_min, vehicle.thrust_max)
    amount = np.concatenate((_FORCE * max_wrench[:3], _ANGULAR_ACCELERATION * np.diag(vehicle.mass_matrix)[3:]))
    allocation = np.linalg.pinv(vehicle.thruster_matrix)

    thrusts = (amount * signs) @ allocation.T
    surge = allocation[:, 0]
    limits = np.where(surge > 0.0, vehicle.thrust_max, vehicle.thrust_min)
    saturation = np.max(np.divide(surge, limits, out=np.zeros_like(surge), where=limits != 0.0))
    if saturation > 0.0:
        thrusts[_FULL_AHEAD] = _OVERDRIVE / saturation * surge
    # rounded, so that the numbers in the file are those that were integrated, whatever library found the pseudo-inverse
    return names, np.round(np.hstack((thrusts, 0.5 * amount * signs[::-1])), 3) + 0.0


def _jumps(commands: Array) -> Array:
    """Return the rows of an input file: each command at the start and at the end of its time."""
    edges = HOLD * np.arange(len(commands) + 1)
    times = np.column_stack((edges[:-1], edges[1:])).ravel()
    return np.column_stack((times, np.repeat(commands, 2, axis=0)))


def _skew(a: Array) -> Array:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


class _Plant:
    """State: position 3, rotation matrix 9 (row by row), velocity through the water 6, thrusts n."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle, self.n = vehicle, vehicle.n_thrusters
        self.current = np.array(list(CURRENT.values()))
        self.inverse = np.linalg.inv(vehicle.mass_matrix)
        self.lag = vehicle.thrust_time_constant.copy()
        limited = vehicle.thrust_rate_limit > 0.0
        self.lag[limited] = np.maximum(self.lag[limited], RATE_LIMITED_LAG)
        self.rate_limit = np.where(limited, vehicle.thrust_rate_limit, np.inf)
        self.target = np.zeros(self.n)
        self.wrench = np.zeros(6)

    def start(self) -> Array:
        from scipy.spatial.transform import Rotation

        R = Rotation.from_quat(np.roll(_START_QUATERNION, -1)).as_matrix()  # SciPy has the scalar last
        nu = np.array([START[f"velocity.{a}"] for a in "uvwpqr"])
        nu[:3] -= R.T @ self.current
        position = [START[f"position.{a}"] for a in "xyz"]
        return np.concatenate((position, R.ravel(), nu, np.zeros(self.n)))

    def command(self, command: Array) -> None:
        """Take a row of commands: thrusts within their limits and after their curve, the wrench as it is."""
        v = self.vehicle
        limited = np.clip(command[: self.n], v.thrust_min, v.thrust_max)
        limit = np.where(limited < 0.0, v.thrust_min, v.thrust_max)
        fraction = np.divide(limited, limit, out=np.zeros(self.n), where=limit != 0.0)
        active = np.maximum(0.0, (fraction - v.thrust_dead_band) / (1.0 - v.thrust_dead_band))
        self.target = limit * ((1.0 - v.thrust_curve) * active + v.thrust_curve * active**2)
        self.wrench = command[self.n :]

    def rate(self, _: float, y: Array) -> Array:
        v = self.vehicle
        R, nu, thrust = y[3:12].reshape(3, 3), y[12:18], y[18:]
        velocity, omega = nu[:3], nu[3:]

        lags = self.lag > 0.0
        gap = np.divide(self.target - thrust, self.lag, out=np.zeros(self.n), where=lags)
        forces = np.where(lags, thrust, self.target)
        tau = v.thruster_matrix @ forces + self.wrench

        # C of (Fossen 2011, 3.57), which does not depend on the linear velocity, and of (6.43)
        m, S, S_G = v.mass, _skew(omega), _skew(v.r_G)
        rigid = np.block([[m * S, -m * S @ S_G], [m * S_G @ S, -_skew(v.inertia @ omega)]])
        linear, angular = (v.added_mass @ nu)[:3], (v.added_mass @ nu)[3:]
        added = np.block([[np.zeros((3, 3)), -_skew(linear)], [-_skew(linear), -_skew(angular)]])
        damping = np.diag(v.linear_damping + v.quadratic_damping * np.abs(nu))

        # weight and buoyancy, forces of the world that act at two points of the body (Fossen 2011, 4.5)
        down = R.T @ np.array([0.0, 0.0, 1.0])
        f_G, f_B = v.weight * down, -v.buoyancy * down
        g = -np.concatenate((f_G + f_B, np.cross(v.r_G, f_G) + np.cross(v.r_B, f_B)))

        acceleration = self.inverse @ (tau + v.trim - (rigid + added + damping) @ nu - g)
        rates = np.clip(gap, -self.rate_limit, self.rate_limit)
        return np.concatenate((R @ velocity + self.current, (R @ S).ravel(), acceleration, rates))

    def outputs(self, y: Array, before: Array) -> Array:
        """Return the columns after the time; of the two quaternions of an attitude, the one near that before."""
        from scipy.spatial.transform import Rotation

        R = y[3:12].reshape(3, 3)
        rotation = Rotation.from_matrix(R)
        quaternion = np.roll(rotation.as_quat(), 1)
        if quaternion @ before < 0.0:
            quaternion = -quaternion
        over_ground = y[12:18] + np.concatenate((R.T @ self.current, np.zeros(3)))
        yaw_pitch_roll = rotation.as_euler("ZYX")
        return np.concatenate((y[:3], quaternion, over_ground, yaw_pitch_roll[::-1]))
