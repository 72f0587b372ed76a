"""Where orders come from: a queue that another thread fills, or the log of an earlier run."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Annotated, Protocol

import msgspec

from cosim.errors import OrderError, RunError
from cosim.scenario.validation import MAX_STEPS
from cosim.simulation.commands.commands import NO_ORDER, Order, check_order

QUEUED = 256  # orders between two steps; further ones are refused


class OrderSource(Protocol):
    """Gives the orders of each step."""

    def take(self, k: int) -> Sequence[Order]:
        """Return the orders to be applied at the beginning of step `k`."""
        ...

    @property
    def exhausted(self) -> bool:
        """Whether no order will come any more."""
        ...


class OrderQueue:
    """Orders from another thread, in the order in which they were given. Bounded: a flood is refused, not kept.

    Attributes
    ----------
    run : int
        Which run takes them; the next one after a reset.
    """

    exhausted = False

    def __init__(self) -> None:
        self.run = 0
        self._orders: deque[Order] = deque()
        self._lock = threading.Lock()

    def give(self, order: Order, run: int | None = None) -> bool:
        """Queue an order for the next step.

        Parameters
        ----------
        order : Order
            To be applied.
        run : int, optional
            The run that it is meant for; default: whichever takes it.

        Returns
        -------
        bool
            Whether there was room for it, and that run is not over.

        Raises
        ------
        OrderError
            If its numbers cannot be.
        """
        check_order(order)
        with self._lock:
            if len(self._orders) >= QUEUED or run not in (None, self.run):
                return False
            self._orders.append(order)
        return True

    def end_run(self) -> None:
        """Forget what is queued, and refuse what still comes for the run that is over."""
        with self._lock:
            self.run += 1
            self._orders.clear()

    def take(self, k: int) -> Sequence[Order]:
        """Return what is queued, whatever the step `k`."""
        taken = []
        while self._orders:
            taken.append(self._orders.popleft())
        return taken


class _Entry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A line of the log."""

    step: Annotated[int, msgspec.Meta(ge=0, le=MAX_STEPS)]
    order: Order


def read_log(file: Path) -> list[tuple[int, Order]]:
    """Return the orders of an earlier run, each with the step that took it, in their order.

    A last line that was cut off, by a kill or a full disk, does not count: that run did not follow it either.

    Parameters
    ----------
    file : Path
        The log.

    Returns
    -------
    list of (int, Order)
        As they were followed.

    Raises
    ------
    RunError
        If it cannot be read, or a line is no order.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise RunError(f"{file}: {error.strerror or error}") from error
    lines, whole = content.splitlines(), content.count(b"\n")
    entries = []
    for number, line in enumerate(lines, 1):
        try:
            entry = msgspec.json.decode(line, type=_Entry)
            check_order(entry.order)
        except (*NO_ORDER, OrderError) as error:
            if type(error) in (msgspec.DecodeError, UnicodeDecodeError) and number > whole:
                break
            raise RunError(f"{file}, line {number}: {error}") from error
        entries.append((entry.step, entry.order))
    return sorted(entries, key=lambda entry: entry[0])


class RecordedOrders:
    """The orders of an earlier run, at the steps at which that run took them.

    Parameters
    ----------
    file : Path
        The log, as for `read_log`.

    Raises
    ------
    RunError
        If it cannot be read, or a line is no order.
    """

    def __init__(self, file: Path) -> None:
        self._entries = deque(read_log(file))

    @property
    def exhausted(self) -> bool:
        """Whether no order is left."""
        return not self._entries

    def take(self, k: int) -> Sequence[Order]:
        """Return the orders of step `k`, and of earlier ones that were not taken."""
        taken = []
        while self._entries and self._entries[0][0] <= k:
            taken.append(self._entries.popleft()[1])
        return taken


class LoggedOrders:
    """Another source, of which each order that is taken is written down at once, so that a killed run has its log.

    Parameters
    ----------
    source : OrderSource
        Where the orders come from.
    file : Path
        The log; made when the first order is taken.
    tell : callable, optional
        Told of each step that takes orders, and of these, once they are written.
    """

    def __init__(
        self, source: OrderSource, file: Path, tell: Callable[[int, Sequence[Order]], None] | None = None
    ) -> None:
        self._source, self._file, self._tell = source, file, tell

    @property
    def exhausted(self) -> bool:
        """Whether no order will come any more."""
        return self._source.exhausted

    def take(self, k: int) -> Sequence[Order]:
        """Return the orders of step `k`, once they are written."""
        orders = self._source.take(k)
        if orders:
            self._write(_Entry(k, order) for order in orders)
            if self._tell is not None:
                self._tell(k, orders)
        return orders

    def _write(self, entries: Iterable[_Entry]) -> None:
        with self._file.open("ab") as file:
            file.write(b"".join(msgspec.json.encode(entry) + b"\n" for entry in entries))
