"""A vehicle and a scene for the tests of the deployable law, with a plant that is not the FMU."""

import numpy as np

from controller import LAWS, VehicleState
from controller.laws.deployable.model import free_acceleration, make_dynamics, make_thrusters, thrust_acceleration
from controller.quaternion import rate, rotation_matrix
from controller.regions import DepthBand, Region, Sphere, pack
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu.vehicle import load_vehicle

LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
MODELS = {name: vehicle_model(load_vehicle(name)) for name in ("odin", "bluerov2_heavy")}
ODIN = MODELS["odin"]
GOAL = Region("goal", Sphere((8.0, 0.5, 2.5), 0.5), "in")
REGIONS = [
    Region("ball", Sphere((4.0, 0.2, 2.4), 0.7), "out"),
    Region("drifting", Sphere((5.5, -1.0, 2.2), 0.5), "out", (-0.05, 0.06, 0.0)),
    Region("band", DepthBand(3.65, 3.35), "in"),
]


class Sea:
    """ODIN in a steady current, integrated in small steps by the law's own model: what is tested is what the law does
    with it. The wrench of a failed thruster is missing."""

    def __init__(self, current=(0.1, -0.15, 0.0), restoring=-8.0, noise=(0.0, 0.0), failed=-1, seed=0):
        self.dynamics, self.thrusters = make_dynamics(ODIN, np.ones(9)), make_thrusters(ODIN)
        self.current, self.net_weight, self.noise, self.failed = np.array(current), restoring, noise, failed
        self.position, self.quaternion = np.array([0.0, 0.0, 2.5]), LEVEL.copy()
        self.velocity, self.omega = np.zeros(3), np.zeros(3)
        self.rng = np.random.default_rng(seed)

    def measured(self):
        place, speed = self.noise
        body = rotation_matrix(self.quaternion).T @ self.velocity + speed * self.rng.normal(size=3)
        position = self.position + place * self.rng.normal(size=3)
        return VehicleState(position, self.quaternion.copy(), np.r_[body, self.omega], np.ones(8))

    def step(self, forces, period, substeps=4):
        given = forces.copy()
        if self.failed >= 0:
            given[self.failed] = 0.0
        h = period / substeps
        for _ in range(substeps):
            R, free, pushed = rotation_matrix(self.quaternion), np.empty(3), np.empty(6)
            free_acceleration(self.dynamics, R, self.velocity, self.omega, self.current, self.net_weight, free)
            thrust_acceleration(self.dynamics, self.thrusters, R, given, pushed)
            drag = (ODIN.linear_damping[3:] + ODIN.quadratic_damping[3:] * abs(self.omega)) * self.omega
            righting = 30.0 * np.cross(R[2], [0.0, 0.0, 1.0])  # N m, back to level
            self.position += h * self.velocity
            self.velocity += h * (free + pushed[:3])
            self.quaternion += h * rate(self.quaternion, self.omega)
            self.quaternion /= np.linalg.norm(self.quaternion)
            self.omega += h * (pushed[3:] + (righting - drag) / np.diag(ODIN.rigid_mass + ODIN.added_mass)[3:])


def law_for(regions, gains=None, period=0.02):
    kind = LAWS["deployable"]
    return kind.for_vehicle(ODIN, gains or kind.gains_type(), LEVEL, period, len(regions))


def fly(law, sea, goal=GOAL, regions=REGIONS, steps=100, first=0, period=0.02, change=None, each=None):
    """Fly some steps, and return the forces of each; `change` may falsify what is measured."""
    goal, packed, weights = pack([goal]), pack(regions), np.ones(len(regions))
    forces, rows = np.zeros(8), []
    for k in range(first, first + steps):
        goal.move_to(k * period)
        packed.move_to(k * period)
        state = sea.measured()
        if change:
            state = change(k * period, state)
        law.step(state, goal, packed, weights, forces)
        rows.append(forces.copy())
        if each:
            each(k * period)
        sea.step(forces, period)
    return np.array(rows)
