"""A few steps without a vehicle, so that all code is loaded and compiled before a vehicle is steered."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cosim.companion.companion_options import CompanionOptions
from cosim.companion.remote_vehicle import RemoteVehicle
from cosim.companion.session import AutopilotSession
from cosim.mavlink.wire.ground_end import ReceivedMessage
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import Arm
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.master import Master

_STEPS = 3


class _NoLink:
    """Link without a peer, whose clock advances by the timeouts of `receive`."""

    name, identity = "warm-up", (255, 191)

    def __init__(self) -> None:
        self._now = 0.0

    def clock(self) -> float:
        return self._now

    def receive(self, timeout: float) -> Sequence[ReceivedMessage]:
        self._now += timeout
        return ()

    def send(self, message: Any) -> bool:
        return True


def warm_up(scenario: Scenario, options: CompanionOptions) -> None:
    """Run three steps of a scenario with a vehicle that rests at its initial position."""
    session = AutopilotSession(_NoLink(), scenario.vehicle, options)
    session.reported.position[:] = scenario.initial.position
    session.reported.velocity[:] = 0.0
    session.alignment.offset = np.zeros(3)
    commands = CommandQueue()
    commands.submit(Arm(True))  # starts the law
    with Master(scenario, plant=RemoteVehicle(scenario, session)) as master:
        master.plant.initialize()
        for k in range(_STEPS):
            master.step(k, commands)
