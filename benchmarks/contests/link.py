"""A frame of an autopilot in lockstep."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.contest import Contest
from benchmarks.peer_environment import Environment

FRAMES = 6_000  # frames of a run


def contests(environment: Environment) -> Iterator[Contest]:
    """Yield the contests of the link."""
    yield Contest(
        "A frame of an autopilot in lockstep over loopback, both ways, plant and record",
        {"cosim sitl, record at 100 Hz": lambda _: _Lockstep()},
        count=FRAMES,
        repeats=3,
        pinned=False,
    )


class _Lockstep:
    """A contestant: whole runs, timed by the stand-in for an autopilot."""

    def seconds(self, count: int) -> float:
        from benchmarks.sitl import lockstep

        return lockstep(count, 1).median * count
