"""State of the deployable law between steps."""

from __future__ import annotations

import math
from typing import Annotated

from controller.laws.deployable.actuator_lag import PredictedState
from controller.laws.deployable.attitude import Attitude
from controller.laws.deployable.barrier import RegionObservation
from controller.laws.deployable.clearance_bound import ClearanceBound
from controller.laws.deployable.diagnostics import Report
from controller.laws.deployable.estimate import Estimate
from controller.laws.deployable.fault_detection import FaultState
from controller.laws.deployable.model import Dynamics, Rows2, Thrusters
from controller.laws.deployable.path_planning.planner import PathPlan
from controller.potential_field import GoalRow
from controller.quadratic_program import Workspace
from controller.stack_array import Array, Columns6, Rows3, Shape, Vector3, Vector4, Vector6, VectorM
from controller.state import State

Vector12 = Annotated[Array, Shape(12)]
Weights = Annotated[Array, Shape(2, "n")]


class DeployableMemory(State):
    """State between steps of a law for n regions and m thrusters."""

    period: float  # s, control period
    speed_limit: float = math.inf  # m/s, greatest over ground to aim at
    estimate: Vector4  # phi_hat of (12) [N, N m]
    report: Report
    dynamics: Dynamics
    thrusters: Thrusters
    state_estimate: Estimate
    attitude: Attitude
    fault_state: FaultState
    plan: PathPlan
    observation: RegionObservation
    bound: ClearanceBound
    program: Workspace
    predicted: PredictedState
    expected: Vector6  # m, NED, and m/s, body: predicted position and velocity at the next step; NaN if unknown
    quaternion: Vector4  # from body to world, measured, or propagated by the model
    omega: Vector3  # rad/s, body rates, measured, or propagated by the model
    deviation: Vector12  # standard deviations of the measured state, as in `VehicleState`
    position_variance: Vector3  # m2, NED: variance of the estimated position
    goal_shifts: GoalRow  # m, NED: shift of the goal at the time of the predicted state
    region_shifts: Rows3  # m, NED: those of the regions
    samples: float  # number of position and velocity samples that reached the gate
    rejected_samples: float  # number of these that it rejected
    weights: Weights  # sanitized weights of the arbiter, smoothed in two stages for hard regions; NaN at first
    reported: VectorM  # health of the thrusters as last reported
    integral: Vector3  # m/s2, NED: integral of the velocity's error at low speed
    filtered_acceleration: Vector3  # m/s2, NED: desired acceleration by the thrusters, low-pass filtered
    thruster_acceleration: Columns6  # m/s2, rad/s2: acceleration by one newton of each thruster
    acceleration_ahead: Columns6  # m/s2, rad/s2: the same at the predicted attitude
    given_limits: Rows2  # N, true force of each thruster at its lower and upper limit
