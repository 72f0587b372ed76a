"""The navigation filter: pose, motion and their standard deviations from sensors alone."""

# An error-state Kalman filter. The IMU propagates the estimate; pressure sensor, DVL, compass and USBL correct it, each
# at its own rate, each sample at the time at which it was taken. It needs no model of the vehicle.

from __future__ import annotations

import numpy as np

from controller.arithmetic import QUARTER_TURN, arctangent, cosine, hypotenuse, square
from controller.compiling.function import CompiledFunction
from controller.law import VehicleState
from controller.navigation.corrections import CONFIRMED, correct_by_sensor, restart
from controller.navigation.inertial import estimate_at, propagate
from controller.navigation.measurements import (
    ACCELERATION,
    ANGULAR_VELOCITY,
    COMPASS,
    DEPTH,
    DEPTH_SENSOR,
    HEADING,
    IMU,
    N_SENSORS,
    USBL,
    Measurements,
    SensorModel,
    empty_measurements,
)
from controller.navigation.measurements import POSITION as MEASURED_POSITION
from controller.navigation.navigation_memory import (
    ATTITUDE,
    GYRO_BIAS,
    POSITION,
    VELOCITY,
    NavigationMemory,
    empty_memory,
    set_first_covariance,
)
from controller.quaternion import rotation_matrix
from controller.stack_array import Vector4, array, zeros

_NEVER = -1e11  # s, time before any sample
_UNEXPLAINED = 4.0  # number of standard deviations of a fix beyond which two fixes differ by more than noise
_FIX_DEVIATIONS, _FIX_DISTANCE = 6.0, 0.5  # number of standard deviations, plus m, within which two fixes agree
_MAX_GAP = 1.0  # s between two IMU samples, beyond which the filter starts again
_FAR = 3.0  # m, standard deviation of a coordinate beyond which it counts as unknown
_FAST = 0.5  # m/s, standard deviation of a velocity beyond which it counts as unknown


def navigate(measurements: Measurements, sensors: SensorModel, memory: NavigationMemory, state: VehicleState) -> None:
    """Process the new samples, and write the estimated state at the time `memory.now`; NaN where it is unknown."""
    if measurements.times[IMU] > memory.sample_times[IMU]:
        _take_imu_sample(measurements, sensors, memory)
    if memory.started == 0.0:
        _start(measurements, sensors, memory)
    else:
        for sensor in range(N_SENSORS):
            new = measurements.times[sensor] > memory.sample_times[sensor] and memory.started > 0.0
            if sensor != IMU and new:
                memory.sample_times[sensor] = measurements.times[sensor]
                correct_by_sensor(memory, measurements, sensor, sensors)
    _write_state(memory, sensors, memory.now, state)


def _take_imu_sample(measurements: Measurements, sensors: SensorModel, memory: NavigationMemory) -> None:
    """Propagate to the new sample of the IMU, or start at it."""
    time = measurements.times[IMU]
    omega = measurements.values[ANGULAR_VELOCITY : ANGULAR_VELOCITY + 3] - memory.constants[:3]
    force = measurements.values[ACCELERATION : ACCELERATION + 3] - memory.constants[3:6]
    period = time - memory.time
    if memory.started > 0.0 and period <= _MAX_GAP:
        propagate(memory, force, omega, sensors, period)
    else:
        if memory.started > 0.0:  # too long without a sample
            restart(memory)
        memory.omega = omega
    memory.time = memory.sample_times[IMU] = time


def _start(measurements: Measurements, sensors: SensorModel, memory: NavigationMemory) -> None:
    """Start once IMU, compass, pressure sensor and USBL have given a sample, at rest, level by the accelerometers."""
    # The USBL must have given two positions that agree, since either may be an outlier. The first position is their
    # mean; half their distance adds to its deviation where noise does not explain it.
    times = measurements.times
    latest = min(times[IMU], times[COMPASS], times[DEPTH_SENSOR], times[USBL])
    if not latest > _NEVER or times[IMU] != memory.time or not times[USBL] > memory.sample_times[USBL]:
        return
    fix = measurements.values[MEASURED_POSITION : MEASURED_POSITION + 3]
    apart = fix - memory.previous_fix
    memory.sample_times[USBL], memory.previous_fix = times[USBL], fix
    if not np.all(abs(apart) < _FIX_DEVIATIONS * sensors.position + _FIX_DISTANCE):
        return
    memory.constants[:] = 0.0
    f, memory.started = measurements.values[ACCELERATION : ACCELERATION + 3], 1.0
    roll, pitch = arctangent(-f[1], -f[2]), arctangent(f[0], hypotenuse(f[1], f[2]))
    memory.quaternion = _from_euler(roll, pitch, measurements.values[HEADING])
    memory.position, memory.velocity[:], memory.acceleration[:] = fix - 0.5 * apart, 0.0, 0.0
    memory.position[2] = measurements.values[DEPTH]
    memory.recorded = 0
    set_first_covariance(memory, sensors)
    for i in range(2):  # variance of a mean of two fixes; greater where noise does not explain their distance
        memory.covariance[POSITION + i, POSITION + i] -= 0.5 * square(sensors.position)
        if abs(apart[i]) > _UNEXPLAINED * sensors.position:
            memory.covariance[POSITION + i, POSITION + i] += 0.25 * square(apart[i])
    memory.rejected[:], memory.accepted[:], memory.resets[:], memory.sample_times[:] = 0.0, 0.0, 0.0, times
    memory.accepted[USBL] = CONFIRMED


def _from_euler(roll: float, pitch: float, yaw: float) -> Vector4:
    """Return the quaternion of Euler angles (zyx) [rad]."""
    cr, sr = cosine(0.5 * roll), cosine(0.5 * roll - QUARTER_TURN)
    cp, sp = cosine(0.5 * pitch), cosine(0.5 * pitch - QUARTER_TURN)
    cy, sy = cosine(0.5 * yaw), cosine(0.5 * yaw - QUARTER_TURN)
    return array(
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def _write_state(memory: NavigationMemory, sensors: SensorModel, now: float, state: VehicleState) -> None:
    """Write the state at a time [s] with its standard deviations."""
    velocity, P, deviation = zeros(3), memory.covariance, state.deviation
    known = memory.started > 0.0 and now - memory.time <= _MAX_GAP
    if known:
        estimate_at(memory, now, state.position, velocity, state.quaternion)
    else:
        state.quaternion[:] = np.nan
    for i in range(3):
        deviation[i] = np.sqrt(P[POSITION + i, POSITION + i])
        deviation[3 + i] = np.sqrt(P[VELOCITY + i, VELOCITY + i])
        deviation[6 + i] = np.sqrt(P[ATTITUDE + i, ATTITUDE + i])
        deviation[9 + i] = np.sqrt(P[GYRO_BIAS + i, GYRO_BIAS + i] + square(sensors.angular_velocity))
        if not known or deviation[i] > _FAR:
            state.position[i] = np.nan
    state.velocity_body[:] = np.nan
    if known:
        state.velocity_body[3:] = memory.omega
        if np.max(deviation[3:6]) <= _FAST:
            state.velocity_body[:3] = rotation_matrix(state.quaternion).T @ velocity


class Navigator:
    """Estimate the vehicle's state from samples of its sensors."""

    def __init__(self, sensors: SensorModel, state: VehicleState) -> None:
        self.sensors, self.state = sensors, state
        self.measurements, self.memory = empty_measurements(), empty_memory()
        self._step = CompiledFunction(navigate)

    @property
    def started(self) -> bool:
        """True if there is an estimate."""
        return bool(self.memory.started > 0.0)

    def step(self, time: float) -> None:
        """Process the measurements, and write the state at a time [s]."""
        self.memory.now = time
        self._step(self.measurements, self.sensors, self.memory, self.state)
