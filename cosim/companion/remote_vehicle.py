"""A vehicle behind a link in the place of the plant: the master steps it as it steps an FMU."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from cosim.companion.safety import CONDITIONS, STATES
from cosim.companion.session import AutopilotSession
from cosim.mavlink.vehicle.row_layout import euler_of
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array
from cosim.simulation.stepped_plant import vehicle_channels
from plant_fmu.autopilot import effort_of_pulse
from plant_fmu.running.channels import Channel, Channels

_NAMES = tuple(condition.name for condition in CONDITIONS)
_SHIFT = 0.1  # s, delay beyond which the loop shifts its schedule instead of catching up
_REPORTED = (  # channels that the autopilot reports, at the beginning of a step
    Channel("autopilot.age", "s", "Of the older one of position and attitude"),
    Channel("autopilot.mode", "", "Custom mode of the autopilot's heartbeat"),
    Channel("autopilot.armed", "", "The autopilot is armed"),
    *(Channel(f"autopilot.position.{a}", "m", "Position in the autopilot's own frame") for a in "xyz"),
    *(Channel(f"autopilot.velocity.{a}", "m/s", "Velocity in the autopilot's own frame, NED") for a in "xyz"),
    Channel("autopilot.drift", "m", "By which local position and globe or pressure have come apart"),
    Channel("autopilot.reckoned", "m", "Horizontal way since the frame is known, without a fix of the position"),
)
_SENT = (  # channels of the companion's own state and commands, in the step
    Channel("companion.state", "", f"Of the companion: {', '.join(f'{i} {state}' for i, state in enumerate(STATES))}"),
    Channel("companion.reason", "", "Condition that ended steering, from 1 in the order of the table; 0 for none"),
    Channel("companion.lateness", "s", "By which the step began too late"),
    Channel("companion.round_trip", "s", "Of the quickest TIMESYNC of late"),
    *(Channel(f"stick.{f}", "", "Stick that was sent, -1 to 1, along or about a body axis") for f in "XYZKMN"),
    *(Channel(f"velocity_target.{a}", "m/s", "Velocity that was asked for, NED") for a in "xyz"),
    *(Channel(f"attitude_target.{a}", "rad", "Attitude that was asked for") for a in ("roll", "pitch", "yaw")),
)
_FIRST_SENT = "thruster_force[1]"  # outputs before it stand for the beginning of a step, from it on for its end


class RemoteVehicle:
    """Plant of a run whose vehicle is behind a link.

    The outputs are the values that the autopilot reports, in the scene's frame, and NaN where it reports none. A step
    sends the law's wrench if the session allows it, and lasts until its period is over.

    Parameters
    ----------
    scenario : Scenario
        Scenario as it is flown, with its vehicle.
    session : AutopilotSession
        Message exchange with the autopilot.

    Attributes
    ----------
    inputs, outputs, flags : Channels
        Channels of the vehicle's FMU; the outputs also contain those of the link.
    """

    def __init__(self, scenario: Scenario, session: AutopilotSession) -> None:
        self._session, self._vehicle = session, scenario.vehicle
        self.name = scenario.vehicle.name
        outputs, flags, inputs = vehicle_channels(scenario.vehicle)
        self.inputs = Channels(inputs, np.zeros(len(inputs)))
        first = [channel.name for channel in outputs].index(_FIRST_SENT)
        all_outputs = (*outputs[:first], *_REPORTED, *outputs[first:], *_SENT)
        self.outputs = Channels(all_outputs, np.full(len(all_outputs), math.nan))
        self.flags = Channels(flags, np.zeros(len(flags), dtype=bool))
        self._at = {channel.name: i for i, channel in enumerate(self.outputs.channels)}
        # the vehicle's table ``autopilot`` describes an ArduSub's servo outputs, not a PX4's
        given = scenario.vehicle.autopilot if session.profile.name != "px4" else None
        self._channels = () if given is None else given.channels
        signs = () if given is None else np.broadcast_to(given.signs, len(self._channels)).tolist()
        self._efforts = [] if given is None else [effort_of_pulse(given, sign) for sign in signs]
        self._updates = -1
        self._place: Array = np.full(3, math.nan)
        self._quaternion: Array = np.array([1.0, 0.0, 0.0, 0.0])
        self._begun: float | None = None
        self._count = 0

    def set(self, values: Mapping[str, float]) -> None:
        """Change nothing: parameters and start values are the real vehicle's own."""

    def initialise(self) -> None:
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
        if now - due > _SHIFT:
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
        rates = reported.rates
        if reported.updates != self._updates:
            self._updates = reported.updates
            self._place, self._quaternion = reported.predict(session.clock())
        position, quaternion = session.alignment.to_scene(self._place), self._quaternion
        self._write("position.x", position)
        self._write("quaternion.e0", quaternion)
        self._write("velocity.u", reported.velocity_body)
        self._write("attitude.roll", euler_of(quaternion.tolist()))
        self._write("altitude", (reported.altitude,))
        self._write("measured.depth", (position[2],))
        self._write("measured.velocity.u", reported.velocity_body[:3])
        self._write("measured.altitude", (reported.altitude,))
        self._write("measured.angular_velocity.p", rates)
        self._write("measured.heading", (euler_of(quaternion.tolist())[2],))
        self._write("measured.position.x", position)
        self._write_forces()
        supervisor = session.supervisor
        reason = _NAMES.index(supervisor.reason) + 1 if supervisor.reason in _NAMES else 0
        state = float(STATES.index(supervisor.state))
        at = reported.age(session.clock()), reported.mode, reported.is_armed
        self._write(
            "autopilot.age",
            (*at, *reported.position, *reported.velocity, session.alignment.drift, session.alignment.reckoned),
        )
        self._write("companion.state", (state, reason, session.lateness, reported.sync.round_trip))
        output = session.output
        self._write("stick.X", (*output.sticks, *output.velocity, *euler_of(output.attitude.tolist())))

    def _write_forces(self) -> None:
        """Write the thruster forces [N] of the autopilot's servo outputs, and their wrench."""
        pulses, vehicle = self._session.reported.pulses, self._vehicle
        if not self._efforts or not pulses:
            return
        forces = np.zeros(vehicle.n_thrusters)
        for i, (channel, effort) in enumerate(zip(self._channels, self._efforts, strict=True)):
            part = effort(pulses[channel - 1]) if 0 < channel <= len(pulses) else 0.0
            forces[i] = part * (vehicle.thrust_max[i] if part >= 0.0 else -vehicle.thrust_min[i])
        self._write("thruster_force[1]", forces)
        self._write("actuation.X", vehicle.thruster_matrix @ forces)

    def _write(self, first: str, values: Array | tuple[float, ...]) -> None:
        at = self._at[first]
        self.outputs.values[at : at + len(values)] = values
