"""A sequence of law inputs: all shapes, noise, gaps, unusual weights and failures."""

import numpy as np

from controller import LAWS, VehicleState
from controller.regions import (
    Box,
    Cone,
    Cylinder,
    DepthBand,
    Ellipsoid,
    HalfSpace,
    Orientation,
    Pipe,
    Prism,
    Region,
    Sphere,
    Visibility,
    pack,
)
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu import load_vehicle

TURNED = (0.9, 0.1, -0.3, 0.2)
REGIONS = [
    Region("sphere", Sphere((2.0, 0.0, 2.0), 0.5), "out"),
    Region("band", DepthBand(2.5, 2.0), "in"),
    Region("box", Box((5.0, 2.0, 2.0), (1.0, 1.0, 1.0), TURNED), "out"),
    Region("cylinder", Cylinder((3.0, 3.0, 0.0), (3.0, 3.0, 4.0), 0.4), "out"),
    Region("ellipsoid", Ellipsoid((4.0, -3.0, 2.0), (1.0, 0.5, 0.7), TURNED), "out"),
    Region("prism", Prism(((6.0, -2.0), (8.0, -2.0), (7.0, 0.0)), 1.0, 3.0), "out"),
    Region("cone", Cone((1.0, 4.0, 2.0), (0.0, 1.0, 0.1), 0.4, 2.0), "out"),
    Region("pipe", Pipe(((0.0, -4.0, 3.0), (3.0, -4.0, 3.0), (5.0, -6.0, 3.0)), 0.3), "out"),
    Region("half space", HalfSpace((12.0, 0.0, 0.0), (1.0, 0.2, 0.0)), "in"),
    Region("heading", Orientation((0.9, 0.1, -0.1, 0.2), 1.2), "in"),
    Region("view", Visibility((6.0, 3.0, 4.0), (1.0, 0.3, 0.2), 1.4), "in"),
    Region("room", Box((4.0, 0.0, 2.0), (14.0, 9.0, 4.0)), "in"),
    Region("soft", Sphere((7.0, 1.0, 2.0), 0.4), "out", (-0.1, 0.0, 0.0), 20.0, hard=False),
]
GOAL = Region("goal", Sphere((9.0, 0.0, 2.0), 0.5), "in")
PERIOD = 0.02
VEHICLE = load_vehicle("bluerov2_heavy")


class Flight:
    """Arguments of a law's step, whose numbers change from step to step as the seed has it."""

    def __init__(self, law, seed=0):
        kind = LAWS[law]
        self.function, self.n_thrusters = kind.function, VEHICLE.n_thrusters
        own = kind.for_vehicle(vehicle_model(VEHICLE), kind.gains_type(), [1.0, 0.0, 0.0, 0.0], PERIOD, len(REGIONS))
        self.gains, self.memory = own.gains, own.memory
        self.state = VehicleState(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(6), np.ones(self.n_thrusters))
        self.goal, self.regions, self.weights = pack([GOAL]), pack(REGIONS), np.ones(len(REGIONS))
        self.forces = np.zeros(self.n_thrusters if kind.output == "thrusters" else 6)
        self._rng, self._step = np.random.default_rng(seed), 0
        self._position, self._velocity = np.array([0.0, 0.0, 2.0]), np.zeros(3)

    @property
    def arguments(self):
        return (self.state, self.goal, self.regions, self.weights, self.gains, self.memory, self.forces)

    def advance(self):
        """Make what the next step is given."""
        rng, k, state = self._rng, self._step, self.state
        self._velocity = 0.98 * self._velocity + 0.006 * rng.normal(size=3)
        towards = np.array([9.0, 0.0, 2.0]) - self._position
        self._position = self._position + PERIOD * self._velocity + 4e-4 * towards
        if k % 1000 == 999:
            self._position = rng.uniform([-1.0, -5.0, 0.5], [10.0, 5.0, 4.0])
        quaternion = state.quaternion + 0.01 * rng.normal(size=4)
        state.quaternion[:] = quaternion / np.linalg.norm(quaternion)
        state.position[:] = self._position + 0.01 * rng.normal(size=3)
        state.velocity_body[:] = np.r_[self._velocity + 0.005 * rng.normal(size=3), 0.1 * rng.normal(size=3)]
        self.weights[:] = rng.uniform(size=len(self.weights))
        odd = rng.integers(200)
        if odd == 0:
            state.position[rng.integers(3)] = rng.choice([np.nan, np.inf, -np.inf, 1e300])
        elif odd == 1:
            self.weights[rng.integers(len(self.weights))] = rng.choice([np.nan, -1.0, 2.0])
        if 100 < k % 700 < 140:  # longer than the law coasts in some laps
            state.position[:] = np.nan
        if k % 3000 == 1500:
            state.thruster_health[rng.integers(self.n_thrusters)] = rng.integers(2)
        self.regions.move_to(k * PERIOD)
        self._step += 1


def arrays_of(value):
    """Yield the arrays of a named tuple of named tuples."""
    if isinstance(value, tuple):
        for item in value:
            yield from arrays_of(item)
    elif isinstance(value, np.ndarray):
        yield value


def same_bits(one, other):
    """Whether two named tuples, or arrays, hold the same bits; of NaN there are many, and all are the same here."""
    for a, b in zip(arrays_of(one), arrays_of(other), strict=True):
        if a.tobytes() != b.tobytes() and not (
            a.dtype == float
            and np.array_equal(np.isnan(a), np.isnan(b))
            and np.nan_to_num(a).tobytes() == np.nan_to_num(b).tobytes()
        ):
            return False
    return True
