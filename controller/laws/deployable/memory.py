"""What the deployable law keeps between steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.laws.deployable.attitude import Attitude
from controller.laws.deployable.barrier import Sight
from controller.laws.deployable.fault_detection import FaultState
from controller.laws.deployable.model import Dynamics, Thrusters
from controller.laws.deployable.observer import Estimate
from controller.laws.deployable.path_planner import Guide
from controller.laws.deployable.quadratic_program import Workspace

Array = NDArray[np.float64]


class Stages(NamedTuple):
    """Addresses of the long stages of a step, each compiled on its own."""

    take_in: int = 0
    detect_fault: int = 0
    improve: int = 0
    aim: int = 0
    write_rows: int = 0
    solve: int = 0


class DeployableMemory(NamedTuple):
    """Arrays, and addresses that stay, so that compiled code can take it."""

    period: Array  # (1,) s
    estimate: Array  # (4,) phi-hat [N, N m]
    report: Array  # (r,) what the last step has to say
    dynamics: Dynamics
    thrusters: Thrusters
    observed: Estimate
    attitude: Attitude
    suspicion: FaultState
    guide: Guide
    sight: Sight
    program: Workspace
    quaternion: Array  # (4,) from body to world, as measured or carried by the model
    omega: Array  # (3,) rad/s, likewise
    weights: Array  # (n,) of the arbiter, as believed
    reported: Array  # (m,) health of the thrusters as last told
    pushed: Array  # (3,) m/s2, NED, that the thrusters shall add, smoothed
    push: Array  # (6, m) as `barrier.Motion` has it
    stages: Stages
