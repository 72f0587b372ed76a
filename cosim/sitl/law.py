"""The autopilot as a law: its last outputs command the thruster forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from controller import VehicleState
from controller.law import Diagnostic, Output
from controller.regions.region_set import PackedRegions
from cosim.errors import RunError
from cosim.simulation.signals import Array
from cosim.sitl.sitl_link import ESTIMATE, SitlLink
from plant_fmu import Vehicle
from plant_fmu.autopilot import Curve, effort_of_pulse


class AutopilotLaw:
    """Thruster forces from the last outputs of an autopilot."""

    output: ClassVar[Output] = "thrusters"

    def __init__(
        self,
        channels: Sequence[int],
        efforts: Sequence[Curve],
        vehicle: Vehicle,
        output_name: str,
        unit: str,
        idle: float = 0.0,
        link: SitlLink | None = None,
    ) -> None:
        # thruster, its output from 0, effort, and the force of the efforts -1 and 1
        columns = channels, efforts, vehicle.thrust_min.tolist(), vehicle.thrust_max.tolist()
        each = enumerate(zip(*columns, strict=True))
        self._driven = [(i, channel - 1, effort, *limits) for i, (channel, effort, *limits) in each if channel]
        meaning = "Output {} of the autopilot, of thruster {}"
        self.diagnostics = (
            *(Diagnostic(f"{output_name}{j + 1}", unit, meaning.format(j + 1, i + 1)) for i, j, *_ in self._driven),
            Diagnostic("lost", "", "Number of lost frames of the autopilot"),
            *(ESTIMATE if link is not None else ()),
        )
        self.lost = 0
        self.link, self._idle = link, idle
        self._has_output = False
        self._estimate: Array = np.zeros(4)
        self._report: Array = np.zeros(len(self.diagnostics))
        self._forces: Array = np.zeros(vehicle.n_thrusters)

    def set_outputs(self, outputs: Sequence[float]) -> None:
        """Set the thruster forces by the autopilot's outputs, shape (channels,); missing channels count as 0."""
        n = len(outputs)
        for j, (i, index, effort, min_force, max_force) in enumerate(self._driven):
            value = outputs[index] if index < n else 0.0
            fraction = effort(value)
            self._forces[i] = fraction * max_force if fraction >= 0.0 else -fraction * min_force
            self._report[j] = value
        self._has_output = any(value not in (0.0, self._idle) for value in self._report[: len(self._driven)].tolist())

    @property
    def is_driving(self) -> bool:
        """True if the autopilot is armed, or one of its thruster outputs is not idle."""
        return self._has_output or (self.link is not None and self.link.is_armed)

    @property
    def estimate(self) -> Array:
        """Zeros, shape (4,): an autopilot does not estimate phi."""
        return self._estimate

    @property
    def report(self) -> Array:
        """Last outputs, number of lost frames, and the autopilot's estimate, shape (len(diagnostics),)."""
        n = len(self._driven)
        self._report[n] = self.lost
        if self.link is not None:
            self._report[n + 1 :] = self.link.estimate
        return self._report

    def step(
        self, state: VehicleState, goal: PackedRegions, regions: PackedRegions, weights: Array, forces: Array
    ) -> None:
        """Write the thruster forces [N]; state, regions and weights are not used."""
        forces[:] = self._forces


def make_pwm_law(vehicle: Vehicle, link: SitlLink | None = None) -> AutopilotLaw:
    """Make the law of an autopilot with servo pulses as outputs."""
    if vehicle.autopilot is None:
        raise RunError(f"vehicle {vehicle.name!r} has no table [autopilot], expected frame, channels and signs in it")
    table = vehicle.autopilot
    efforts = [effort_of_pulse(table, sign) for sign in table.sign_of_each(vehicle.n_thrusters)]
    return AutopilotLaw(table.channels, efforts, vehicle, "pwm", "us", table.pwm_neutral, link)


def make_control_law(vehicle: Vehicle) -> AutopilotLaw:
    """Make the law of an autopilot with controls from -1 to 1 as outputs, one for each thruster in order."""
    n = vehicle.n_thrusters
    return AutopilotLaw(range(1, n + 1), [_clip_control] * n, vehicle, "control", "")


def _clip_control(control: float) -> float:
    return min(max(control, -1.0), 1.0) if control == control else 0.0
