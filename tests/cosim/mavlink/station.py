"""A ground station without a network; its messages pass through the wire format both ways."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
from msgspec.structs import astuple
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.autopilot import Autopilot
from cosim.mavlink.vehicle.profile import PROFILES
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.scenario.scenario import Scenario, load_scenario
from cosim.simulation.commands import CommandQueue
from cosim.simulation.signals import Column

NAN = math.nan

COLUMNS = tuple(
    Column(name, "", "")
    for name in (
        "time", *(f"position.{a}" for a in "xyz"), *(f"quaternion.e{i}" for i in range(4)),
        *(f"velocity.{v}" for v in "uvwpqr"), "attitude.roll", "attitude.pitch", "attitude.yaw", "altitude",
        "measured.depth", "measured.altitude", *(f"measured.acceleration.{a}" for a in "xyz"),
        *(f"measured.angular_velocity.{v}" for v in "pqr"), *(f"thruster_force[{i}]" for i in range(1, 9)),
        *(f"thrust_saturated[{i}]" for i in range(1, 9)), "wrench_saturated", "bottom_contact",
        *(f"{name}.value" for name in ("goal", "SR1", "SR2", "SR3", "seen 1", "seen 2")),
        *(f"{name}.clearance" for name in ("goal", "SR1", "SR2", "SR3", "seen 1", "seen 2")),
        *(f"membership.{c}" for c in ("obstacle", "shape", "depth")),
        *(f"weight.{c}" for c in ("obstacle", "shape", "depth")), *(f"estimate.phi{i}" for i in range(1, 5)),
        *(f"command.{f}" for f in "XYZKMN"), "allocation_saturated", *(f"thrust[{i}]" for i in range(1, 9)),
        *(f"{name}.shift.{a}" for name in ("goal", "SR1", "seen 1", "seen 2") for a in "xyz"), "commands.armed",
        "commands.mode", "commands.item", "target.x", "target.y", "target.z", "law.constraint_slack",
    )
)  # fmt: skip
AT = {column.name: i for i, column in enumerate(COLUMNS)}


def scenario(*overrides: str, name: str = "paper-deployable") -> Scenario:
    return load_scenario(name, ["commands.enabled=true", "commands.obstacles=2", *overrides])


def row(**values: Any) -> np.ndarray:
    """Return a row of an armed vehicle that reaches for its target; names have `_` for dots, or are whole groups."""
    new = np.zeros(len(COLUMNS))
    defaults = {
        "position.x": (1.0, 2.0, 5.0), "quaternion.e0": 1.0,
        "commands.armed": 1.0, "commands.mode": 2.0, "commands.item": -1.0,
        "target.x": (8.0, 0.0, 5.0), "goal.clearance": (-3.0, 2.0, 2.0, 2.0, 1e5, 1e5), "measured.depth": 5.0,
        "altitude": 1e6, "measured.altitude": 1e6,
    }  # fmt: skip
    for name, value in {**defaults, **{key.replace("__", "."): v for key, v in values.items()}}.items():
        numbers = np.atleast_1d(value)
        new[AT[name] : AT[name] + numbers.size] = numbers
    return new


def close_to(commands: list[Any], expected: list[Any], tolerance: float = 1e-6) -> bool:
    """Compare commands, with numbers within a tolerance."""

    def flat(value: Any) -> list[Any]:
        return [x for item in value for x in flat(item)] if isinstance(value, tuple | list) else [value]

    given, wanted = ([x for c in each for x in (type(c), *flat(astuple(c)))] for each in (commands, expected))
    return given == pytest.approx(wanted, abs=tolerance)


class Wire:
    """A link that encodes and decodes what is sent."""

    def __init__(self, name: str = "wire") -> None:
        self.name = name
        self.got: list[Any] = []
        self.room = True
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
        return [message.text for message in self.of("STATUSTEXT")]

    def counts(self) -> Counter[str]:
        return Counter(message.get_type() for message in self.got)

    def clear(self) -> None:
        self.got.clear()


class Station:
    """An autopilot with one link, and a station at its other end."""

    def __init__(
        self, profile: str = "ardusub", commands: bool = True, of: Scenario | None = None, **options: Any
    ) -> None:
        self.commands, self.profile = CommandQueue(), PROFILES[profile]
        self.autopilot = Autopilot(
            of or scenario(), COLUMNS, MavlinkOptions(profile=profile, commands=commands, **options), self.commands
        )  # type: ignore[arg-type]
        self.wire = Wire()
        self.now = 100.0
        self.autopilot.attach(self.wire)
        self.autopilot.tick(self.now)
        self.wire.clear()

    def look(self, time: float = 1.0, **values: Any) -> None:
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

    def command(self, number: int, *numbers: float, fill: float = NAN, **who: Any) -> Any:
        """Send COMMAND_LONG, and return its one acknowledgement."""
        filled = [*numbers, *[fill] * (7 - len(numbers))]
        return self._acknowledged(mavlink.MAVLink_command_long_message(1, 1, number, 0, *filled), **who)

    def command_int(self, number: int, frame: int, numbers: tuple[float, ...], x: int, y: int, z: float) -> Any:
        """Send COMMAND_INT, and return its one acknowledgement."""
        return self._acknowledged(mavlink.MAVLink_command_int_message(1, 1, frame, number, 0, 0, *numbers, x, y, z))

    def _acknowledged(self, message: Any, **who: Any) -> Any:
        replies = self.send(message, **who)
        (ack,) = [reply for reply in replies if reply.get_type() == "COMMAND_ACK"]
        assert (ack.command, ack.target_system, ack.target_component) == (message.command, who.get("system", 255), 190)
        return ack.result

    def commanded(self) -> list[Any]:
        """Take the commands that were given."""
        return list(self.commands.take(0))
