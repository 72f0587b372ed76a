"""``cosim companion``."""

from __future__ import annotations

import argparse
import contextlib
from pathlib import Path
from typing import Any

from cosim.command_line.link_flags import add_live_flag, open_live, origin
from cosim.command_line.numbers import number, whole
from cosim.command_line.process import INTERRUPTED, print_status
from cosim.command_line.results import print_run
from cosim.mavlink.wire.options import PROFILES

_COMPONENT = 191  # MAV_COMP_ID_ONBOARD_COMPUTER
_STEER_BY, _STICKS_BY = ("sticks", "wrench", "velocity", "attitude"), ("manual-control", "rc-override")


def add_verb(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    verb = verbs.add_parser("companion", help="steer a real autopilot by a scenario's regions, arbiter and law")
    verb.add_argument(
        "endpoint",
        metavar="ENDPOINT",
        help="where the autopilot is, such as udpin:127.0.0.1:14550 or serial:/dev/ttyACM0",
    )
    verb.add_argument("--scenario", required=True, help="a shipped name, or a TOML file")
    verb.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides", help="as for run")
    verb.add_argument("--profile", choices=PROFILES, default="ardusub", help="type of the autopilot (default: ardusub)")
    verb.add_argument(
        "--steer-by", choices=_STEER_BY, default="sticks",
        help="sticks: surge, sway, heave and yaw while the autopilot keeps level; wrench: all six axes in manual mode; "
        "velocity: set-points; attitude: set-points, with forces (default: sticks)",
    )  # fmt: skip
    verb.add_argument(
        "--sticks-by", choices=_STICKS_BY, default="manual-control",
        help="message that carries sticks; the pilot gain does not scale rc-override (default: manual-control)",
    )  # fmt: skip
    where = verb.add_mutually_exclusive_group()
    where.add_argument(
        "--scene-origin",
        type=origin,
        metavar="LAT,LON",
        help="latitude and longitude of the scene's origin, in degrees with seven decimals: the fourth is 11 m",
    )
    where.add_argument(
        "--surveyed-origin", type=_position, metavar="N,E,D",
        help="position of the autopilot's local origin in the scene, in meters",
    )  # fmt: skip
    verb.add_argument(
        "--surface-pressure", type=number(500.0, 1200.0), default=1013.25, metavar="HPA",
        help="pressure of the air, from which depth is measured (default: 1013.25)",
    )  # fmt: skip
    verb.add_argument(
        "--water-density", type=number(900.0, 1200.0), default=1000.0, metavar="KG/M3", help="default: 1000; sea: 1025"
    )
    arming = verb.add_mutually_exclusive_group()
    arming.add_argument(
        "--dry-run", action="store_true", help="compute and record, and send neither sticks nor commands"
    )
    arming.add_argument("--await-arm", action="store_true", help="wait for somebody to arm the vehicle (the default)")
    arming.add_argument("--arm", action="store_true", help="arm the vehicle")
    verb.add_argument(
        "--pilot-gain", type=number(0.05, 1.0), default=0.5, metavar="N",
        help="part of the greatest wrench that full sticks give: ArduSub's JS_GAIN_DEFAULT (default: 0.5)",
    )  # fmt: skip
    verb.add_argument(
        "--velocity-lag", type=number(0.01, 10.0), default=2.0, metavar="S",
        help="time constant of the autopilot's horizontal velocity loop (default: 2)",
    )  # fmt: skip
    verb.add_argument(
        "--vertical-lag", type=number(0.01, 10.0), default=0.5, metavar="S",
        help="time constant of the autopilot's vertical velocity loop (default: 0.5)",
    )  # fmt: skip
    verb.add_argument(
        "--reckoning-error", type=number(0.0, 1.0), default=0.03, metavar="PART",
        help="position error while the autopilot has no fix, as a part of the distance covered (default: 0.03)",
    )  # fmt: skip
    verb.add_argument(
        "--level-dive", type=number(0.0, 10.0), default=0.6, metavar="M",
        help="depth by which an ArduSub dives after arming, to align its heading; 0 for none (default: 0.6)",
    )  # fmt: skip
    verb.add_argument(
        "--least-battery", type=number(0.0, 100.0), default=0.0, metavar="PERCENT",
        help="charge below which the vehicle holds its position (default: 0, never)",
    )  # fmt: skip
    verb.add_argument(
        "--system-id", type=whole(1, 255), default=255, metavar="N",
        help="system id of the companion; an ArduSub takes sticks from its SYSID_MYGCS alone (default: 255)",
    )  # fmt: skip
    verb.add_argument(
        "--timeout", type=number(0.1, 1e6), metavar="S", help="end if steering cannot begin in so many seconds"
    )
    verb.add_argument(
        "--speedup", type=number(0.01, 100.0), default=1.0, metavar="N",
        help="speed of a simulated autopilot: its seconds per second of the wall clock (default: 1)",
    )  # fmt: skip
    verb.add_argument("--allow-remote", action="store_true", help="let the link leave this machine")
    verb.add_argument("--signing-key", type=Path, metavar="FILE", help="sign with the key in this file")
    add_live_flag(verb, "show the flight in browsers while it goes on")
    verb.add_argument("--out", type=Path, metavar="DIR", help="run folder (default: runs/SCENARIO-TIME)")
    verb.add_argument("--no-report", action="store_true", help="leave out the report, its figures and the replay")


def companion(options: argparse.Namespace) -> int:
    """Run ``cosim companion``."""
    from cosim.companion.autopilot_link import NetworkLink
    from cosim.companion.companion_options import CompanionOptions
    from cosim.companion.companion_run import Companion
    from cosim.companion.frame_alignment import SceneOrigin
    from cosim.errors import TelemetryError
    from cosim.mavlink.wire.endpoint import parse_endpoint
    from cosim.mavlink.wire.signing import load_key
    from cosim.scenario.scenario import load_scenario

    endpoint = parse_endpoint(options.endpoint, options.allow_remote)
    if endpoint.kind == "tlog":
        raise TelemetryError(f"endpoint {options.endpoint!r}: expected a network or a serial device, not a file")
    scene = SceneOrigin(options.scene_origin, options.surveyed_origin, options.surface_pressure, options.water_density)
    chosen = CompanionOptions(
        options.profile, options.steer_by, options.sticks_by, scene, options.dry_run, options.arm, options.pilot_gain,
        options.velocity_lag, options.vertical_lag, options.reckoning_error, options.level_dive, options.least_battery,
        options.timeout,
    )  # fmt: skip
    scenario = load_scenario(options.scenario, options.overrides)
    key = load_key(options.signing_key) if options.signing_key else None
    with contextlib.ExitStack() as stack:
        link = stack.enter_context(NetworkLink(endpoint, key, (options.system_id, _COMPONENT), options.speedup))
        companion = Companion(scenario, link, chosen)
        live = open_live(options, stack)
        unprinted, printed = [companion.session.failsafes], {""}

        def show(state: str, missing: str) -> None:
            if companion.placement not in printed:
                printed.add(companion.placement)
                print_status(companion.placement)
            if state != "waiting" and unprinted:
                for line in unprinted.pop().text():
                    print_status(line)
            print_status(state.replace("_", " ") + ("" if missing == "nothing" else f", waits for {missing}"))

        run = companion.run(options.out, not options.no_report, show, live)
    print_run(options, run, not options.no_report)
    return INTERRUPTED if run.summary["status"] == "interrupted" else 0


def _position(text: str) -> tuple[float, float, float]:
    try:
        north, east, down = (float(part) for part in text.split(","))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r}: expected meters north, east and down, such as 1.5,-2,0") from error
    return north, east, down
