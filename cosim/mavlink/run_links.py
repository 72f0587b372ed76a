"""The MAVLink links of a run, from the user's options to a link thread."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cosim.mavlink.autopilot import Autopilot
from cosim.mavlink.thread import LinkThread
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.link import open_links
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.signals import Column


@dataclass(frozen=True)
class Mavlink:
    """Endpoints and options of a run's MAVLink links.

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
            The scenario of the run.
        columns : sequence of Column
            Columns of the run's rows.
        commands : CommandQueue or None
            Queue that receives the commands; None accepts none.
        rate : float or None
            Greatest number of simulated seconds per second of the wall clock; None for no limit.

        Returns
        -------
        LinkThread
            The thread of the links, not started yet.

        Raises
        ------
        TelemetryError
            If a link cannot be opened.
        """
        autopilot = Autopilot(VehicleContext(scenario, columns, self.options, commands))
        links = open_links(self.endpoints, self.options)
        return LinkThread(autopilot, links, scenario.time.step, max_lead(scenario, rate))


def max_lead(scenario: Scenario, rate: float | None) -> float:
    """Return the longest time [s] by which simulated time can lead the wall clock; a `rate` of None is no limit."""
    return scenario.time.duration if rate is None or rate > 1.0 else 0.0
