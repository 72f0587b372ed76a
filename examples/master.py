"""A co-simulation master in one page: the plant's FMU, the fuzzy arbiter and the adaptive controller, step by step."""

import numpy as np

from controller import Gains, IsmailDunniganLaw, VehicleState
from controller.regions import Region, Sphere, pack
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.criteria import ramp
from plant_fmu import Plant

STEP, DURATION = 0.01, 30.0
GOAL = Region("goal", Sphere((3.0, 0.0, 2.0), 0.5), keep="in")
ROCK = Region("rock", Sphere((1.5, 0.2, 1.5), 0.4), keep="out", gain=500.0)

goal, rocks = pack([GOAL]), pack([ROCK])
value, gradient, turning, clearance = np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(1)
arbiter = Arbiter()
law = IsmailDunniganLaw(Gains(k_p1=40.0), np.array([1.0, 0.0, 0.0, 0.0]), STEP, n_regions=1)

if __name__ == "__main__":
    with Plant("odin") as plant:
        plant.set({"position.z": 1.0, "wrench_force_limit": 60.0})
        plant.initialize()
        wrench = plant.inputs.values[-6:]  # after the thrusters
        for _ in range(round(DURATION / STEP)):
            out = plant.outputs.values
            state = VehicleState(
                position=out[0:3], quaternion=out[3:7], velocity_body=out[7:13], thruster_health=np.ones(8)
            )
            rocks.evaluate(state.position, state.quaternion, value, gradient, turning, clearance)
            weights = arbiter({"obstacle": ramp(clearance[0], 0.2), "shape": 0.0, "depth": 0.0})
            law.step(state, goal, rocks, np.array([weights[0]]), wrench)
            plant.step(STEP)
        x, y, z = plant.outputs.values[:3]
        goal.evaluate(plant.outputs.values[:3], plant.outputs.values[3:7], value, gradient, turning, clearance)

    print(f"at ({x:.2f}, {y:.2f}, {z:.2f}) m after {DURATION:g} s, clearance to the goal region {clearance[0]:+.2f} m")
