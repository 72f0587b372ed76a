"""Consistency of the navigation filter on hard scenes: the ratio of its errors to its own standard deviations.

``python -m benchmarks.navigation N [--seed K] [--duration S]``. The normalized estimation error squared (NEES) of all
18 errors is averaged over the flights at some times, that of the innovations (NIS) over all samples of a sensor; both
are divided by their degrees of freedom, so that 1 is consistent. Beside each, the interval in which a consistent filter
is in 95 of 100 cases, for independent flights; samples of a sensor are nearly independent. Innovations count from 5 s
on: the filter starts with the covariance of a vehicle that moves, and in these scenes it rests.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from controller import LAWS
from controller.navigation.measurements import SENSORS
from controller.quaternion import rotation_matrix
from cosim.campaigns.scenes.as_scenario import scene_scenario
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.generator import generate_scenes
from cosim.campaigns.scenes.scene_file import decode_scene
from cosim.scenario.sensor_suite import scenario_sensors
from cosim.simulation.master import Master

Array = NDArray[np.float64]

TIMES = (1.0, 2.0, 5.0, 10.0, 20.0, 30.0)  # s, times at which errors are evaluated
_FROM = 5.0  # s, time from which on innovations count
_CONSTANT = (  # constant errors of the sensors, in the order of the filter's constants
    *(f"imu.angular_velocity_bias.{axis}" for axis in "pqr"), *(f"imu.acceleration_bias.{axis}" for axis in "xyz"),
    "compass.bias", "depth_sensor.bias", "dvl.scale_error",
)  # fmt: skip


def error_of(master: Master, constants: Array) -> Array:
    """Return the errors of the filter, true less estimated, shape (18,), in the order of its covariance.

    They are position [m], velocity [m/s] and rotation [rad], all NED, and the constant errors of the sensors.
    """
    memory, true_state = master.data.navigation, master.true_state
    R = rotation_matrix(true_state.quaternion)
    E = R @ rotation_matrix(memory.quaternion).T
    turn = 0.5 * np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])
    velocity = R @ true_state.velocity_body[:3]
    return np.r_[true_state.position - memory.position, velocity - memory.velocity, turn, constants - memory.constants]


def flight(seed: int, duration: float) -> tuple[Array, Array]:
    """Fly a hard scene; return NEES / 18 at `TIMES`, NaN before the filter's start, and sums of innovations."""
    scene = decode_scene(next(iter(generate_scenes(1, seed, "hard"))).encode())
    gains = LAWS["deployable"].gains_type()
    scenario = scene_scenario(scene, "deployable", gains, Conditions(duration=duration, sensing="sensors"))
    parameters, errors = scenario_sensors(scenario), np.full(len(TIMES), np.nan)
    constants = np.array([parameters[name] for name in _CONSTANT])
    with Master(scenario) as master:
        before = master.data.navigation.innovations.copy()
        for k in range(scenario.steps):
            if k == round(_FROM / scenario.time.step):
                before = master.data.navigation.innovations.copy()
            master.step(k)
            for i, time in enumerate(TIMES):
                if abs(k * scenario.time.step - time) < 0.5 * scenario.time.step and master.data.navigation.started:
                    error = error_of(master, constants)
                    errors[i] = error @ np.linalg.solve(master.data.navigation.covariance, error) / error.size
        return errors, master.data.navigation.innovations - before


def rows(count: int, seed: int, duration: float) -> Iterator[dict[str, float | str]]:
    """Yield the results of the flights, a row for each time and each sensor."""
    flown = [flight(k, duration) for k in range(seed, seed + count)]
    errors, innovations = np.array([nees for nees, _ in flown]), sum(sums for _, sums in flown)
    for i, time in enumerate(TIMES):
        seen = errors[np.isfinite(errors[:, i]), i]
        if len(seen):
            low, high = stats.chi2.interval(0.95, 18 * len(seen)) / np.array(18.0 * len(seen))
            yield {"nees": f"{time:g} s", "flights": len(seen), "mean": seen.mean(), "low": low, "high": high}
    for sensor, (total, degrees, rejected) in zip(SENSORS, np.asarray(innovations), strict=True):
        if degrees:
            low, high = stats.chi2.interval(0.95, degrees) / np.array(degrees)
            yield {"nis": sensor, "numbers": degrees, "mean": total / degrees, "low": low, "high": high,
                   "rejected": rejected}  # fmt: skip


def main() -> None:
    """Run the flights, and print each row as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--duration", type=float, default=31.0)
    options = parser.parse_args()
    for row in rows(options.count, options.seed, options.duration):
        print(json.dumps({key: round(x, 4) if isinstance(x, float) else x for key, x in row.items()}))


if __name__ == "__main__":
    main()
