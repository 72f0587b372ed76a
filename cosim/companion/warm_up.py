"""A few steps without a vehicle, so that nothing is loaded or compiled for the first time while one is steered."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cosim.companion.options import CompanionOptions
from cosim.companion.remote_vehicle import RemoteVehicle
from cosim.companion.session import AutopilotSession
from cosim.mavlink.wire.ground_end import Heard
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import Arm, Command
from cosim.simulation.master import Master

_STEPS = 3


class _NoLink:
    """A link to nobody, whose time goes by as it is waited for."""

    name, identity = "warm-up", (255, 191)

    def __init__(self) -> None:
        self._now = 0.0

    def clock(self) -> float:
        return self._now

    def receive(self, timeout: float) -> Sequence[Heard]:
        self._now += timeout
        return ()

    def send(self, message: Any) -> bool:
        return True


class _ArmAtFirst:
    """The command that lets the law work, at the first step."""

    exhausted = False

    def take(self, k: int) -> Sequence[Command]:
        return (Arm(True),) if k == 0 else ()


def warm_up(scenario: Scenario, options: CompanionOptions) -> None:
    """Make a few steps of a scenario with a vehicle that stands where it starts.

    Parameters
    ----------
    scenario : Scenario
        As it will be steered.
    options : CompanionOptions
        Likewise.

    Raises
    ------
    BuildError, LawError, DefinitionError
        If law or arbiter cannot be set up.
    """
    session = AutopilotSession(_NoLink(), scenario.vehicle, options)
    session.reported.position[:] = scenario.initial.position
    session.reported.velocity[:] = 0.0
    session.alignment.offset = np.zeros(3)
    with Master(scenario, plant=RemoteVehicle(scenario, session)) as master:
        master.plant.initialise()
        for k in range(_STEPS):
            master.step(k, _ArmAtFirst())
