"""``cosim sitl``."""

from __future__ import annotations

import argparse
import contextlib
import math
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.address import resolved
from cosim.command_line.campaigns import INTERRUPTED
from cosim.sitl.ports import PORTS

if TYPE_CHECKING:
    from cosim.run import Run


def add_verbs(verbs: Any) -> None:
    """Add the verb to the parser.

    Parameters
    ----------
    verbs : argparse subparsers
        Of the command.
    """
    sitl = verbs.add_parser("sitl", help="let a real autopilot fly the plant")
    sitl.add_argument("--vehicle", help="a shipped vehicle, or a TOML file (default: the scenario's)")
    sitl.add_argument("--scenario", default="sitl", help="a shipped name, or a TOML file (default: sitl)")
    sitl.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides", help="as for run"
    )  # fmt: skip
    sitl.add_argument(
        "--backend", choices=PORTS, default="ardupilot",
        help="ardupilot: its JSON backend, by UDP; px4: its simulator interface, by TCP (default: %(default)s)",
    )  # fmt: skip
    sitl.add_argument("--port", type=_port, metavar="N", help=f"default: {PORTS['ardupilot']}, with px4 {PORTS['px4']}")
    sitl.add_argument("--host", default="127.0.0.1", metavar="ADDRESS", help="to listen on (default: %(default)s)")
    sitl.add_argument("--allow-remote", action="store_true", help="let the address be seen from other machines")
    sitl.add_argument(
        "--timeout", type=_positive, metavar="S", help="end after so many seconds without a frame (default: never)"
    )
    sitl.add_argument(
        "--record-rate", type=_positive, default=100.0, metavar="HZ",
        help="rows of the record a simulated second at the most (default: 100)",
    )  # fmt: skip
    sitl.add_argument("--out", type=Path, metavar="DIR", help="run folder (default: runs/SCENARIO-TIME)")
    sitl.add_argument("--no-report", action="store_true", help="leave out the report, its figures and the replay")


def _port(text: str) -> int:
    if not (text.isdecimal() and 0 < int(text) < 65536):
        raise argparse.ArgumentTypeError(f"{text!r}: expected a port from 1 to 65535")
    return int(text)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 1e-3 <= value <= 1e6:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a number from 0.001 to 1e6")
    return value


def sitl(options: argparse.Namespace) -> int:
    """Run ``cosim sitl``."""
    from cosim.replay.page import REPLAY
    from cosim.report_words import verdict
    from cosim.sitl.flights import FlightOptions, Flights
    from cosim.sitl.hil import HilServer
    from cosim.sitl.law import law_of_controls, law_of_pwm
    from cosim.sitl.server import JsonServer

    address = _address(options.host, options.port or PORTS[options.backend], options.allow_remote)
    # a polite kill leaves a readable run too
    with contextlib.suppress(ValueError):  # which signal raises outside the main thread
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    chosen = FlightOptions(
        options.scenario, tuple(options.overrides), options.vehicle, options.out, options.record_rate,
        not options.no_report,
    )  # fmt: skip
    server: JsonServer | HilServer
    if options.backend == "px4":
        server = HilServer(Flights(chosen, options.backend, law_of_controls), address, options.timeout, _tell)
        _tell("waiting for PX4 on TCP {}:{}".format(*server.address))
    else:
        server = JsonServer(Flights(chosen, options.backend, law_of_pwm), address, options.timeout, _tell)
        _tell("waiting for ArduPilot on UDP {}:{}".format(*server.address))
    outcome = server.serve()
    c = outcome.counts
    ignored = f"{c.malformed} datagrams malformed, {c.refused} of other senders"
    print(f"{c.steps} steps, {c.resent} frames resent, {c.lost} lost; {ignored}")
    for run in outcome.runs:
        print(verdict(run.summary))
        print(run.folder / ("summary.json" if options.no_report else "report.html"))
        if not options.no_report:
            print(run.folder / REPLAY)
    return _code(outcome.runs)


def _code(runs: list[Run]) -> int:
    return INTERRUPTED if runs[-1].summary["status"] == "interrupted" else 0


def _tell(text: str) -> None:
    print(f"cosim: {text}", file=sys.stderr)


def _address(host: str, port: int, allow_remote: bool) -> tuple[str, int]:
    """Return the address to bind, if it may be."""
    from cosim.errors import RunError

    try:
        found, here = resolved(host)
    except OSError as error:
        raise RunError(f"--host {host!r}: is not known: {error}") from error
    if not (allow_remote or here):
        raise RunError(f"--host {host!r}: {found} can be seen from other machines; --allow-remote lets it")
    return found, port
