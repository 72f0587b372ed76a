"""The step of an FMU of the user's as the plant: its outputs become those of the vehicle's own FMU."""

from __future__ import annotations

import math
from typing import NamedTuple

from controller.quaternion import rotation_matrix
from cosim.step.fmu_call import ComponentCalls, step_component
from cosim.step.step_model import Array, Integers, StepData, StepModel

POSITION, QUATERNION, VELOCITY, ATTITUDE, OTHERS = 0, 3, 7, 13, 16  # indices among the outputs


class VehicleMap(NamedTuple):
    """The map from the outputs of an FMU to those of a vehicle's own FMU."""

    sources: Integers  # (o,) index among the FMU's outputs of each output of the vehicle's; -1: none
    velocity_ned: Integers  # (3,) the same of the velocity in the world frame
    copies: Integers  # (c, 2) output, and index of the one that it equals unless the FMU gives it
    first_force: int  # index of the first thruster's force, with those of the others and the wrench behind it
    thruster_matrix: Array  # (6, n) body wrench of one newton of each thruster
    inputs: Array  # (n + 6,) N, N m: thruster forces, and wrench on the body
    outputs: Array  # (o,) outputs of the vehicle's FMU


def step_plant_fmu(component: ComponentCalls, vehicle: VehicleMap, model: StepModel, data: StepData) -> None:
    """Step the FMU that is the plant, and write the outputs of the vehicle's."""
    step_component(component, model, data)
    if data.failed_step < 0:
        write_outputs(vehicle, data.component_results[component.first :])


def write_outputs(vehicle: VehicleMap, results: Array) -> None:
    """Write the outputs of the vehicle's FMU, NaN for those that are not known; results (r,) of the FMU on."""
    out, sources, n = vehicle.outputs, vehicle.sources, vehicle.thruster_matrix.shape[1]
    for i in range(OTHERS):
        if sources[i] >= 0:
            out[i] = results[sources[i]]
    q, angles = out[QUATERNION : QUATERNION + 4], out[ATTITUDE : ATTITUDE + 3]
    if sources[QUATERNION] < 0:
        write_quaternion(angles, q)
    elif sources[ATTITUDE] < 0:
        write_angles(q, angles)
    if vehicle.velocity_ned[0] >= 0:
        R = rotation_matrix(q)
        for i in range(3):
            out[VELOCITY + i] = 0.0
            for j in range(3):
                out[VELOCITY + i] += R[j, i] * results[vehicle.velocity_ned[j]]
    # what acts is what was commanded, and sensors are without error
    first = vehicle.first_force
    out[first : first + n] = vehicle.inputs[:n]
    out[first + n : first + n + 6] = vehicle.thruster_matrix @ vehicle.inputs[:n] + vehicle.inputs[n:]
    for i in range(vehicle.copies.shape[0]):
        out[vehicle.copies[i, 0]] = out[vehicle.copies[i, 1]]
    for i in range(OTHERS, sources.size):
        if sources[i] >= 0:
            out[i] = results[sources[i]]


def write_quaternion(angles: Array, out: Array) -> None:
    """Write the quaternion, shape (4,), of roll, pitch and yaw [rad], of which yaw turns first."""
    cr, cp, cy = math.cos(angles[0] / 2.0), math.cos(angles[1] / 2.0), math.cos(angles[2] / 2.0)
    sr, sp, sy = math.sin(angles[0] / 2.0), math.sin(angles[1] / 2.0), math.sin(angles[2] / 2.0)
    out[0] = cr * cp * cy + sr * sp * sy
    out[1] = sr * cp * cy - cr * sp * sy
    out[2] = cr * sp * cy + sr * cp * sy
    out[3] = cr * cp * sy - sr * sp * cy


def write_angles(q: Array, out: Array) -> None:
    """Write roll, pitch and yaw [rad] of a unit quaternion."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[0] = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    sine = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    out[1] = math.atan2(sine, math.sqrt(1.0 - sine * sine))
    out[2] = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
