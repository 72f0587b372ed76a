"""A current that grows and turns with depth, as an FMU: for hanging.toml, built by pythonfmu."""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

PARAMETERS = {
    "surface_speed": 0.1,  # m/s
    "shear": 0.04,  # 1/s, growth of the speed with depth
    "turn": 0.1,  # rad/m, of the direction, which is north at the surface
    "rise_time": 10.0,  # s, time constant with which the current sets in
}


class Current(Fmi2Slave):
    """Velocity of the water in the world frame NED, and its rate where the vehicle is."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.depth, self.before = 0.0, 0.0
        self.velocity_x = self.velocity_y = self.rate_x = self.rate_y = 0.0
        self.register_variable(Real("depth", causality=Fmi2Causality.input, start=0.0))
        for name in ("velocity_x", "velocity_y", "rate_x", "rate_y"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        for name, value in PARAMETERS.items():
            setattr(self, name, value)
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed, start=value)
            )

    def do_step(self, current_time, step_size):
        """Write the current at the end of the step."""
        remaining = math.exp(-(current_time + step_size) / self.rise_time)
        share, growth = 1.0 - remaining, remaining / self.rise_time
        speed = self.surface_speed + self.shear * self.depth
        cosine, sine = math.cos(self.turn * self.depth), math.sin(self.turn * self.depth)
        sinking = (self.depth - self.before) / step_size
        self.before = self.depth
        self.velocity_x, self.velocity_y = share * speed * cosine, share * speed * sine
        along, across = share * self.shear * sinking + growth * speed, share * speed * self.turn * sinking
        self.rate_x = along * cosine - across * sine
        self.rate_y = along * sine + across * cosine
        return True
