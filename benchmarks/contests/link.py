"""A message of MAVLink, and a frame of an autopilot in lockstep."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

from benchmarks.contest import Contest
from benchmarks.peer_environment import Environment
from benchmarks.peer_process import peer
from benchmarks.timing import Contestant, Own, each

SOURCE = (1, 1)  # system id and component id of the sender
ATTITUDE = (1, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)  # fields of the message: ms; rad; rad/s
FRAMES = 6_000  # frames of a run


def contests(environment: Environment) -> Iterator[Contest]:
    """Yield the contests of the link."""
    setup = {"source": SOURCE, "fields": ATTITUDE}
    yield Contest(
        "A frame of MAVLink 2 made of an ATTITUDE message",
        {"Framer.frame": _frame},
        {
            "pymavlink, message.pack": lambda stack: stack.enter_context(
                peer(environment, "pymavlink", "pymavlink_frames", "attitude", setup)
            )
        },
    )
    yield Contest(
        "A frame of an autopilot in lockstep over loopback, both ways, plant and record",
        {"cosim sitl, record at 100 Hz": lambda _: _Lockstep()},
        count=FRAMES,
        repeats=3,
        pinned=False,
    )


def _frame(_: ExitStack) -> Contestant:
    from cosim.mavlink.wire.dialect import dialect
    from cosim.mavlink.wire.framing import Framer

    framer, message = Framer(SOURCE), dialect().MAVLink_attitude_message(*ATTITUDE)

    def frame() -> None:
        framer.encode(message)
        framer.seq = (framer.seq + 1) % 256

    return Own(each(frame))


class _Lockstep:
    """A contestant: whole runs, timed by the stand-in for an autopilot."""

    def seconds(self, count: int) -> float:
        from benchmarks.sitl import lockstep

        return lockstep(count, 1).median * count
