"""State of the deployable law between steps."""

from __future__ import annotations

from typing import NamedTuple

from controller.laws.deployable.actuator_lag import PredictedState
from controller.laws.deployable.attitude import Attitude
from controller.laws.deployable.barrier import RegionObservation
from controller.laws.deployable.estimate import Estimate
from controller.laws.deployable.fault_detection import FaultState
from controller.laws.deployable.model import Dynamics, Thrusters
from controller.laws.deployable.path_planning.planner import PathPlan
from controller.quadratic_program import Workspace
from controller.stack_array import Array, Columns6, Number, Rows3, Vector3, Vector4, Vector6


class DeployableMemory(NamedTuple):
    """State between steps, as arrays, for the translation to C."""

    period: Number  # s, control period
    estimate: Vector4  # phi_hat of (12) [N, N m]
    report: Array  # (r,) diagnostics of the last step
    dynamics: Dynamics
    thrusters: Thrusters
    state_estimate: Estimate
    attitude: Attitude
    fault_state: FaultState
    plan: PathPlan
    observation: RegionObservation
    program: Workspace
    predicted: PredictedState
    expected: Vector6  # m, NED, and m/s, body: predicted position and velocity at the next step; NaN if unknown
    quaternion: Vector4  # from body to world, measured, or propagated by the model
    omega: Vector3  # rad/s, body rates, measured, or propagated by the model
    deviation: Array  # (12,) standard deviations of the measured state, as in `VehicleState`
    position_variance: Vector3  # m2, NED: variance of the estimated position
    clearance_bound: Array  # (2,) m, of the clearances: guaranteed; of the last step; NaN without one
    goal_shifts: Rows3  # (1, 3) m, NED: shift of the goal at the time of the predicted state
    region_shifts: Rows3  # m, NED: those of the regions
    samples: Array  # (2,) number of position and velocity samples: that reached the gate; that it rejected
    weights: Array  # (2, n) sanitized weights of the arbiter, smoothed in two stages for hard regions; NaN at first
    reported: Array  # (m,) health of the thrusters as last reported
    filtered_acceleration: Vector3  # m/s2, NED: desired acceleration by the thrusters, low-pass filtered
    thruster_acceleration: Columns6  # m/s2, rad/s2: acceleration by one newton of each thruster
    acceleration_ahead: Columns6  # m/s2, rad/s2: the same at the predicted attitude
    given_limits: Array  # (2, m) N, true force of each thruster at its lower and upper limit
