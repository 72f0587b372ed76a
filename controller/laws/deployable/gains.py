"""Gains of the deployable law, with defaults for a vehicle of about a meter."""

from __future__ import annotations

from typing import NamedTuple

from controller.errors import LawError
from controller.law import validate_gains

SPREADS = 3.0  # standard deviations of a position added to margins


class DeployableGains(NamedTuple):
    """Gains of the deployable law; all are choices of this project, none is from the paper."""

    # attraction
    speed: float = 1.2  # m/s, greatest over ground
    acceleration: float = 0.35  # m/s2, with which the attraction speeds up and brakes
    velocity_bandwidth: float = 1.2  # rad/s, of the loop that follows the wanted velocity
    integral: float = 0.0  # 1/s2, of the velocity's error at low speed, against disturbances estimated badly; 0: none
    smoothing: float = 0.05  # s, over which the wanted acceleration is smoothed, to spare the thrusters noise
    price_smoothing: float = 0.5  # s, of two stages that smooth the weights by which barriers yield, likewise
    position_bandwidth: float = 0.8  # 1/s, of the approach to the end of the path
    depth: float = 0.3  # m, depth in the goal region at which the path ends, where the region is that deep
    attitude_bandwidth: float = 2.0  # rad/s
    # attitude required by regions
    comfort: float = 0.15  # rad, clearance of regions of attitude that the held attitude keeps
    tilt: float = 0.35  # rad, greatest from the vertical that a region may ask for, or about an axis left to righting
    turning_rate: float = 0.6  # rad/s, greatest of the held attitude
    turning_deceleration: float = 0.5  # rad/s2, relied on by barriers of attitude
    # barriers
    margin: float = 0.03  # m, kept of hard regions in addition to the estimate's error
    braking_share: float = 0.8  # of the deceleration that is left with any one thruster lost, relied on for stopping
    barrier_slope: float = 1.5  # 1/s, maximum rate at which a barrier may be approached per meter
    barrier_rate: float = 4.0  # 1/s, at which a barrier's speed limit is enforced
    # path planner
    clearance: float = 0.25  # m, of the path from hard regions, where there is room
    # estimates
    position_noise: float = 0.02  # m, standard deviation of one measurement
    velocity_noise: float = 0.01  # m/s
    # restoring_drift, restoring_bound and moment_bound are for a vehicle of up to 50 kg. For a heavier one, the
    # first two grow in proportion to its mass, moment_bound to the mass squared. W - B, current and moments also stand
    # for other disturbances: while innovations are biased, they drift faster
    restoring_drift: float = 0.3  # N/sqrt(s), of W - B
    current_drift: float = 0.01  # m/s/sqrt(s)
    restoring_bound: float = 50.0  # N, of |W - B|
    moment_bound: float = 150.0  # N m, of each of the other three of phi, and of the moment about z
    current_bound: float = 1.0  # m/s
    adaptation: float = 0.5  # 1/s, of the moments, if their drift has not grown
    max_drift: float = 400.0  # maximum factor of the variance of a drift while innovations are biased; 1: no growth
    lag_bound: float = 1.0  # s, of the thrusters; 0: no lag is estimated, nor predicted for
    # lost measurements and thrusters
    coast: float = 2.0  # s that the law goes on without valid measurements before it only holds W - B
    rise: float = 0.0  # N, lift once all but attitude is lost for that long, beside the force against W - B
    failure_threshold: float = 12.0  # log-likelihood ratio at which a thruster is isolated; 0: never
    # parts that 0 disables, for comparison
    drag_estimation: float = 1.0  # without it, the drag is the vehicle's
    effectiveness_estimation: float = 1.0  # without it, of each thruster the same
    path_planning: float = 1.0  # without it, straight at the goal
    barriers: float = 1.0  # without them, no region is kept but by the path


_MAY_BE_ZERO = {
    "integral",
    "smoothing",
    "price_smoothing",
    "margin",
    "comfort",
    "tilt",
    "depth",
    "coast",
    "rise",
    "failure_threshold",
    "restoring_drift",
    "current_drift",
    "adaptation",
    "drag_estimation",
    "effectiveness_estimation",
    "lag_bound",
    "path_planning",
    "barriers",
}


def check_gains(gains: DeployableGains) -> DeployableGains:
    """Validate the gains, and return them."""
    validate_gains(gains, above_zero=set(gains._fields) - _MAY_BE_ZERO)
    if gains.braking_share > 1.0:
        raise LawError(f"law.gains.braking_share is {gains.braking_share}, expected at most 1")
    if gains.max_drift < 1.0:
        raise LawError(f"law.gains.max_drift is {gains.max_drift}, expected at least 1")
    return gains
