"""A ground station without a network; its messages pass through the wire format both ways."""

from __future__ import annotations

import math
from collections import Counter
from functools import cache
from typing import Any

import numpy as np
import pytest
from msgspec.structs import astuple
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.autopilot import Autopilot
from cosim.mavlink.vehicle.profile import PROFILES
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.scenario.scenario import Scenario, load_scenario
from cosim.simulation.columns import column_names
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.signals import Column
from tests.cosim.mavlink.stubs import message

NAN = math.nan
ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)  # MAV_RESULT
HEARTBEAT = message("HEARTBEAT", type=6, autopilot=8, system_status=4, mavlink_version=3)  # of a ground station


@cache
def scenario(*overrides: str, name: str = "paper-deployable") -> Scenario:
    return load_scenario(name, ["commands.enabled=true", "commands.obstacles=2", *overrides])


COLUMNS = tuple(Column(name, "", "") for name in column_names(scenario()))
AT = {column.name: i for i, column in enumerate(COLUMNS)}


def row(**values: Any) -> np.ndarray:
    """Return a row of an armed vehicle that reaches for its target; values may be those of columns that follow."""
    new = np.zeros(len(COLUMNS))
    defaults = {
        "position.x": (1.0, 2.0, 5.0), "quaternion.e0": 1.0,
        "commands.armed": 1.0, "commands.mode": 2.0, "commands.item": -1.0,
        "target.x": (8.0, 0.0, 5.0), "goal.clearance": (-3.0, 2.0, 2.0, 2.0, 1e5, 1e5), "measured.depth": 5.0,
        "altitude": 1e6, "measured.altitude": 1e6,
    }  # fmt: skip
    for name, value in (defaults | values).items():
        numbers = np.atleast_1d(value)
        new[AT[name] : AT[name] + numbers.size] = numbers
    return new


def long(number: int, *numbers: float, fill: float = NAN) -> Any:
    """Return a COMMAND_LONG to the vehicle."""
    return mavlink.MAVLink_command_long_message(1, 1, number, 0, *numbers, *[fill] * (7 - len(numbers)))


def set_parameter(name: str, value: float, kind: int = mavlink.MAV_PARAM_TYPE_REAL32) -> Any:
    return mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, kind)


def close_to(commands: list[Any], expected: list[Any], tolerance: float = 1e-6) -> bool:
    """Compare commands, with numbers within a tolerance."""

    def flat(value: Any) -> list[Any]:
        return [x for item in value for x in flat(item)] if isinstance(value, tuple | list) else [value]

    given, wanted = ([x for c in each for x in (type(c), *flat(astuple(c)))] for each in (commands, expected))
    return given == pytest.approx(wanted, abs=tolerance)


class Wire:
    """A link that encodes and decodes what is sent."""

    def __init__(self, name: str = "wire") -> None:
        self.name, self.room, self.got, self._n_read = name, True, [], 0
        self._coder = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self._decoder = mavlink.MAVLink(None)
        self._decoder.robust_parsing = False

    def has_room(self) -> bool:
        return self.room

    def send(self, message: Any) -> bool:
        messages = self._decoder.parse_buffer(message.pack(self._coder))
        for text in (m for m in messages if m.get_type() == "STATUSTEXT"):
            assert text.text.isascii() and text.text.isprintable() and text.severity <= 7
        self.got += messages
        return True

    def of(self, name: str) -> list[Any]:
        return [message for message in self.got if message.get_type() == name]

    @property
    def texts(self) -> list[str]:
        """The texts, each whole."""
        whole: list[str] = []
        for text in self.of("STATUSTEXT"):
            whole[-1 if text.chunk_seq else len(whole) :] = [(whole[-1] if text.chunk_seq else "") + text.text]
        return whole

    def new_texts(self) -> list[str]:
        """Return the texts since the last call."""
        texts, self._n_read = self.texts[self._n_read :], len(self.texts)
        return texts

    def counts(self) -> Counter[str]:
        return Counter(message.get_type() for message in self.got)

    def clear(self) -> None:
        self.got.clear()
        self._n_read = 0


class Station:
    """An autopilot with one link, and a station at its other end."""

    def __init__(
        self, profile: str = "ardusub", commands: bool = True, of: Scenario | None = None, **options: Any
    ) -> None:
        self.commands, self.profile = CommandQueue(), PROFILES[profile]
        link_options = MavlinkOptions(profile=profile, commands=commands, **options)  # type: ignore[arg-type]
        self.context = VehicleContext(of or scenario(), COLUMNS, link_options, self.commands)
        self.autopilot = Autopilot(self.context)
        self.wire, self.now, self.time = Wire(), 100.0, 0.0
        self.autopilot.attach(self.wire)
        self.autopilot.tick(self.now)
        self.wire.clear()

    def look(self, time: float = 1.0, **values: Any) -> None:
        self.time = time
        self.autopilot.observe(row(time=time, **values))

    def wait(self, seconds: float, every: float = 0.02) -> None:
        for _ in range(round(seconds / every)):
            self.now += every
            self.autopilot.tick(self.now)

    def send(self, message: Any, system: int = 255, component: int = 190, wire: Wire | None = None) -> list[Any]:
        """Send a message, and return the replies."""
        coder = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        (decoded,) = mavlink.MAVLink(None).parse_buffer(message.pack(coder))
        wire = wire or self.wire
        before = len(wire.got)
        self.autopilot.receive(wire, decoded, self.now)
        return wire.got[before:]

    def acknowledged(self, message: Any, **who: Any) -> int:
        """Send a command, and return the result of its one acknowledgement."""
        (ack,) = [reply for reply in self.send(message, **who) if reply.get_type() == "COMMAND_ACK"]
        assert (ack.command, ack.target_system, ack.target_component) == (message.command, who.get("system", 255), 190)
        return int(ack.result)

    def command(self, number: int, *numbers: float, **who: Any) -> int:
        return self.acknowledged(long(number, *numbers), **who)

    def request(self, message_id: int, *numbers: float) -> list[Any]:
        """Request a message, and return what comes of that kind."""
        self.wire.clear()
        self.command(mavlink.MAV_CMD_REQUEST_MESSAGE, message_id, *numbers)
        return self.wire.of(mavlink.mavlink_map[message_id].msgname)

    def commanded(self) -> list[Any]:
        """Take the commands that were given."""
        return list(self.commands.take(0))

    def play(self, *steps: Any, tolerance: float = 1e-6) -> None:
        """Play an exchange.

        A message is sent, with a number after it in a tuple as a command that this is the MAV_RESULT of; a float [s]
        is waited for; values of columns are shown by a row; a list holds the commands since the one before; a text
        is part of a text since the previous such step, None expects no text.
        """
        for step in steps:
            match step:
                case float():
                    self.wait(step)
                case dict():
                    self.look(self.time + 0.1, **step)
                case list():
                    commands = self.commanded()
                    assert close_to(commands, step, tolerance), commands
                case str() | None:
                    texts = self.wire.new_texts()
                    assert texts == [] if step is None else any(step in text for text in texts), (step, texts)
                case (message, result):
                    assert self.acknowledged(message) == result, message
                case _:
                    self.send(step)
