"""``cosim sitl``."""

from __future__ import annotations

import argparse
import contextlib
from typing import TYPE_CHECKING, Any

from cosim.command_line.flags import add_changes, add_run_folder, add_verb, flag, float_range, int_range, refuse_flags
from cosim.command_line.process import INTERRUPTED, print_run, print_status, say
from cosim.io.network_address import resolve_host

if TYPE_CHECKING:
    from cosim.sitl.sitl_link import SitlLink

_PORTS = {"ardupilot": 9002, "px4": 4560}  # ports at which an autopilot expects its simulator: UDP, TCP


def add_verbs(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    verb = add_verb(
        verbs, "sitl", sitl, "let a real autopilot fly the plant", "sitl",
        ("sitl --vehicle bluerov2_heavy", "sitl --backend px4 --scenario harbour --speedup 5"),
    )  # fmt: skip
    flag(verb, "--vehicle NAME", "a shipped vehicle, or a TOML file (default: the scenario's)")
    flag(verb, "--scenario NAME", "a shipped name, or a TOML file", default="sitl")
    add_changes(verb)
    flag(verb, "--backend", "ardupilot: JSON by UDP; px4: HIL by TCP", default="ardupilot", choices=tuple(_PORTS))
    ports = "default: {ardupilot}, with px4 {px4}".format(**_PORTS)
    flag(verb, "--port N", ports, int_range(1, 65535))
    flag(verb, "--host ADDRESS", "bound address", default="127.0.0.1")
    flag(verb, "--allow-remote", "accept connections from other machines")
    flag(verb, "--timeout S", "end after so many seconds without a frame (default: never)", float_range(1e-3, 1e6))
    flag(verb, "--speedup N", "with px4: maximum simulated seconds per second (default: 1)", float_range(0.01, 100.0))
    flag(
        verb, "--record-rate HZ", "maximum number of recorded rows per simulated second", float_range(1e-3, 1e6), 100.0
    )
    flag(
        verb,
        "--autopilot ENDPOINT",
        "with ardupilot: its second link, such as tcp:127.0.0.1:5762; records its estimate",
    )
    flag(verb, "--dvl HZ", "rate of VISION_POSITION_DELTA to the autopilot, in simulated time", float_range(0.1, 100.0))
    flag(verb, "--dvl-latency S", "latency of these messages", float_range(0.0, 10.0), 0.1)
    flag(verb, "--dvl-dropout PART", "fraction of these messages that is lost", float_range(0.0, 1.0), 0.0)
    add_run_folder(verb)


def sitl(options: argparse.Namespace) -> int:
    """Run ``cosim sitl``."""
    from cosim.sitl.hil_server import HilServer
    from cosim.sitl.json_server import JsonServer
    from cosim.sitl.law import make_control_law, make_pwm_law
    from cosim.sitl.sitl_session import FlightOptions, SitlSession

    _check(options)
    address = _address(options.host, options.port or _PORTS[options.backend], options.allow_remote)
    flight_options = FlightOptions(
        options.scenario, tuple(options.set), options.vehicle, options.out, options.record_rate,
        not options.no_report,
    )  # fmt: skip
    server: JsonServer | HilServer
    link = None
    if options.backend == "px4":
        flights, speedup = SitlSession(flight_options, options.backend, make_control_law), options.speedup or 1.0
        server = HilServer(flights, address, options.timeout, print_status, speedup=speedup)
        print_status("waiting for PX4 on TCP {}:{}".format(*server.address))
    else:
        link = _autopilot_link(options)
        flights = SitlSession(flight_options, options.backend, lambda vehicle: make_pwm_law(vehicle, link))
        server = JsonServer(flights, address, options.timeout, print_status)
        print_status("waiting for ArduPilot on UDP {}:{}".format(*server.address))
    with contextlib.closing(link) if link is not None else contextlib.nullcontext():
        outcome = server.serve()
    c = outcome.counts
    ignored = f"{c.malformed} datagrams malformed, {c.rejected} of other senders"
    say(options, f"{c.steps} steps after {c.waited} frames at rest, {c.resent} resent, {c.lost} lost; {ignored}")
    for run in outcome.runs:
        print_run(options, run, not options.no_report)
    return INTERRUPTED if outcome.runs[-1].summary["status"] == "interrupted" else 0


def _check(options: argparse.Namespace) -> None:
    if options.autopilot is None:
        refuse_flags(options, ["dvl"], "--autopilot ENDPOINT with it: else it has no receiver")
    if options.backend == "px4":
        refuse_flags(options, ["autopilot"], "--backend ardupilot with it")
    else:
        refuse_flags(options, ["speedup"], "--backend px4 with it; give ArduPilot its own --speedup")


def _autopilot_link(options: argparse.Namespace) -> SitlLink | None:
    """Open the link to a port of the autopilot, None if none is given."""
    from cosim.mavlink.wire.endpoint import parse_endpoint
    from cosim.sitl.sitl_link import DvlOptions, SitlLink

    if options.autopilot is None:
        return None
    endpoint = parse_endpoint(options.autopilot, options.allow_remote)
    dvl = None if options.dvl is None else DvlOptions(options.dvl, options.dvl_latency, options.dvl_dropout)
    return SitlLink(endpoint, dvl)


def _address(host: str, port: int, allow_remote: bool) -> tuple[str, int]:
    """Resolve the address to bind; raise a RunError if other machines reach it and `allow_remote` is False."""
    from cosim.errors import RunError

    try:
        found, is_loopback = resolve_host(host)
    except OSError as error:
        raise RunError(f"--host {host!r}: is not known: {error}") from error
    if not (allow_remote or is_loopback):
        raise RunError(f"--host {host!r}: {found} is reachable from other machines; --allow-remote allows it")
    return found, port
