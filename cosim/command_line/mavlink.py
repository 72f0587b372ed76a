"""``cosim mavlink``: listen, stream, hold and resume."""

from __future__ import annotations

import argparse
import contextlib
import math
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cosim.command_line.flags import add_remote, add_verb, flag, float_range, int_range, rate
from cosim.command_line.link_flags import add_link_flags, links_from, network_endpoint
from cosim.command_line.process import print_status, say

_REDRAW, _SNAPSHOT = 0.25, 1.0  # s between pictures, on a terminal and elsewhere
_ONCE = 2.0  # s of listening, for one picture
_ATTEMPTS, _ANSWER_TIMEOUT = 5, 0.5  # number, and seconds for the answer to one
_WIDE = 160  # characters of a line without a terminal
_HIDE, _SHOW, _CLEAR, _HOME, _END_OF_LINE, _BELOW = "\x1b[?25l", "\x1b[?25h", "\x1b[2J", "\x1b[H", "\x1b[K", "\x1b[J"


def add_verbs(verbs: Any) -> None:
    """Add the verb, with its own verbs, to the subparsers of the command."""
    mavlink = add_verb(
        verbs, "mavlink", listen, "show any vehicle's telemetry, stream a run, or command a companion", "mavlink",
        ("mavlink listen udpin:127.0.0.1:14550", "mavlink stream runs/docking --mavlink docking.tlog --rate max"),
    )  # fmt: skip
    inner = mavlink.add_subparsers(required=True, metavar="listen|stream|hold|resume")

    verb = add_verb(
        inner, "listen", listen, "show any vehicle's MAVLink telemetry as a live table", "mavlink",
        ("mavlink listen udpin:127.0.0.1:14550", "mavlink listen tcp:127.0.0.1:5760 --once"),
    )  # fmt: skip
    verb.add_argument("endpoint", metavar="ENDPOINT", help="such as udpin:127.0.0.1:14550 or tcp:127.0.0.1:5760")
    add_remote(verb)
    flag(verb, "--once", f"print one table, after {_ONCE:g} s, and end")
    flag(verb, "--seconds S", "end after so many seconds", float_range(1e-9, 1e9))
    flag(verb, "--count N", "end after so many messages", int_range(1, 10**12))

    verb = add_verb(
        inner, "stream", stream, "be a recorded run's vehicle on MAVLink links, or write it as a .tlog", "mavlink",
        ("mavlink stream runs/docking --mavlink udpout:127.0.0.1:14550 --profile ardusub",),
    )  # fmt: skip
    verb.add_argument("folder", type=Path, metavar="RUN", help="the run folder")
    add_link_flags(verb, required=True)
    flag(verb, "--rate N|max", "simulated seconds per second", rate, 1.0)

    for name, call, summary in (
        ("hold", hold, "let a companion release the sticks and hold its vehicle"),
        ("resume", resume, "let a companion steer again"),
    ):
        verb = add_verb(inner, name, call, summary, "howto/companion", (f"mavlink {name} udpout:127.0.0.1:14551",))
        verb.add_argument("endpoint", metavar="ENDPOINT", help="of the companion, such as udpout:127.0.0.1:14551")
        flag(verb, "--system-id N", "the companion's system id", int_range(1, 255), 255)
        add_remote(verb)


# ---- listen --------------------------------------------------------------------------------------------------------


def listen(options: argparse.Namespace) -> int:
    """Run ``cosim mavlink listen``."""
    from cosim.mavlink.listening import TelemetryTable, follow, format_table
    from cosim.mavlink.wire.ground_end import GroundLink

    watch = TelemetryTable()
    live = sys.stdout.isatty() and not options.once
    seconds = options.seconds or (_ONCE if options.once else None)
    period = _REDRAW if live else max(_SNAPSHOT, (seconds or 0.0) + 1.0 if options.once else 0.0)
    with GroundLink(*network_endpoint(options)) as link, _screen(live) as show:
        for now in follow(link, watch, period, seconds, options.count):
            size = shutil.get_terminal_size((_WIDE, 24))
            show(format_table(link, watch, now, *((size.columns, size.lines) if live else (_WIDE,))))
    return 0 if watch.total else 1


@contextlib.contextmanager
def _screen(live: bool) -> Any:
    """Yield a function that shows lines: on a terminal it replaces the earlier ones, else it appends."""
    if not live:
        yield _print
        return
    sys.stdout.write(_HIDE + _CLEAR)
    try:
        yield _redraw
    finally:
        sys.stdout.write(_SHOW + "\n")
        sys.stdout.flush()


def _print(lines: Sequence[str]) -> None:
    print("\n".join(lines), end="\n\n", flush=True)


def _redraw(lines: Sequence[str]) -> None:
    sys.stdout.write(_HOME + f"{_END_OF_LINE}\n".join(lines) + _END_OF_LINE + _BELOW)
    sys.stdout.flush()


# ---- hold, resume --------------------------------------------------------------------------------------------------


def hold(options: argparse.Namespace) -> int:
    """Run ``cosim mavlink hold``."""
    return _pause_or_continue(options, 0.0)


def resume(options: argparse.Namespace) -> int:
    """Run ``cosim mavlink resume``."""
    return _pause_or_continue(options, 1.0)


def _pause_or_continue(options: argparse.Namespace, parameter: float) -> int:
    """Send DO_PAUSE_CONTINUE until the companion answers."""
    from cosim.companion.autopilot_link import COMPANION
    from cosim.errors import TelemetryError
    from cosim.mavlink.wire.dialect import dialect, make_command
    from cosim.mavlink.wire.ground_end import GroundLink

    m, companion = dialect(), (options.system_id, COMPANION[1])
    command = make_command(m, companion[0], m.MAV_CMD_DO_PAUSE_CONTINUE, parameter)
    command.target_component = companion[1]
    with GroundLink(*network_endpoint(options)) as link:
        for _ in range(_ATTEMPTS):
            link.send(command)
            until = time.monotonic() + _ANSWER_TIMEOUT
            while (left := until - time.monotonic()) > 0.0:
                for one in link.receive(left):
                    if (one.system, one.component, one.name) == (*companion, "COMMAND_ACK"):
                        if one.message.result == m.MAV_RESULT_ACCEPTED:
                            return 0
                        answer = m.enums["MAV_RESULT"].get(one.message.result)
                        name = answer.name if answer else one.message.result
                        raise TelemetryError(f"{options.endpoint}: the companion answers {name}, expected ACCEPTED")
    raise TelemetryError(f"{options.endpoint}: no companion of system {companion[0]} answers")


# ---- stream --------------------------------------------------------------------------------------------------------


def stream(options: argparse.Namespace) -> int:
    """Run ``cosim mavlink stream``."""
    from cosim.mavlink.stream_record import stream_record

    endpoints, mavlink = links_from(options)
    done = stream_record(options.folder, endpoints, mavlink, None if options.rate == math.inf else options.rate)
    say(options, f"{options.folder}: {done.simulated:.1f} s streamed in {done.wall:.1f} s")
    for trouble in done.loss_reports:
        print_status(trouble)
    return 0
