"""A vehicle behind a link in the place of the plant: the master steps it as it steps an FMU."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from cosim.companion.safety import CONDITIONS, STATES
from cosim.companion.session import AutopilotSession
from cosim.mavlink.vehicle.row_layout import quaternion_to_euler
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array
from cosim.simulation.stepped_plant import vehicle_channels
from plant_fmu.autopilot import effort_of_pulse
from plant_fmu.running.channels import Channel, Channels

_REASONS = {condition.name: number for number, condition in enumerate(CONDITIONS, 1)}
_MAX_DELAY = 0.1  # s, delay beyond which the loop shifts its schedule instead of catching up
_REPORTED_CHANNELS = (  # channels that the autopilot reports, at the beginning of a step
    Channel("autopilot.age", "s", "Age of the older of position and attitude"),
    Channel("autopilot.mode", "", "Custom mode of the autopilot's heartbeat"),
    Channel("autopilot.armed", "", "Armed state of the autopilot"),
    *(Channel(f"autopilot.position.{a}", "m", "Position in the autopilot's own frame") for a in "xyz"),
    *(Channel(f"autopilot.velocity.{a}", "m/s", "Velocity in the autopilot's own frame, NED") for a in "xyz"),
    Channel("autopilot.drift", "m", "Difference between the local position and global position or pressure"),
    Channel("autopilot.reckoned", "m", "Horizontal distance without a position fix, since the frame is known"),
)
_SENT_CHANNELS = (  # channels of the companion's own state and commands, in the step
    Channel(
        "companion.state", "", f"State of the companion: {', '.join(f'{i} {state}' for i, state in enumerate(STATES))}"
    ),
    Channel("companion.reason", "", "Condition that ended steering, from 1 in the order of the table; 0 for none"),
    Channel("companion.lateness", "s", "Delay of the start of the step"),
    Channel("companion.round_trip", "s", "Shortest recent TIMESYNC round trip"),
    *(Channel(f"stick.{f}", "", "Commanded stick, -1 to 1, along or about a body axis") for f in "XYZKMN"),
    *(Channel(f"velocity_target.{a}", "m/s", "Commanded velocity, NED") for a in "xyz"),
    *(Channel(f"attitude_target.{a}", "rad", "Commanded attitude") for a in ("roll", "pitch", "yaw")),
)
_FIRST_SENT = "thruster_force[1]"  # outputs before it stand for the beginning of a step, from it on for its end


class RemoteVehicle:
    """Plant of a run whose vehicle is behind a link."""

    # The outputs are the values that the autopilot reports, in the scene's frame, and NaN where it reports none. A step
    # sends the law's wrench if the session allows it, and lasts until its period is over.

    def __init__(self, scenario: Scenario, session: AutopilotSession) -> None:
        self._session, self._vehicle = session, scenario.vehicle
        self.name = scenario.vehicle.name
        outputs, flags, inputs = vehicle_channels(scenario.vehicle)
        self.inputs = Channels(inputs, np.zeros(len(inputs)))
        first = [channel.name for channel in outputs].index(_FIRST_SENT)
        all_outputs = (*outputs[:first], *_REPORTED_CHANNELS, *outputs[first:], *_SENT_CHANNELS)
        self.outputs = Channels(all_outputs, np.full(len(all_outputs), math.nan))
        self.flags = Channels(flags, np.zeros(len(flags), dtype=bool))
        self._index = {channel.name: i for i, channel in enumerate(self.outputs.channels)}
        # the vehicle's table ``autopilot`` describes an ArduSub's servo outputs, not a PX4's
        table = scenario.vehicle.autopilot if session.profile.name != "px4" else None
        n = scenario.vehicle.n_thrusters
        self._efforts = [] if table is None else [
            (channel, effort_of_pulse(table, sign))
            for channel, sign in zip(table.channels, table.sign_of_each(n), strict=True)
        ]  # fmt: skip
        self._updates = -1
        self._position: Array = np.full(3, math.nan)
        self._quaternion: Array = np.array([1.0, 0.0, 0.0, 0.0])
        self._begun: float | None = None
        self._count = 0

    def set(self, values: Mapping[str, float]) -> None:
        """Change nothing: parameters and start values are the real vehicle's own."""

    def initialize(self) -> None:
        """Write the reported state to the outputs."""
        self._read()

    def step(self, step: float) -> None:
        """Send the wrench of the inputs, and receive messages until the step of `step` seconds is over."""
        n, inputs = self._vehicle.n_thrusters, self.inputs.values
        wrench = self._vehicle.thruster_matrix @ inputs[:n] + inputs[n:]
        now = self._session.clock()
        if self._begun is None:
            self._begun = now
        due = self._begun + self._count * step
        self._session.exchange(wrench, due, due + step)
        if now - due > _MAX_DELAY:
            self._begun += now - due
        self._count += 1
        self._read()

    def read_flags(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return the Boolean outputs; all stay False, since an autopilot reports none."""
        return self.flags.values

    def close(self) -> None:
        """Do nothing: the caller closes the link."""

    def _read(self) -> None:
        session, reported = self._session, self._session.reported
        if reported.updates != self._updates:
            self._updates = reported.updates
            self._position, self._quaternion = reported.predict(session.clock())
        position, quaternion = session.alignment.to_scene(self._position), self._quaternion
        self._write("position.x", position)
        self._write("quaternion.e0", quaternion)
        self._write("velocity.u", reported.velocity_body)
        self._write("attitude.roll", quaternion_to_euler(quaternion.tolist()))
        self._write("altitude", (reported.altitude,))
        self._write("measured.depth", (position[2],))
        self._write("measured.velocity.u", reported.velocity_body[:3])
        self._write("measured.altitude", (reported.altitude,))
        self._write("measured.angular_velocity.p", reported.rates)
        self._write("measured.heading", (quaternion_to_euler(quaternion.tolist())[2],))
        self._write("measured.position.x", position)
        self._write_forces()
        supervisor = session.supervisor
        reason = _REASONS.get(supervisor.reason, 0)
        state = STATES.index(supervisor.state)
        status = reported.age(session.clock()), reported.mode, reported.is_armed
        self._write(
            "autopilot.age",
            (*status, *reported.position, *reported.velocity, session.alignment.drift, session.alignment.reckoned),
        )
        self._write("companion.state", (state, reason, session.lateness, reported.sync.round_trip))
        output = session.output
        self._write("stick.X", (*output.sticks, *output.velocity, *quaternion_to_euler(output.attitude.tolist())))

    def _write_forces(self) -> None:
        """Write the thruster forces [N] of the autopilot's servo outputs, and their wrench."""
        pulses, vehicle = self._session.reported.pulses, self._vehicle
        if not self._efforts or not pulses:
            return
        padded = (0, *pulses)  # channels count from 1
        efforts = np.array([effort(padded[c]) if 0 < c < len(padded) else 0.0 for c, effort in self._efforts])
        forces = efforts * np.where(efforts >= 0.0, vehicle.thrust_max, -vehicle.thrust_min)
        self._write("thruster_force[1]", forces)
        self._write("actuation.X", vehicle.thruster_matrix @ forces)

    def _write(self, first: str, values: Array | tuple[float, ...]) -> None:
        index = self._index[first]
        self.outputs.values[index : index + len(values)] = values
