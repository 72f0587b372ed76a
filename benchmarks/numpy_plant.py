"""The plant of the odin vehicle in NumPy, for an FMU of pythonfmu, with which the C core is compared."""

import numpy as np
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

from benchmarks.peers.numpy_body import Body
from benchmarks.vehicle_numbers import vehicle_numbers

STATES = [
    *(f"position.{a}" for a in "xyz"),
    *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{a}" for a in "uvwpqr"),
]
SUBSTEP = 0.005  # s, maximum integration step, that of the FMU


class NumpyPlant(Fmi2Slave):
    """`Body` as an FMU, without current and lag, which odin does not have."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.body = Body(vehicle_numbers("odin"))
        n_thrusters = self.body.thrust_min.size
        self.thrust, self.wrench = np.zeros(n_thrusters), np.zeros(6)
        for i in range(n_thrusters):
            self._input(f"thrust[{i + 1}]", self.thrust, i)
        for i, name in enumerate("XYZKMN"):
            self._input(f"wrench.{name}", self.wrench, i)
        for i, name in enumerate(STATES):
            self._output(name, lambda i=i: float(self.body.state[i]))
        for i in range(n_thrusters):
            self._output(f"thrust_actual[{i + 1}]", lambda i=i: float(self.body.limited(self.thrust)[i]))
            saturated = f"thrust_saturated[{i + 1}]"
            self._output(saturated, lambda i=i: bool(self.body.limited(self.thrust)[i] != self.thrust[i]), Boolean)

    def _input(self, name, values, i):
        def set_value(value):
            values[i] = value

        kind = {"causality": Fmi2Causality.input, "variability": Fmi2Variability.continuous}
        self.register_variable(Real(name, **kind, getter=lambda: float(values[i]), setter=set_value, start=0.0))

    def _output(self, name, getter, kind=Real):
        variability = Fmi2Variability.continuous if kind is Real else Fmi2Variability.discrete
        self.register_variable(kind(name, causality=Fmi2Causality.output, variability=variability, getter=getter))

    def do_step(self, current_time, step_size):
        """Advance by whole substeps with constant commands."""
        n = max(1, int(np.ceil(step_size / SUBSTEP - 1e-9)))
        tau = self.body.tau(self.thrust, self.wrench)
        for _ in range(n):
            self.body.step(tau, step_size / n)
        return True
