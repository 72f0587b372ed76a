"""Ours and peers that take turns at one thing, each of which may be missing without harm to the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, field

from benchmarks.machine import pinned
from benchmarks.table import Row, Table
from benchmarks.timing import Contestant, NotMeasuredError, Timing, take_turns

Entry = Callable[[ExitStack], Contestant]  # makes a contestant; what it opens goes on the stack


@dataclass(frozen=True)
class Contest:
    """What is timed together.

    Attributes
    ----------
    title : str
        What an item is.
    ours, peers : mapping from str to Entry
        By the names that they have in the table.
    pairs : tuple of (str, str), optional
        Which of ours stands against which peer, "" for none; default: each against each.
    count, repeats : int, optional
        Items a repeat, and the most repeats, where the items are long.
    pinned : bool
        Whether all stay on one processor; not where an item is the work of several processes.
    """

    title: str
    ours: Mapping[str, Entry]
    peers: Mapping[str, Entry] = field(default_factory=dict)
    pairs: tuple[tuple[str, str], ...] = ()
    count: int | None = None
    repeats: int | None = None
    pinned: bool = True

    def measure(self, budget: float, repeats: int) -> Table:
        """Time all, and return a row for each pair: how many times as long as ours a peer takes."""
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
    return Row(our, timings[our], peer, timings[peer], duel=True)


def entered(entry: Entry, stack: ExitStack) -> Contestant | str:
    """Return the contestant that an entry makes, or why it makes none."""
    try:
        return entry(stack)
    except NotMeasuredError as why:
        return str(why)
    except Exception as error:  # noqa: BLE001 -- one that cannot begin leaves the rest alone
        return " ".join(f"{type(error).__name__}: {error}".split())
