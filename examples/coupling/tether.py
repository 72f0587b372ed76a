"""A tether from an anchor to a point of the body, as an FMU: for hanging.toml, built by pythonfmu."""

from math import sqrt

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

POSE = ("position_x", "position_y", "position_z", "e0", "e1", "e2", "e3")
VELOCITY = ("u", "v", "w", "p", "q", "r")
PARAMETERS = {
    "anchor_x": 0.0, "anchor_y": 0.0, "anchor_z": -1.0,  # m, world frame NED
    "point_x": -0.25, "point_y": 0.0, "point_z": -0.2,  # m, body frame
    "length": 6.0,  # m, at which it gets taut
    "stiffness": 200.0,  # N/m
    "damping": 100.0,  # N s/m
}  # fmt: skip


def cross(a, b):
    """Return the cross product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


class Tether(Fmi2Slave):
    """Force on the body in the world frame: a spring and a damper that only pull."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for name in (*POSE, *VELOCITY):
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.input, start=0.0))
        for name in ("force_x", "force_y", "force_z"):
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        for axis in "xyz":  # the plant needs it too
            setattr(self, f"acts_{axis}", PARAMETERS[f"point_{axis}"])
            self.register_variable(Real(f"acts_{axis}", causality=Fmi2Causality.output))
        for name, value in PARAMETERS.items():
            setattr(self, name, value)
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed, start=value)
            )

    def to_world(self, a):
        """Rotate a vector of the body frame to the world by the quaternion."""
        twice = [2.0 * x for x in cross([self.e1, self.e2, self.e3], a)]
        again = cross([self.e1, self.e2, self.e3], twice)
        return [x + self.e0 * y + z for x, y, z in zip(a, twice, again, strict=True)]

    def do_step(self, current_time, step_size):
        """Write the force at the pose and velocity of the inputs."""
        point = [self.point_x, self.point_y, self.point_z]
        place = [self.position_x, self.position_y, self.position_z]
        anchor = [self.anchor_x, self.anchor_y, self.anchor_z]
        turning = cross([self.p, self.q, self.r], point)
        speed = self.to_world([x + y for x, y in zip([self.u, self.v, self.w], turning, strict=True)])
        line = [a + b - c for a, b, c in zip(place, self.to_world(point), anchor, strict=True)]
        distance = sqrt(sum(x * x for x in line))
        tension = 0.0
        if distance > self.length:
            lengthening = sum(x * y for x, y in zip(line, speed, strict=True)) / distance
            tension = max(0.0, self.stiffness * (distance - self.length) + self.damping * lengthening)
        self.force_x, self.force_y, self.force_z = (-tension * x / distance if tension else 0.0 for x in line)
        self.acts_x, self.acts_y, self.acts_z = point
        return True
