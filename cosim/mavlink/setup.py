"""A run's MAVLink side, from what the user says to a running link."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cosim.helm import OrderQueue
from cosim.mavlink.autopilot import Autopilot
from cosim.mavlink.endpoint import Endpoint
from cosim.mavlink.link import open_links
from cosim.mavlink.options import MavlinkOptions
from cosim.mavlink.thread import LinkThread
from cosim.scenario import Scenario
from cosim.signals import Column


@dataclass(frozen=True)
class Mavlink:
    """Where a run is to be a MAVLink vehicle, and how."""

    endpoints: tuple[Endpoint, ...]
    options: MavlinkOptions

    def open(self, scenario: Scenario, columns: Sequence[Column], orders: OrderQueue | None) -> LinkThread:
        """Open all links.

        Parameters
        ----------
        scenario : Scenario
            What is run.
        columns : sequence of Column
            Of its rows.
        orders : OrderQueue or None
            Where commands go; None heeds none.

        Returns
        -------
        LinkThread
            Not started yet.

        Raises
        ------
        TelemetryError
            If a link cannot be opened.
        """
        autopilot = Autopilot(scenario, columns, self.options, orders if self.options.commands else None)
        return LinkThread(autopilot, open_links(self.endpoints, self.options), scenario.time.step)
