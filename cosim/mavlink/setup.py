"""A run's MAVLink side, from what the user says to a running link."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cosim.mavlink.autopilot import Autopilot
from cosim.mavlink.thread import LinkThread
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.link import open_links
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands import CommandQueue
from cosim.simulation.signals import Column


@dataclass(frozen=True)
class Mavlink:
    """Where a run is to be a MAVLink vehicle, and how.

    Examples
    --------
    >>> import cosim
    >>> link = cosim.Mavlink((cosim.parse_endpoint("udpout:127.0.0.1:14550"),), cosim.MavlinkOptions(profile="ardusub"))
    >>> link.options.system_id
    1
    """

    endpoints: tuple[Endpoint, ...]
    options: MavlinkOptions

    def open(
        self, scenario: Scenario, columns: Sequence[Column], commands: CommandQueue | None, rate: float | None
    ) -> LinkThread:
        """Open all links.

        Parameters
        ----------
        scenario : Scenario
            What is run.
        columns : sequence of Column
            Of its rows.
        commands : CommandQueue or None
            Where commands go; None heeds none.
        rate : float or None
            Simulated seconds a second at the most; None for as many as can be.

        Returns
        -------
        LinkThread
            Not started yet.

        Raises
        ------
        TelemetryError
            If a link cannot be opened.
        """
        autopilot = Autopilot(scenario, columns, self.options, commands if self.options.commands else None)
        links = open_links(self.endpoints, self.options)
        return LinkThread(autopilot, links, scenario.time.step, ahead(scenario, rate))


def ahead(scenario: Scenario, rate: float | None) -> float:
    """Return by how much simulated time may get ahead of the wall clock [s], at a rate; None for any."""
    return scenario.time.duration if rate is None or rate > 1.0 else 0.0
