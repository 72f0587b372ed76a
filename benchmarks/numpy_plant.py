"""The plant of the odin vehicle once more, in NumPy, for an FMU of pythonfmu: what the C core is measured against."""

import numpy as np
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

from plant_fmu import load_vehicle

STATES = [
    *(f"position.{a}" for a in "xyz"),
    *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{a}" for a in "uvwpqr"),
]
SUBSTEP = 0.005  # s, as in the FMU


def skew(a):
    """Return the matrix of the cross product from the left."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def coriolis(momentum):
    """Return C(v) of a linear and an angular momentum (Fossen 2011, theorem 3.2)."""
    C = np.zeros((6, 6))
    C[:3, 3:] = C[3:, :3] = -skew(momentum[:3])
    C[3:, 3:] = -skew(momentum[3:])
    return C


class NumpyPlant(Fmi2Slave):
    """Fossen's equations without current and lag, which odin has none of, by Runge-Kutta of order four."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.vehicle = v = load_vehicle("odin")
        m, S = v.mass, skew(v.r_G)
        self.M_RB = np.block([[m * np.eye(3), -m * S], [m * S, v.inertia]])
        self.M_inverse = np.linalg.inv(self.M_RB + v.added_mass)
        self.state = np.zeros(13)
        self.state[3] = 1.0
        self.thrust, self.wrench = np.zeros(v.n_thrusters), np.zeros(6)
        for i in range(v.n_thrusters):
            self._input(f"thrust[{i + 1}]", self.thrust, i)
        for i, name in enumerate("XYZKMN"):
            self._input(f"wrench.{name}", self.wrench, i)
        for i, name in enumerate(STATES):
            self._output(name, lambda i=i: float(self.state[i]))
        for i in range(v.n_thrusters):
            self._output(f"thrust_actual[{i + 1}]", lambda i=i: float(self.limited()[i]))
            self._output(f"thrust_saturated[{i + 1}]", lambda i=i: bool(self.limited()[i] != self.thrust[i]), Boolean)

    def _input(self, name, values, i):
        def set_value(value):
            values[i] = value

        kind = {"causality": Fmi2Causality.input, "variability": Fmi2Variability.continuous}
        self.register_variable(Real(name, **kind, getter=lambda: float(values[i]), setter=set_value, start=0.0))

    def _output(self, name, getter, kind=Real):
        variability = Fmi2Variability.continuous if kind is Real else Fmi2Variability.discrete
        self.register_variable(kind(name, causality=Fmi2Causality.output, variability=variability, getter=getter))

    def limited(self):
        """Return the forces of the thrusters [N]."""
        return np.clip(self.thrust, self.vehicle.thrust_min, self.vehicle.thrust_max)

    def rate(self, state, tau):
        """Return the time derivative of the state under a body wrench."""
        v, e, nu = self.vehicle, state[3:7], state[7:]
        S = skew(e[1:])
        R = np.eye(3) + 2.0 / (e @ e) * (e[0] * S + S @ S)
        turn = 0.5 * np.vstack([-e[1:], e[0] * np.eye(3) + S])
        k = R[2]  # down, seen from the body
        restoring = np.concatenate([(v.weight - v.buoyancy) * k, np.cross(v.r_G * v.weight - v.r_B * v.buoyancy, k)])
        damping = (v.linear_damping + v.quadratic_damping * np.abs(nu)) * nu
        C = coriolis(self.M_RB @ nu) + coriolis(v.added_mass @ nu)
        return np.concatenate([R @ nu[:3], turn @ nu[3:], self.M_inverse @ (tau - C @ nu - damping + restoring)])

    def do_step(self, current_time, step_size):
        """Advance by whole substeps, the commands being held."""
        n = max(1, int(np.ceil(step_size / SUBSTEP - 1e-9)))
        h = step_size / n
        tau = self.wrench + self.vehicle.thruster_matrix @ self.limited()
        for _ in range(n):
            k1 = self.rate(self.state, tau)
            k2 = self.rate(self.state + 0.5 * h * k1, tau)
            k3 = self.rate(self.state + 0.5 * h * k2, tau)
            k4 = self.rate(self.state + h * k3, tau)
            self.state += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
            self.state[3:7] /= np.linalg.norm(self.state[3:7])
        return True
