"""Flags of the verbs that show a vehicle: MAVLink endpoints, profile, accepted senders, and the live page."""

from __future__ import annotations

import argparse
import contextlib
import math
from typing import TYPE_CHECKING

from cosim.command_line.flags import add_remote, flag, float_range, int_range, refuse_flags
from cosim.command_line.process import print_status
from cosim.errors import TelemetryError
from cosim.live.address import HOST, PORT, parse_live
from cosim.mavlink.wire.options import LOSS_ACTIONS, PROFILES, MavlinkOptions

if TYPE_CHECKING:
    from cosim.live.live_view import LiveView
    from cosim.mavlink.wire.endpoint import Endpoint

_SYSTEM = int_range(1, 255)


def add_link_flags(verb: argparse.ArgumentParser, commands: bool = False, required: bool = False) -> None:
    """Add the flags of a vehicle on links to a verb, with those for commands if it takes any."""
    usual = MavlinkOptions()
    flag(
        verb, "--mavlink ENDPOINT", "be a MAVLink vehicle there, such as udpout:127.0.0.1:14550, tcp:127.0.0.1:5760 or "
        "a file ending in .tlog; may be repeated", action="append", default=[], required=required,
    )  # fmt: skip
    flag(verb, "--profile", "type of vehicle that the link imitates", default=usual.profile, choices=PROFILES)
    add_remote(verb)
    flag(verb, "--allow-system ID[,ID]", "accept only these system ids (default: all)", _systems)
    flag(verb, "--system-id N", "system id of the vehicle", _SYSTEM, usual.system_id)
    flag(verb, "--origin LAT,LON", "coordinates of position 0 (default: {:.7f},{:.7f})".format(*usual.origin), origin)
    verb.set_defaults(commands=False, await_arm=False, link_loss=None, link_timeout=None)
    if not commands:
        return
    flag(verb, "--commands", "accept commands; without it, the link only sends telemetry")
    flag(verb, "--await-arm", "nothing moves before the vehicle is armed")
    flag(verb, "--link-loss", f"action on link loss (default: {usual.loss_action})", choices=LOSS_ACTIONS)
    flag(
        verb,
        "--link-timeout S",
        f"silence [s] that counts as link loss (default: {usual.loss_timeout:g})",
        float_range(0.1, 3600.0),
    )


def links_from(options: argparse.Namespace) -> tuple[list[Endpoint], MavlinkOptions]:
    """Return endpoints and options from the flags."""
    from cosim.mavlink.wire.endpoint import parse_endpoint
    from cosim.mavlink.wire.signing import load_key

    if not options.commands:
        refuse_flags(options, ["await_arm", "link_loss", "link_timeout"], "--commands with it")
    usual = MavlinkOptions()
    return [parse_endpoint(text, options.allow_remote) for text in options.mavlink], MavlinkOptions(
        profile=options.profile,
        commands=options.commands,
        key=load_key(options.signing_key) if options.signing_key else None,
        allowed_systems=options.allow_system,
        system_id=options.system_id,
        origin=options.origin or usual.origin,
        loss_action=options.link_loss or usual.loss_action,
        loss_timeout=options.link_timeout or usual.loss_timeout,
    )


def network_endpoint(options: argparse.Namespace) -> tuple[Endpoint, bytes | None]:
    """Return the endpoint and the key of a link to a vehicle from the flags."""
    from cosim.mavlink.wire.endpoint import parse_endpoint
    from cosim.mavlink.wire.signing import load_key

    endpoint = parse_endpoint(options.endpoint, options.allow_remote)
    if endpoint.kind == "tlog":
        raise TelemetryError(f"endpoint {options.endpoint!r}: expected a network or a serial device, not a file")
    return endpoint, load_key(options.signing_key) if options.signing_key else None


def _systems(text: str) -> frozenset[int]:
    return frozenset(_SYSTEM(part.strip()) for part in text.split(","))


def origin(text: str) -> tuple[float, float]:
    """Parse latitude and longitude [deg] of a flag; raise an argparse.ArgumentTypeError if invalid."""
    try:
        latitude, longitude = (float(part) for part in text.split(","))
    except ValueError:
        latitude = longitude = math.nan
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        raise argparse.ArgumentTypeError(
            f"{text!r}: expected degrees of latitude and longitude, such as 55.9097000,-3.3203000"
        )
    return latitude, longitude


def add_live_flag(verb: argparse.ArgumentParser, what: str) -> None:
    """Add the flag to a verb; `what` is the beginning of its help."""
    meaning = f"{what} (default: {HOST}:{PORT}, or another port if that is taken)"
    flag(verb, "--live [HOST:]PORT", meaning, nargs="?", const="")


def open_live(options: argparse.Namespace, stack: contextlib.ExitStack) -> LiveView | None:
    """Open the live page until the stack ends, and print its address; return None without the flag."""
    if options.live is None:
        return None
    from cosim.live.live_view import LiveView

    live = stack.enter_context(LiveView(parse_live(options.live, options.allow_remote)))
    print_status(f"the run is shown at {live.url}")
    return live
