"""What viewers order: read, checked, and given to the run, or refused with the reason."""

from __future__ import annotations

import copy
from collections.abc import Callable

import msgspec

from cosim.errors import OrderError
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import NO_ORDER, Change, Mission, Move, Order
from cosim.simulation.commands.settings import LiveSettings
from cosim.simulation.commands.sources import OrderQueue
from plant_fmu.errors import one_line

LONGEST = 16_384  # bytes of a message

_decoder = msgspec.json.Decoder(Order)


class Desk:
    """Takes the orders of all viewers of one run.

    Parameters
    ----------
    scenario : Scenario
        What is run.
    queue : OrderQueue or str
        Where orders go, or why there are none.
    has_come : callable
        Tells of the name of an obstacle that may come whether it is there.

    Attributes
    ----------
    settings : LiveSettings
        The numbers as they are once all orders are followed.
    """

    def __init__(self, scenario: Scenario, queue: OrderQueue | str, has_come: Callable[[str], bool]) -> None:
        self.settings = LiveSettings(scenario)
        self._queue, self._has_come = queue, has_come
        self._run = queue.run if isinstance(queue, OrderQueue) else 0
        self._movable = [name for name in scenario.moving if name != "goal"]
        self._comes = {secondary.region.name for secondary in scenario.regions if secondary.seen}

    def take(self, message: str | bytes) -> str | None:
        """Give the run what a viewer sent.

        Parameters
        ----------
        message : str or bytes
            An order, as the log of orders has it.

        Returns
        -------
        str or None
            Why it is refused; None where the next step follows it.
        """
        if isinstance(self._queue, str):
            return self._queue
        if isinstance(message, bytes):
            return "binary messages are no orders, expected a text of JSON"
        try:
            order = _decoder.decode(message)
            self._check(order)
            if not self._queue.give(order, self._run):
                return "the run is over" if self._queue.run != self._run else "too many orders at once"
        except NO_ORDER as error:
            return one_line(f"no order: {error}")
        except OrderError as error:
            return str(error)
        self.follow(order)
        return None

    def follow(self, order: Order) -> None:
        """Note an order that the run follows, whoever gave it.

        Raises
        ------
        OrderError
            If it changes what cannot be changed.
        """
        if isinstance(order, Change):
            self.settings.change(order.key, order.value)

    def _check(self, order: Order) -> None:
        match order:
            case Change():
                copy.deepcopy(self.settings).change(order.key, order.value)
            case Move() if order.region not in self._movable:
                raise OrderError(f"region is {order.region!r}, expected one of {', '.join(self._movable) or 'none'}")
            case Move() if order.region in self._comes and not self._has_come(order.region):
                raise OrderError(f"region is {order.region!r}: no such obstacle has come")
            case Mission():
                for item in order.items:
                    for inner in item.orders:
                        self._check(inner)
