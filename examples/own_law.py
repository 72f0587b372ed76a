"""A custom law: a plain Python function, flown with record, summary, report and replay like any other.

What one learns: the inputs of a law, its output, and how to pass it to a run. This one is a dozen lines long. It
pulls towards the goal like a spring of limited force, pushes away from regions in proportion to the arbiter's
weights, brakes, and keeps upright. It does not know weight and buoyancy, and so stops above the middle of the goal:
the adaptive laws compensate them. Writes the folder runs/own-law.
"""

from pathlib import Path

import numpy as np

from controller import FunctionLaw, RegionsSeen, VehicleState
from controller.quaternion import rotation_matrix
from cosim import load_scenario, run_scenario

PULL, PUSH, REACH = 60.0, 180.0, 0.8  # N a meter from the goal, N on a region's surface, m from which it pushes
BRAKE, UPRIGHT, CALM = 70.0, 40.0, 20.0  # N s/m, N m, N m s/rad
SETTINGS = ["time.step=0.01", "time.control=0.01", "time.arbiter=0.01", "arbiter.ramp=0.8", "arbiter.engine=closed"]


def direction(vector: np.ndarray) -> np.ndarray:
    """Return a vector scaled to length 1; a zero vector stays."""
    return vector / max(float(np.linalg.norm(vector)), 1e-9)


def steer(state: VehicleState, goal: RegionsSeen, regions: RegionsSeen, weights: np.ndarray) -> np.ndarray:
    """Return the wrench [N, N m], body frame."""
    away = goal.gradients[0] / 2.0  # of a sphere: position less center
    force = -PULL * direction(away) * min(float(np.linalg.norm(away)), 1.0)
    for i in np.flatnonzero(regions.hard):
        nearness = np.clip(1.0 - regions.clearances[i] / REACH, 0.0, 1.0)
        force -= PUSH * weights[i] * nearness * direction(regions.gradients[i])  # which points to where it is violated
    to_body = rotation_matrix(state.quaternion).T
    turn = -UPRIGHT * np.sign(state.quaternion[0]) * state.quaternion[1:] - CALM * state.velocity_body[3:]
    return np.concatenate([to_body @ force - BRAKE * state.velocity_body[:3], turn])


if __name__ == "__main__":
    run = run_scenario(load_scenario("paper", SETTINGS), Path("runs/own-law"), law=FunctionLaw(steer))
    said, stays = run.summary, "and stays" if run.summary["settled"] else "and drifts out"
    clearances = ", ".join(f"{said['min_clearance'][name]:.2f} m to {name}" for name in said["hard"])
    print(f"law {said['law']}: in the goal after {said['reach_time']:.1f} s, {stays}")
    print(f"never nearer than {clearances}; asked for {said['max_force_asked']:.0f} N at the most")
    print(f"look at {run.folder / 'report.html'} and {run.folder / 'replay.html'}")
