"""A vehicle and a scene for the tests of the deployable law, with a plant that is not the FMU."""

import numpy as np

from controller import LAWS, VehicleState
from controller.laws.deployable.model import (
    Dynamics,
    Loads,
    free_acceleration,
    make_dynamics,
    make_thrusters,
    thrust_acceleration,
)
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


RIGHTING = np.array([0.0, 0.0, 30.0])  # N m, phi_2..phi_4 of the sea's vehicle


class Sea:
    """ODIN in a steady current, integrated in small steps by the law's own model: what is tested is what the law does
    with it. Its thrusters may lag, come late by some periods (`delay`), lose part of their force (`left`), have
    lower limits (`limit`, a part of the model's), or be stuck at a force."""

    def __init__(self, current=(0.1, -0.15, 0.0), restoring=-8.0, noise=(0.0, 0.0), lag=0.0, seed=0, delay=0):
        self.dynamics, self.thrusters = make_dynamics(ODIN, np.ones(9)), make_thrusters(ODIN)
        self.current, self.net_weight, self.noise, self.lag = np.array(current), restoring, noise, lag
        self.left, self.limit, self.stuck, self.given = np.ones(8), np.ones(8), np.full(8, np.nan), np.zeros(8)
        self.position, self.quaternion = np.array([0.0, 0.0, 2.5]), LEVEL.copy()
        self.velocity, self.omega = np.zeros(3), np.zeros(3)
        self.rng, self.late = np.random.default_rng(seed), [np.zeros(8)] * delay

    def measured(self):
        place, speed = self.noise
        body = rotation_matrix(self.quaternion).T @ self.velocity + speed * self.rng.normal(size=3)
        position = self.position + place * self.rng.normal(size=3)
        return VehicleState(position, self.quaternion.copy(), np.r_[body, self.omega], np.ones(8))

    def step(self, forces, period, substeps=4):
        self.late.append(forces.copy())
        within = np.clip(self.late.pop(0), self.limit * ODIN.thrust_min, self.limit * ODIN.thrust_max)
        commanded = np.where(np.isnan(self.stuck), within, self.stuck)
        h = period / substeps
        for _ in range(substeps):
            remains = np.exp(-h / self.lag) if self.lag else 0.0
            self.given = commanded + remains * (self.given - commanded)
            R = rotation_matrix(self.quaternion)
            loads = Loads(self.current, self.net_weight, RIGHTING, 0.0, 1.0)
            free = free_acceleration(self.dynamics, R, self.velocity, self.omega, loads)
            pushed = thrust_acceleration(self.dynamics, self.thrusters, R, self.given * self.left)
            self.position += h * self.velocity
            self.velocity += h * (free + pushed)[:3]
            self.quaternion += h * rate(self.quaternion, self.omega)
            self.quaternion /= np.linalg.norm(self.quaternion)
            self.omega += h * (free + pushed)[3:]


def askew(rng):
    """Return a model of which nothing is symmetric."""
    root = rng.normal(size=(6, 6))
    mass = root @ root.T + np.diag([90.0, 80.0, 70.0, 9.0, 8.0, 7.0])
    damping, braking = rng.uniform(1.0, 30.0, (2, 6)), rng.uniform(0.1, 0.4, 9)
    return Dynamics(
        mass, np.linalg.inv(mass), *damping, np.zeros(6), float(np.trace(mass[:3, :3])) / 3.0, 70.0, braking
    )


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
