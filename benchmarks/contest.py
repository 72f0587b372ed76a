"""A comparison of this project with peers in turns; a missing contestant does not stop the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, field

from benchmarks.machine import pinned
from benchmarks.table import Row, Table
from benchmarks.timing import Contestant, NotMeasuredError, Timing, take_turns

Entry = Callable[[ExitStack], Contestant]  # makes a contestant; the stack closes the resources that it opens


@dataclass(frozen=True)
class Contest:
    """Contestants that are timed together."""

    title: str  # description of an item
    ours: Mapping[str, Entry]  # entries by their names in the table
    peers: Mapping[str, Entry] = field(default_factory=dict)
    pairs: tuple[tuple[str, str], ...] = ()  # this project's entry and a peer, "" for none; empty: each with each
    count: int | None = None  # items per repeat, if they are long
    repeats: int | None = None  # greatest number of repeats, if the items are long
    pinned: bool = True  # on one processor; False if an item is the work of several processes

    def measure(self, budget: float, repeats: int) -> Table:
        """Time all contestants, and return a row for each pair: the ratio of a peer's time to this project's."""
        with pinned() if self.pinned else nullcontext(), ExitStack() as stack:
            contestants = {name: entered(entry, stack) for name, entry in (self.ours | self.peers).items()}
            few = min(repeats, self.repeats or repeats)
            timings = dict(zip(contestants, take_turns([*contestants.values()], budget, few, self.count), strict=True))
        return Table(self.title, tuple(_row(our, peer, timings) for our, peer in self._pairs()))

    def _pairs(self) -> tuple[tuple[str, str], ...]:
        if self.pairs:
            return self.pairs
        return tuple((our, peer) for our in self.ours for peer in self.peers or [""])


def _row(our: str, peer: str, timings: Mapping[str, Timing | str]) -> Row:
    if not peer:
        return Row(our, timings[our])
    return Row(our, timings[our], peer, timings[peer], is_paired=True)


def entered(entry: Entry, stack: ExitStack) -> Contestant | str:
    """Return the contestant of an entry, or the reason why it cannot be made."""
    try:
        return entry(stack)
    except NotMeasuredError as why:
        return str(why)
    except Exception as error:  # noqa: BLE001 -- a contestant that cannot start does not stop the others
        return " ".join(f"{type(error).__name__}: {error}".split())
