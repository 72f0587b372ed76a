"""Flags of the verbs that show a vehicle: MAVLink endpoints, profile, accepted senders, and the live page."""

from __future__ import annotations

import argparse
import contextlib
import math
from pathlib import Path
from typing import TYPE_CHECKING

from cosim.command_line.numbers import number, whole
from cosim.command_line.process import print_status
from cosim.errors import TelemetryError
from cosim.live.address import HOST, PORT, parse_live
from cosim.mavlink.wire.options import LOSS_ACTIONS, PROFILES, MavlinkOptions

if TYPE_CHECKING:
    from cosim.live.live_view import LiveView
    from cosim.mavlink.wire.endpoint import Endpoint

_MAX_TIMEOUT = 3600.0  # s
_SYSTEM = whole(1, 255)


def add_link_flags(parser: argparse.ArgumentParser, commands: bool = False, required: bool = False) -> None:
    """Add the flags to a verb."""
    usual = MavlinkOptions()
    parser.add_argument(
        "--mavlink", action="append", default=[], metavar="ENDPOINT", required=required,
        help="be a MAVLink vehicle there, such as udpout:127.0.0.1:14550, tcp:127.0.0.1:5760 or a file ending in "
        ".tlog; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--profile", choices=PROFILES, default=usual.profile,
        help=f"type of vehicle that the link imitates (default: {usual.profile})",
    )  # fmt: skip
    parser.add_argument("--allow-remote", action="store_true", help="let the link leave this machine")
    parser.add_argument(
        "--signing-key", type=Path, metavar="FILE",
        help="sign with the key in this file, and accept only messages signed with it",
    )  # fmt: skip
    parser.add_argument(
        "--allow-system", type=_systems, metavar="ID[,ID]", help="accept these system ids alone (default: all)"
    )
    parser.add_argument(
        "--system-id", type=_SYSTEM, default=usual.system_id, metavar="N",
        help=f"system id of the vehicle (default: {usual.system_id})",
    )  # fmt: skip
    parser.add_argument(
        "--origin", type=origin, default=usual.origin, metavar="LAT,LON",
        help="latitude and longitude of position 0, in degrees with seven decimals (default: {:.7f},{:.7f})".format(
            *usual.origin
        ),
    )  # fmt: skip
    parser.set_defaults(commands=False, await_arm=False, link_loss=None, link_timeout=None)
    if commands:
        _add_command_flags(parser, usual)


def _add_command_flags(parser: argparse.ArgumentParser, usual: MavlinkOptions) -> None:
    parser.add_argument(
        "--commands", action="store_true", help="accept commands; without it, the link only sends telemetry"
    )
    parser.add_argument("--await-arm", action="store_true", help="nothing moves before the vehicle is armed")
    parser.add_argument(
        "--link-loss", choices=LOSS_ACTIONS,
        help=f"action when the ground station that commands falls silent (default: {usual.loss_action})",
    )  # fmt: skip
    parser.add_argument(
        "--link-timeout", type=number(0.1, _MAX_TIMEOUT), metavar="S",
        help=f"seconds of the wall clock that count as silence (default: {usual.loss_timeout:g})",
    )  # fmt: skip


def links_from(options: argparse.Namespace) -> tuple[list[Endpoint], MavlinkOptions]:
    """Return endpoints and options from the flags."""
    from cosim.mavlink.wire.endpoint import parse_endpoint
    from cosim.mavlink.wire.signing import load_key

    for name in ("await_arm", "link_loss", "link_timeout"):
        if getattr(options, name) and not options.commands:
            raise TelemetryError(f"--{name.replace('_', '-')}: expected --commands with it")
    usual = MavlinkOptions()
    return [parse_endpoint(text, options.allow_remote) for text in options.mavlink], MavlinkOptions(
        profile=options.profile,
        commands=options.commands,
        key=load_key(options.signing_key) if options.signing_key else None,
        allowed_systems=options.allow_system,
        system_id=options.system_id,
        origin=options.origin,
        loss_action=options.link_loss or usual.loss_action,
        loss_timeout=options.link_timeout or usual.loss_timeout,
    )


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


def add_live_flag(parser: argparse.ArgumentParser, what: str) -> None:
    """Add the flag to a verb; `what` is the beginning of its help."""
    parser.add_argument(
        "--live", nargs="?", const="", metavar="[HOST:]PORT",
        help=f"{what} (default: {HOST}:{PORT}, or another port if that is taken)",
    )  # fmt: skip


def open_live(options: argparse.Namespace, stack: contextlib.ExitStack) -> LiveView | None:
    """Open the live page until the stack ends, and print its address; return None without the flag."""
    if options.live is None:
        return None
    from cosim.live.live_view import LiveView

    live = stack.enter_context(LiveView(parse_live(options.live, options.allow_remote)))
    print_status(f"the run is shown at {live.url}")
    return live
