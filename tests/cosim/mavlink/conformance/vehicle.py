"""A running vehicle in this process, on loopback, for the length of a check."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator, Sequence

from cosim.errors import TelemetryError
from cosim.mavlink.autopilot import Autopilot
from cosim.mavlink.channels.udp import UdpIn
from cosim.mavlink.thread import LinkThread
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.ground_end import GroundLink
from cosim.mavlink.wire.link import open_links
from cosim.mavlink.wire.options import MavlinkOptions, ProfileName
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands import CommandQueue
from cosim.simulation.commands.commands import Reset
from cosim.simulation.master import Master
from cosim.simulation.signals import Array
from plant_fmu import PlantError

_SCENARIO = "paper-limited"
_OVERRIDES = ("commands.enabled=true", "time.duration=3600")
_STARTING = 120.0  # s, includes compilation
_HOST = "127.0.0.1"


class _FirstStep:
    """Observer that sets an event at the first step."""

    def __init__(self) -> None:
        self.event = threading.Event()

    def observe(self, k: int, row: Array) -> None:
        self.event.set()


@contextlib.contextmanager
def running_vehicle(endpoints: Sequence[Endpoint], options: MavlinkOptions) -> Iterator[LinkThread]:
    """Run a vehicle in a thread until the context ends."""
    scenario = load_scenario(_SCENARIO, _OVERRIDES)
    commands, begun = CommandQueue(), _FirstStep()
    with Master(scenario) as master:
        failures: list[PlantError] = []
        autopilot = Autopilot(scenario, master.signals.columns, options, commands)
        links = LinkThread(autopilot, open_links(endpoints, options), scenario.time.step)

        def step() -> None:
            try:
                master.run([begun, links], 1.0, commands)
            except PlantError as error:
                failures.append(error)

        stepper = threading.Thread(target=step, name="stepper", daemon=True)
        stepper.start()
        try:
            if not begun.event.wait(_STARTING):
                raise TelemetryError(f"the vehicle did not begin to move within {_STARTING:g} s")
            links.start()
            yield links
        finally:
            commands.submit(Reset())  # which ends the run
            stepper.join()
            links.close()
        if failures:
            raise failures[0]


@contextlib.contextmanager
def own_vehicle(profile: ProfileName) -> Iterator[GroundLink]:
    """Run a vehicle that accepts commands, and yield a link to it."""
    ground = Endpoint("udpin", f"own vehicle, profile {profile}", host=_HOST)  # port 0: any free port
    with GroundLink(ground) as link:
        assert isinstance(link.channel, UdpIn)
        port = link.channel.port
        vehicle = Endpoint("udpout", f"udpout:{_HOST}:{port}", host=_HOST, port=port)
        with running_vehicle([vehicle], MavlinkOptions(profile=profile, commands=True)):
            yield link
