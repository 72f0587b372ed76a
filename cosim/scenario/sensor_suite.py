"""Sensors for navigation: numbers from data sheets, as parameters of the FMU."""

# The plant uses `DATA_SHEETS` unless a scenario's `plant.parameters` override them. The navigation filter receives the
# plant's standard deviations, and those from which the constant errors are drawn. A number without a data sheet is
# marked as assumed.

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from controller.navigation import SensorModel
from controller.navigation.measurements import SENSORS
from cosim.scenario.scenario import Scenario
from cosim.scenario.tables import Outage
from plant_fmu.vehicle import Vehicle

SENSOR_NAMES = dict(zip(SENSORS, ("Pressure sensor", "DVL", "IMU", "Compass", "USBL"), strict=True))

DATA_SHEETS: dict[str, float] = {
    # pressure: TE Connectivity MS5837-30BA (Blue Robotics Bar30), resolution 0.2 mbar; rate and delay assumed
    "depth_sensor.rate": 20.0,
    "depth_sensor.noise": 0.002,
    "depth_sensor.delay": 0.02,
    # DVL: Water Linked A50, 4 to 26 Hz by altitude; noise of a ping, delay, lost pings and outliers assumed
    "dvl.rate": 8.0,
    "dvl.velocity_noise": 0.005,
    "dvl.altitude_noise": 0.02,
    "dvl.delay": 0.1,
    "dvl.loss_probability": 0.05,
    "dvl.outlier_probability": 0.01,
    # IMU: Movella MTi-300, 60 ug/sqrt(Hz) and 0.01 deg/s/sqrt(Hz), here at 100 Hz
    "imu.rate": 100.0,
    "imu.acceleration_noise": 0.0059,
    "imu.angular_velocity_noise": 0.00175,
    # compass: of the same, 1 deg RMS, taken as constant; noise, rate and delay assumed
    "compass.rate": 10.0,
    "compass.noise": 0.0035,
    "compass.delay": 0.02,
    # USBL: LinkQuest TrackLink, 0.1 deg of bearing, at 85 m; rate, delay, lost fixes and outliers assumed
    "usbl.rate": 1.0,
    "usbl.noise": 0.15,
    "usbl.delay": 0.3,
    "usbl.loss_probability": 0.05,
    "usbl.outlier_probability": 0.02,
}

# constant errors, drawn from the seed; of the DVL 0.1 % (A50 Performance) to 1 % (A50), the compass as above; those of
# IMU and pressure sensor, after calibration, assumed
_CONSTANT = SensorModel(
    depth_bias=0.02, velocity_scale=0.005, acceleration_bias=0.02, angular_velocity_bias=0.0017, heading_bias=0.0175
)
_STREAM = 2  # second part of the generator's seed, which separates its stream from that of the noise
_ROUNDING = 1e-6  # tolerance of times, as a fraction of a step


def sensor_parameters(seed: int, over: Mapping[str, float], vehicle: Vehicle) -> dict[str, float]:
    """Return the FMU's sensor parameters: from data sheets and the vehicle, with constant errors from the seed."""
    draw = np.random.default_rng([seed, _STREAM]).standard_normal(9)
    names = (
        *((f"imu.acceleration_bias.{axis}", _CONSTANT.acceleration_bias) for axis in "xyz"),
        *((f"imu.angular_velocity_bias.{axis}", _CONSTANT.angular_velocity_bias) for axis in "pqr"),
        ("compass.bias", _CONSTANT.heading_bias),
        ("depth_sensor.bias", _CONSTANT.depth_bias),
        ("dvl.scale_error", _CONSTANT.velocity_scale),
    )
    constant = {name: float(x * deviation) for x, (name, deviation) in zip(draw, names, strict=True)}
    own = {f"dvl.position.{a}": float(x) for a, x in zip("xyz", vehicle.dvl_position, strict=True)}
    own |= {f"{sensor}.delay": delay for sensor, delay in vehicle.sensor_delay.items()}
    return DATA_SHEETS | own | constant | {"seed": float(seed % 2**31)} | dict(over)


def scenario_sensors(scenario: Scenario) -> dict[str, float]:
    """Return the FMU's sensor parameters of a scenario by name; empty unless it senses through sensors."""
    if scenario.sensing.through != "sensors":
        return {}
    return sensor_parameters(
        scenario.sensing.seed, {k: float(v) for k, v in scenario.plant.parameters.items()}, scenario.vehicle
    )


def sensor_model(parameters: Mapping[str, float]) -> SensorModel:
    """Return the navigation filter's model of the sensors: deviations of noise and of constant errors."""
    usual = SensorModel()
    return _CONSTANT._replace(
        depth=parameters.get("depth_sensor.noise", usual.depth),
        velocity=parameters.get("dvl.velocity_noise", usual.velocity),
        acceleration=parameters.get("imu.acceleration_noise", usual.acceleration),
        angular_velocity=parameters.get("imu.angular_velocity_noise", usual.angular_velocity),
        heading=parameters.get("compass.noise", usual.heading),
        position=parameters.get("usbl.noise", usual.position),
        gravity=parameters.get("gravity", usual.gravity),
        dvl_position=np.array([parameters.get(f"dvl.position.{axis}", 0.0) for axis in "xyz"]),
    )


def outage_schedule(
    outages: Iterable[Outage], parameters: Mapping[str, float], step: float
) -> list[tuple[int, int, float]]:
    """Return the changes of the sensors' loss probabilities over time; step [s]."""
    changes = []
    for outage in outages:
        usual = parameters.get(f"{outage.sensor}.loss_probability", 0.0)
        sensor = SENSORS.index(outage.sensor)
        begin, end = (math.ceil(t / step - _ROUNDING) for t in (outage.time, outage.time + outage.duration))
        changes += [(begin, sensor, 1.0), (end, sensor, usual)]
    return sorted(changes)
