"""The loop of a scenario in Jacobi's order, with the Python law, regions and arbiter, and the vehicle's own FMU."""

import numpy as np

from controller import VehicleState
from controller.regions import pack
from cosim.scenario.law_factory import law_of
from cosim.scenario.true_vehicle import start_values
from cosim.ssp.system import MOTION, WRENCH
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.criteria import ramp
from plant_fmu import Plant


class Parts:
    """Law, regions and arbiter of a scenario in Python, one call a step each."""

    def __init__(self, scenario):
        self.scenario, self.law = scenario, law_of(scenario)
        self.goal, self.regions = pack([scenario.goal_region]), pack([r.region for r in scenario.regions])
        self.criterion_of = list(scenario.criterion_places)
        self.arbiter = Arbiter(engine="closed")
        self.wrench, self.weights, self.estimate = np.zeros(6), np.zeros(3), np.zeros(4)

    def control(self, k, motion, weights):
        """Return wrench, memberships, estimate, values and clearances of step k."""
        n = len(self.criterion_of)
        time = k * self.scenario.time.step
        self.goal.move_to(time)
        self.regions.move_to(time)
        values, gradients, clearances = np.zeros(n + 1), np.zeros((n + 1, 3)), np.zeros(n + 1)
        for packed, part in ((self.goal, slice(0, 1)), (self.regions, slice(1, n + 1))):
            packed.evaluate(
                motion[:3], motion[3:7], values[part], gradients[part], np.zeros((n + 1, 3))[part], clearances[part]
            )
        memberships = np.zeros(3)
        for i, clearance in zip(self.criterion_of, clearances[1:].tolist(), strict=True):
            memberships[i] = max(memberships[i], ramp(clearance, self.scenario.arbiter.ramp))
        if k % self.scenario.control_every == 0:
            self.estimate = self.law.estimate.copy()
            state = VehicleState(motion[:3], motion[3:7], motion[7:], np.ones(8))
            self.law.step(state, self.goal, self.regions, weights[self.criterion_of], self.wrench)
        return self.wrench.copy(), memberships, self.estimate, values, clearances

    def arbitrate(self, k, memberships):
        """Return the weights of step k."""
        if k % self.scenario.arbiter_every == 0:
            self.weights = np.array(self.arbiter(memberships.tolist()))
        return self.weights


def jacobi(scenario):
    """Return position, quaternion and velocity before each step and after the last, shape (steps + 1, 13)."""
    parts, wrench, memberships, weights = Parts(scenario), np.zeros(6), np.zeros(3), np.zeros(3)
    with Plant(scenario.vehicle, 3) as plant:
        plant.set(start_values(scenario))
        plant.initialize()
        sent = [plant.inputs.names.index(name) for name in WRENCH]
        read = [plant.outputs.names.index(name) for name in MOTION]
        rows = [plant.outputs.values[read]]
        for k in range(scenario.steps):
            plant.inputs.values[sent] = wrench
            plant.step(scenario.time.step)
            # each works on what the others had put out before this step
            wrench, new_memberships, *_ = parts.control(k, rows[-1], weights)
            weights, memberships = parts.arbitrate(k, memberships), new_memberships
            rows.append(plant.outputs.values[read])
    return np.array(rows)
