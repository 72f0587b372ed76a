"""A co-simulation master in one page: the plant's FMU, the fuzzy arbiter and the adaptive controller, step by step."""

import numpy as np

from controller import Gains, PrintedLaw, RegionValues, VehicleState
from controller.regions import Region, Sphere, pack
from fuzzy_arbiter import Arbiter, ramp
from plant_fmu import Plant

STEP, DURATION = 0.01, 30.0
GOAL = Region("goal", Sphere((3.0, 0.0, 2.0), 0.5), keep="in")
ROCK = Region("rock", Sphere((1.5, 0.2, 1.5), 0.4), keep="out")

scene = pack([GOAL, ROCK])
values, gradients, clearances = np.zeros(2), np.zeros((2, 3)), np.zeros(2)
arbiter = Arbiter()
law = PrintedLaw(Gains(k_p1=40.0), np.array([1.0, 0.0, 0.0, 0.0]), STEP)

with Plant("odin") as plant:
    plant.set({"position.z": 1.0, "wrench_force_limit": 60.0})
    plant.initialise()
    wrench = plant.inputs.values[-6:]  # behind the thrusters
    for _ in range(round(DURATION / STEP)):
        out = plant.outputs.values
        state = VehicleState(position=out[0:3], quaternion=out[3:7], velocity_body=out[7:13])
        scene.evaluate(state.position, values, gradients, clearances)
        weights = arbiter({"obstacle": ramp(clearances[1], 0.2), "shape": 0.0, "depth": 0.0})
        goal = RegionValues(values[:1], gradients[:1], clearances[:1])
        rocks = RegionValues(values[1:], gradients[1:], clearances[1:])
        law.step(state, goal, rocks, np.array([500.0 * weights[0]]), wrench)
        plant.step(STEP)
    x, y, z = plant.outputs.values[:3]

print(f"at ({x:.2f}, {y:.2f}, {z:.2f}) m after {DURATION:g} s, clearance to the goal region {clearances[0]:+.2f} m")
