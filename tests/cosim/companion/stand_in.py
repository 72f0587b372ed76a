"""An autopilot for tests: our own vehicle on our FMU, behind a link with recorded lags. Its clock is the run's.

Messages of the autopilot come 12 ms late and sticks act 55 ms late, as a real ArduSub was measured to do.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.autopilot import Autopilot
from cosim.mavlink.vehicle.profile import PROFILES
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.ground_end import ReceivedMessage
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands.commands import Arm, SetMode
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.master import Master

DOWN, UP = 0.012, 0.055  # s, from the autopilot and to it
IDENTITY = (255, 191)


class StandIn:
    """A link to a simulated vehicle; waiting for a message is what lets its time go by."""

    name = "stand-in"
    identity = IDENTITY

    def __init__(
        self, scenario="pipe-inspection", profile="ardusub", shift=(0.0, 0.0, 0.0), overrides=(), armed=True, silent=(),
        obeys=None, routed=False,
    ):  # fmt: skip
        enabled = ["commands.enabled=true", "commands.await_arm=true", "commands.obstacles=0", "time.duration=3600"]
        self.master = Master(load_scenario(scenario, [*enabled, *overrides]))
        self.step, self.k = self.master.scenario.time.step, 0
        self.queue = CommandQueue()
        self.profile = PROFILES[profile]
        options = MavlinkOptions(profile=profile, commands=True)
        self.context = VehicleContext(self.master.scenario, self.master.signals.columns, options, self.queue)
        self.autopilot = Autopilot(self.context)
        self.shift = np.array(shift)  # m: of the scene's origin in the autopilot's own frame
        self.cut = False  # True: no link at all
        self.refused_commands, self.silent = set(), set(silent)  # commands and messages that go nowhere
        self.obeys = obeys  # the one system whose sticks reach the vehicle, as an ArduSub's SYSID_MYGCS; None: any
        self.routed = routed  # True: mavlink-router stands between
        self.tamper = {}  # what is done to a message of a kind on its way
        self.events = []  # times, and what happens then
        self.stall = 0.0  # s, for which the companion's computer does nothing
        self._up, self._down = deque(), deque()
        self._ours = mavlink.MAVLink(None, *IDENTITY)
        self._its = mavlink.MAVLink(None, 1, 1)
        self._ours_reader, self._its_reader = mavlink.MAVLink(None), mavlink.MAVLink(None)
        self.sent = []  # messages that the companion sent, with their times
        self.rows = []
        self.at = dict(zip((c.name for c in self.master.signals.columns), range(10**6), strict=False))
        if armed:
            self.queue.submit(Arm(True))
        self.queue.submit(SetMode("hold"))
        self.autopilot.attach(self)
        self._advance()

    # ---- what the autopilot's side sees ----

    def has_room(self):
        return True

    def _deliver(self, message):
        if message.get_type() == "LOCAL_POSITION_NED":
            message.x, message.y, message.z = np.array([message.x, message.y, message.z]) + self.shift
        self.tamper.get(message.get_type(), lambda m: None)(message)
        if self.cut or message.get_type() in self.silent:
            return
        (decoded,) = self._ours_reader.parse_buffer(message.pack(self._its))
        self._its.seq = (self._its.seq + 1) % 256
        self._down.append((self.clock() + DOWN, decoded))

    # ---- what the companion's side sees ----

    def clock(self):
        return self.k * self.step + 100.0

    def receive(self, timeout):
        until = self.clock() + timeout + self.stall
        if self.stall:
            while self.clock() < until:
                self._advance()
            self.stall = 0.0
        while not (self._down and self._down[0][0] <= self.clock()) and self.clock() < until - 1e-9:
            self._advance()
        heard = []
        while self._down and self._down[0][0] <= self.clock():
            _, message = self._down.popleft()
            sender = message.get_srcSystem(), message.get_srcComponent()
            heard.append(ReceivedMessage(self.clock(), *sender, 0, message.get_type(), message))
        return heard

    def send(self, message):
        if self._speaking:
            self._deliver(message)
            return True
        (decoded,) = self._its_reader.parse_buffer(message.pack(self._ours))
        self.sent.append((self.clock(), decoded))
        refused = message.get_type() == "COMMAND_LONG" and message.command in self.refused_commands
        if not self.cut and not refused:
            self._up.append((self.clock() + UP, decoded))
        return True

    def hear(self, message, system=255, component=190):
        """Let somebody else say something, to the vehicle and to whoever listens.

        mavlink-router forwards a message with a target only to endpoints that have shown its system.
        """
        (decoded,) = mavlink.MAVLink(None).parse_buffer(message.pack(mavlink.MAVLink(None, system, component)))
        if self.obeys in (None, system) or message.get_type() != "MANUAL_CONTROL":
            self._up.append((self.clock(), decoded))
        target = getattr(decoded, "target", getattr(decoded, "target_system", 0))
        if not self.routed or target in (0, IDENTITY[0]):
            self._down.append((self.clock(), decoded))

    # ---- time ----

    _speaking = True

    def _advance(self):
        self._speaking = True
        while self.events and self.events[0][0] <= self.clock() - 100.0:
            self.events.pop(0)[1]()
        while self._up and self._up[0][0] <= self.clock():
            self.autopilot.receive(self, self._up.popleft()[1], self.clock())
        self.master.step(self.k, self.queue)
        self.k += 1
        self.rows.append(self.master.row.copy())
        self.autopilot.observe(self.rows[-1])
        self.autopilot.tick(self.clock())
        self._speaking = False

    def of_type(self, *kinds):
        """Return the messages of these types that the companion sent."""
        return [message for _, message in self.sent if message.get_type() in kinds]

    def now(self, name):
        return self.rows[-1][self.at[name]]

    def mode(self):
        return int(self.now("commands.mode"))

    def column(self, name):
        return np.array(self.rows)[:, self.at[name]]
