"""A mission in a step: the goal goes from leg to leg, and the law gets the leg's heading and speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import arctangent, cosine, hypotenuse, sine
from controller.linear_algebra import norm
from controller.quaternion import multiply
from controller.stack_array import Rows3, Vector3, Vector4, array, zeros

if TYPE_CHECKING:
    from cosim.step.step_model import StepData, StepModel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_ROUNDING = 1e-6  # tolerance of times, as a part of a step
_TOO_NEAR = 0.2  # m, horizontal distance of a feature up to which the heading stays
_RADIUS = 3  # index of a sphere's radius in its packed numbers


class MissionModel(NamedTuple):
    """The l legs of a mission, in turn; see `cosim.scenario.goal_mission.Leg`."""

    centers: Rows3  # (l, 3) m, NED: center of the goal at the end of each leg
    stops: Array  # (l,) index of the place that the goal is at, or has left last
    paces: Array  # (l,) m/s, of the goal on its way from the leg before; 0: it is there at once
    stays: Integers  # (l,) steps in the goal before the next leg
    radii: Array  # (l,) m, of a spherical goal; NaN: as it is
    headings: Array  # (l,) rad, from the law's own attitude; NaN: towards the feature
    features: Rows3  # (l, 3) m, NED; NaN: none
    speeds: Array  # (l,) m/s, greatest that the law is to aim at; inf: its own
    views: Integers  # (v,) regions whose features a mission moves
    view_features: Rows3  # (v, 3) m, NED: their features in the scenario
    turns: bool  # True if a leg has its own heading
    attitude: Vector4  # the law's own attitude, from body to world
    camera: float  # rad, heading of the camera, or without one of the bow, at that attitude
    turning_rate: float  # rad/s, greatest


def advance_mission(model: StepModel, data: StepData) -> None:
    """Move the goal on, from the next step on: to its next place after the stay there, or along its way."""
    mission, leg = model.mission, data.leg
    data.shown_stop = mission.stops[leg]
    inside = data.true_evaluation.clearances[0] >= 0.0
    if inside and not data.arrivals[int(mission.stops[leg])] >= 0.0:
        data.arrivals[int(mission.stops[leg])] = data.now
    if leg == mission.stops.size - 1:
        return
    if mission.paces[leg] > 0.0:
        done = bool(data.traveled >= norm(mission.centers[leg] - mission.centers[leg - 1]))
    else:
        data.inside_since = min(data.inside_since, data.now) if inside else math.inf
        done = bool(completed_steps(model, data.now - data.inside_since) >= mission.stays[leg])
    if done:
        leg += 1
        data.leg, data.inside_since, data.traveled = leg, math.inf, 0.0
        if mission.radii[leg] >= 0.0:
            data.goal.numbers[_RADIUS] = mission.radii[leg]
        if mission.paces[leg] == 0.0:
            _place(model, data, mission.centers[leg], zeros(3), mission.features[leg], zeros(3))
    if mission.paces[leg] > 0.0:
        _glide(model, data, mission.paces[leg] if inside else 0.0)


def _glide(model: StepModel, data: StepData, pace: float) -> None:
    """Let goal and features move at a pace [m/s] along the way, from where they are now."""
    mission, leg = model.mission, data.leg
    start, seen = mission.centers[leg - 1], mission.features[leg - 1]
    way, turn = mission.centers[leg] - start, mission.features[leg] - seen
    length = norm(way)
    part, rate = data.traveled / length, pace / length
    _place(model, data, start + part * way, rate * way, seen + part * turn, rate * turn)
    data.traveled += pace * model.step


def _place(
    model: StepModel, data: StepData, center: Vector3, velocity: Vector3, feature: Vector3, turning: Vector3
) -> None:
    """Set center and feature [m, NED], and their velocities [m/s], from now on."""
    mission = model.mission
    if np.any(mission.paces > 0.0):
        data.goal.velocities[0] = velocity
    data.goal_origin[0] = (center - data.goal_center) - velocity * data.now
    data.feature = feature
    for i in range(mission.views.size):
        view = mission.views[i]
        data.regions.velocities[view] = turning
        data.region_origins[view] = (feature - mission.view_features[i]) - turning * data.now


def aim(model: StepModel, data: StepData) -> None:
    """Turn the law's attitude towards the heading of the present leg, and limit its speed."""
    mission, leg = model.mission, data.leg
    data.speed_limit = mission.speeds[leg]
    if not mission.turns:
        return
    if mission.headings[leg] == mission.headings[leg]:
        data.heading = mission.headings[leg]
    else:
        north, east = data.feature[0] - data.arbiter_state.position[0], data.feature[1] - data.arbiter_state.position[1]
        if hypotenuse(north, east) > _TOO_NEAR:  # not if the position is lost
            data.heading = arctangent(east, north) - mission.camera
    left = data.heading - data.turned
    left = arctangent(sine(left), cosine(left))
    max_turn = mission.turning_rate * (data.now - data.turned_at)
    data.turned += min(max(left, -max_turn), max_turn)
    data.turned_at = data.now
    half = 0.5 * data.turned
    data.attitude = multiply(array(cosine(half), 0.0, 0.0, sine(half)), mission.attitude)


def completed_steps(model: StepModel, duration: float) -> float:
    """Return the number of steps in a duration [s], with a tolerance for its rounding."""
    return duration / model.step + _ROUNDING
