"""``cosim sitl``."""

from __future__ import annotations

import argparse
import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.command_line.numbers import number, whole
from cosim.command_line.process import INTERRUPTED, print_status
from cosim.command_line.results import print_run, say
from cosim.io.network_address import resolve_host

if TYPE_CHECKING:
    from cosim.results.run_result import Run
    from cosim.sitl.sitl_link import SitlLink

_PORTS = {"ardupilot": 9002, "px4": 4560}  # ports at which an autopilot expects its simulator: UDP, TCP


def add_verbs(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    sitl = verbs.add_parser("sitl", help="let a real autopilot fly the plant")
    sitl.add_argument("--vehicle", help="a shipped vehicle, or a TOML file (default: the scenario's)")
    sitl.add_argument("--scenario", default="sitl", help="a shipped name, or a TOML file (default: sitl)")
    sitl.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides", help="as for run"
    )  # fmt: skip
    sitl.add_argument(
        "--backend", choices=_PORTS, default="ardupilot",
        help="ardupilot: its JSON backend, by UDP; px4: its simulator interface, by TCP (default: %(default)s)",
    )  # fmt: skip
    sitl.add_argument(
        "--port", type=whole(1, 65535), metavar="N", help=f"default: {_PORTS['ardupilot']}, with px4 {_PORTS['px4']}"
    )
    sitl.add_argument("--host", default="127.0.0.1", metavar="ADDRESS", help="bound address (default: %(default)s)")
    sitl.add_argument("--allow-remote", action="store_true", help="let the address be seen from other machines")
    sitl.add_argument(
        "--timeout",
        type=number(1e-3, 1e6),
        metavar="S",
        help="end after so many seconds without a frame (default: never)",
    )
    sitl.add_argument(
        "--speedup", type=number(0.01, 100.0), metavar="N",
        help="greatest number of simulated seconds per second, px4 alone; ArduPilot has its own (default: 1)",
    )  # fmt: skip
    sitl.add_argument(
        "--record-rate", type=number(1e-3, 1e6), default=100.0, metavar="HZ",
        help="greatest number of rows of the record per simulated second (default: 100)",
    )  # fmt: skip
    sitl.add_argument(
        "--autopilot", metavar="ENDPOINT",
        help="a port of the autopilot, such as tcp:127.0.0.1:5762: record its own estimate (ardupilot alone)",
    )  # fmt: skip
    sitl.add_argument(
        "--dvl", type=number(0.1, 100.0), metavar="HZ",
        help="rate at which the autopilot gets the velocity over ground, as VISION_POSITION_DELTA, in simulated time",
    )  # fmt: skip
    sitl.add_argument(
        "--dvl-latency",
        type=number(0.0, 10.0),
        default=0.1,
        metavar="S",
        help="their latency (default: 0.1)",
    )
    sitl.add_argument(
        "--dvl-dropout", type=number(0.0, 1.0), default=0.0, metavar="PART",
        help="part of these messages that is lost (default: 0)",
    )  # fmt: skip
    sitl.add_argument("--out", type=Path, metavar="DIR", help="run folder (default: runs/SCENARIO-TIME)")
    sitl.add_argument("--no-report", action="store_true", help="leave out the report, its figures and the replay")


def sitl(options: argparse.Namespace) -> int:
    """Run ``cosim sitl``."""
    from cosim.sitl.hil_server import HilServer
    from cosim.sitl.json_server import JsonServer
    from cosim.sitl.law import make_control_law, make_pwm_law
    from cosim.sitl.sitl_session import FlightOptions, SitlSession

    _check(options)
    address = _address(options.host, options.port or _PORTS[options.backend], options.allow_remote)
    chosen = FlightOptions(
        options.scenario, tuple(options.overrides), options.vehicle, options.out, options.record_rate,
        not options.no_report,
    )  # fmt: skip
    server: JsonServer | HilServer
    link = None
    if options.backend == "px4":
        flights, speedup = SitlSession(chosen, options.backend, make_control_law), options.speedup or 1.0
        server = HilServer(flights, address, options.timeout, print_status, speedup=speedup)
        print_status("waiting for PX4 on TCP {}:{}".format(*server.address))
    else:
        link = _autopilot_link(options)
        flights = SitlSession(chosen, options.backend, lambda vehicle: make_pwm_law(vehicle, link))
        server = JsonServer(flights, address, options.timeout, print_status)
        print_status("waiting for ArduPilot on UDP {}:{}".format(*server.address))
    with contextlib.closing(link) if link is not None else contextlib.nullcontext():
        outcome = server.serve()
    c = outcome.counts
    ignored = f"{c.malformed} datagrams malformed, {c.rejected} of other senders"
    say(options, f"{c.steps} steps after {c.waited} frames at rest, {c.resent} resent, {c.lost} lost; {ignored}")
    for run in outcome.runs:
        print_run(options, run, not options.no_report)
    return _code(outcome.runs)


def _check(options: argparse.Namespace) -> None:
    from cosim.errors import RunError

    if options.dvl is not None and options.autopilot is None:
        raise RunError("--dvl: has no receiver; expected --autopilot ENDPOINT too")
    if options.speedup is not None and options.backend != "px4":
        raise RunError("--speedup: supported with --backend px4 alone; give ArduPilot its own --speedup")
    if options.autopilot is not None and options.backend == "px4":
        raise RunError("--autopilot: supported with --backend ardupilot alone")


def _autopilot_link(options: argparse.Namespace) -> SitlLink | None:
    """Open the link to a port of the autopilot, None if none is given."""
    from cosim.mavlink.wire.endpoint import parse_endpoint
    from cosim.sitl.sitl_link import DvlOptions, SitlLink

    if options.autopilot is None:
        return None
    endpoint = parse_endpoint(options.autopilot, options.allow_remote)
    dvl = None if options.dvl is None else DvlOptions(options.dvl, options.dvl_latency, options.dvl_dropout)
    return SitlLink(endpoint, dvl)


def _code(runs: list[Run]) -> int:
    return INTERRUPTED if runs[-1].summary["status"] == "interrupted" else 0


def _address(host: str, port: int, allow_remote: bool) -> tuple[str, int]:
    """Resolve the address to bind; raise a RunError if other machines reach it and `allow_remote` is False."""
    from cosim.errors import RunError

    try:
        found, is_loopback = resolve_host(host)
    except OSError as error:
        raise RunError(f"--host {host!r}: is not known: {error}") from error
    if not (allow_remote or is_loopback):
        raise RunError(f"--host {host!r}: {found} can be seen from other machines; --allow-remote lets it")
    return found, port
