"""An FMU of the user's as the plant, with the channels of the vehicle's own FMU."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cosim.errors import ScenarioError
from cosim.scenario.scenario import Scenario
from cosim.simulation.fmu_map import read_fmu_of
from cosim.simulation.loaded_fmu import LoadedFmu
from cosim.simulation.plant_map import BODY, NED, QUATERNION, STATE, initial_state, plant_start, plant_targets
from cosim.simulation.stepped_plant import vehicle_channels
from cosim.step.plant_fmu_call import VehicleMap, write_outputs
from plant_fmu import PlantError
from plant_fmu.running.channels import Channels

_COPIES = {  # outputs of ideal sensors
    "measured.depth": "position.z", "measured.heading": "attitude.yaw", "measured.altitude": "altitude",
    **{f"measured.{name}": name for name in (*STATE[:3], *BODY)},
    **{f"measured.angular_velocity.{axis}": f"velocity.{axis}" for axis in "pqr"},
}  # fmt: skip
_ROUNDING = 1e-6  # m, rad, m/s: tolerance of a start


class FmuPlant:
    """A co-simulation FMU in the place of the vehicle's; it fulfills `SteppedPlant`, and C calls it."""

    def __init__(self, scenario: Scenario) -> None:
        assert scenario.plant_fmu is not None
        self._scenario, self.fmu, self._vehicle = scenario, scenario.plant_fmu, scenario.vehicle
        self._file = read_fmu_of(self.fmu)
        self._targets = plant_targets(self.fmu, self._file, scenario.vehicle)
        outputs, flags, inputs = vehicle_channels(scenario.vehicle)
        self.inputs = Channels(inputs, np.zeros(len(inputs)))
        self.outputs = Channels(outputs, np.full(len(outputs), math.nan))
        self.flags = Channels(flags, np.zeros(len(flags), np.bool_))
        self.loaded = LoadedFmu(self.fmu, scenario.time.step, "time.step")

    @property
    def fmi(self) -> int:
        """The FMU's FMI version, 2 or 3."""
        return self._file.fmi

    def set(self, values: Mapping[str, Any]) -> None:
        """Change nothing: parameters and start values are those of the map."""

    def initialize(self) -> None:
        """Initialize the FMU with the scenario's initial state, and read its pose and velocity."""
        self.restart(self._scenario)

    def restart(self, scenario: Scenario) -> None:
        """Begin again at time 0, with the parameters and the initial state of a scenario."""
        fmu = scenario.plant_fmu or self.fmu
        self.loaded.restart(fmu, plant_start(fmu, self._file, scenario, self._targets))
        self._read()
        expected = initial_state(scenario)
        values = dict(zip(self.outputs.names, self.outputs.values.tolist(), strict=True))
        turned = sum(values[name] * expected[name] for name in QUATERNION) < 0.0
        for name in STATE:
            value = -values[name] if turned and name in QUATERNION else values[name]
            if not abs(value - expected[name]) <= _ROUNDING:
                key = f"initial.{name.partition('.')[0]}"
                raise ScenarioError(
                    f"{key}: {fmu.label} starts at {name} = {value:g}, expected {expected[name]:g}: connect its start "
                    f"by {fmu.key}.initial, or change {key}"
                )

    def _read(self) -> None:
        """Read the outputs outside of a run, in Python."""
        outputs = tuple(v.name for v in self._file.with_causality("output"))
        results = np.array(self.loaded.values(outputs))
        write_outputs(self.vehicle_map(outputs), results)

    def vehicle_map(self, names: Sequence[str]) -> VehicleMap:
        """Return the map from results with some names to the vehicle's outputs."""
        by_target = {target: names.index(name) for name, target in self._targets.items()}
        outputs = self.outputs.names
        index = {name: i for i, name in enumerate(outputs)}
        copies = [(index[to], index[of]) for to, of in _COPIES.items()]
        by_body = all(name in by_target for name in BODY)
        return VehicleMap(
            sources=np.array([by_target.get(name, -1) for name in outputs], np.int64),
            velocity_ned=np.array([-1 if by_body else by_target[name] for name in NED], np.int64),
            copies=np.array(copies, np.int64),
            first_force=next(i for i, name in enumerate(outputs) if name.startswith(("thruster_force[", "actuation."))),
            thruster_matrix=np.ascontiguousarray(self._vehicle.thruster_matrix),
            inputs=self.inputs.values,
            outputs=self.outputs.values,
        )

    def step(self, step: float) -> None:
        """Raise an error, as a step needs all signals of a run: C calls the FMU."""
        raise PlantError(f"{self.fmu.label}: a user's FMU has no step in Python, expected a run of its scenario")

    def read_flags(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return the Boolean outputs; all stay False, since the FMU gives none."""
        return self.flags.values

    def close(self) -> None:
        """Free the FMU. May be called twice."""
        self.loaded.close()
