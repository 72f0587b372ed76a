"""Sensing through sensors: law and arbiter receive the estimate of the navigation filter."""

from __future__ import annotations

import numpy as np

from controller import VehicleState
from controller.navigation import Navigator
from controller.navigation.measurements import SENSORS
from cosim.scenario.scenario import Scenario
from cosim.scenario.sensor_suite import outage_schedule, scenario_sensors, sensor_model
from cosim.simulation.sensor import Sensor
from cosim.simulation.signals import Signals
from cosim.simulation.stepped_plant import SteppedPlant

_ROUNDING = 1e-6  # tolerance of times, as a fraction of a step
FIRST, FIRST_TIME = "measured.depth", f"measured.time.{SENSORS[0]}"  # outputs of the plant, the others follow


class SensorNavigation:
    """The plant's sensors and the navigation filter, step by step."""

    def __init__(self, scenario: Scenario, plant: SteppedPlant, signals: Signals, given: VehicleState) -> None:
        self._plant = plant
        parameters = scenario_sensors(scenario)
        self.navigator = Navigator(sensor_model(parameters), given)
        samples = self.navigator.measurements
        self._values, self._times = (
            signals.view(FIRST, samples.values.size),
            signals.view(FIRST_TIME, samples.times.size),
        )
        self._changes = outage_schedule(scenario.outages, parameters, scenario.time.step)
        self._step = scenario.time.step

    def measure(self, time: float, anew: bool) -> None:
        """Apply sensor outages due at a time [s], and write the estimate from the samples. `anew` is not used."""
        while self._changes and self._changes[0][0] * self._step <= time + _ROUNDING * self._step:
            _, sensor, probability = self._changes.pop(0)
            self._plant.set({f"{SENSORS[sensor]}.loss_probability": probability})
        samples = self.navigator.measurements
        samples.values[:], samples.times[:] = self._values, self._times
        self.navigator.step(time)


def make_sensing(
    scenario: Scenario, plant: SteppedPlant, signals: Signals, true_state: VehicleState
) -> tuple[VehicleState, Sensor | SensorNavigation | None]:
    """Return the state that law and arbiter receive, and the object that writes it."""
    if scenario.sensing.exact:
        return true_state, None
    position, velocity, health = signals.view("sensed.x", 3), signals.view("sensed.u", 6), true_state.thruster_health
    if scenario.sensing.through == "state":
        given = VehicleState(position, np.zeros(4), velocity, health)
        return given, Sensor(scenario.sensing, true_state, given)
    quaternion, deviation = signals.view("sensed.e0", 4), signals.view("deviation.position.x", 12)
    given = VehicleState(position, quaternion, velocity, health, deviation)
    return given, SensorNavigation(scenario, plant, signals, given)
