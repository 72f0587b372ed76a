"""``cosim companion``."""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import sys
import threading
import time
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from cosim.command_line.flags import add_changes, add_remote, add_run_folder, add_verb, flag, float_range, int_range
from cosim.command_line.link_flags import add_live_flag, network_endpoint, open_live, origin
from cosim.command_line.process import INTERRUPTED, print_run, print_status
from cosim.mavlink.wire.options import PROFILES

if TYPE_CHECKING:
    from cosim.simulation.commands.sources import CommandQueue

_DECIMALS = 7  # of degrees, for centimeters
_READ_PERIOD = 0.1  # s, pause after a read without input: at Ctrl-D, or in the background
_COMPONENT = 191  # MAV_COMP_ID_ONBOARD_COMPUTER
_STEER_BY, _STICKS_BY = ("sticks", "wrench", "velocity", "attitude"), ("manual-control", "rc-override")


def add_verbs(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    verb = add_verb(
        verbs, "companion", companion, "steer a real autopilot by a scenario's regions, arbiter and law",
        "howto/companion",
        ("companion udpin:127.0.0.1:14550 --scenario mine.toml --scene-origin 55.9097000,-3.3203000 --dry-run",
         "companion serial:/dev/ttyACM0 --scenario mine.toml --surveyed-origin 1.5,-2,0 --live"),
    )  # fmt: skip
    verb.add_argument(
        "endpoint", metavar="ENDPOINT",
        help="where the autopilot is, such as udpin:127.0.0.1:14550 or serial:/dev/ttyACM0",
    )  # fmt: skip
    flag(verb, "--scenario NAME", "a shipped name, or a TOML file", required=True)
    add_changes(verb)
    flag(verb, "--profile", "type of the autopilot", default="ardusub", choices=PROFILES)
    flag(
        verb, "--steer-by", "sticks: surge, sway, heave and yaw while the autopilot keeps level; wrench: all six axes "
        "in manual mode; velocity: set-points; attitude: set-points, with forces", default="sticks", choices=_STEER_BY,
    )  # fmt: skip
    flag(verb, "--sticks-by", "message that carries sticks", default="manual-control", choices=_STICKS_BY)
    where = verb.add_mutually_exclusive_group()
    flag(where, "--scene-origin LAT,LON", "coordinates of the scene's origin: seven decimals are 1 cm", _scene_origin)
    flag(where, "--surveyed-origin N,E,D", "position of the autopilot's local origin in the scene [m]", _position)
    flag(verb, "--global-origin LAT,LON", "where the vehicle started, for an autopilot without a global origin", origin)
    flag(verb, "--surface-pressure HPA", "pressure of the air at the surface", float_range(500.0, 1200.0), 1013.25)
    flag(verb, "--water-density KG/M3", "sea: 1025", float_range(900.0, 1200.0), 1000.0)
    arming = verb.add_mutually_exclusive_group()
    flag(arming, "--dry-run", "compute and record, and send neither sticks nor commands")
    flag(arming, "--await-arm", "wait for somebody to arm the vehicle (the default)")
    flag(arming, "--arm", "arm the vehicle")
    flag(verb, "--pilot-gain N", "fraction of the wrench at full sticks: JS_GAIN_DEFAULT", float_range(0.05, 1.0), 0.5)
    lag = float_range(0.01, 10.0)
    flag(verb, "--velocity-lag S", "time constant of the autopilot's horizontal velocity loop", lag, 2.0)
    flag(verb, "--vertical-lag S", "time constant of the autopilot's vertical velocity loop", lag, 0.5)
    flag(verb, "--reckoning-error N", "position error per distance traveled without a fix", float_range(0.0, 1.0), 0.03)
    flag(verb, "--level-dive M", "an ArduSub's dive after arming, to align its heading", float_range(0.0, 10.0), 0.6)
    flag(verb, "--least-battery PERCENT", "charge below which the vehicle holds still", float_range(0.0, 100.0), 0.0)
    system = int_range(1, 255)
    words = "own system id; an ArduSub takes sticks of SYSID_MYGCS or MAV_GCS_SYSID alone"
    flag(verb, "--system-id N", words, system, 255)
    flag(verb, "--vehicle-system N", "the autopilot's system id (default: that of the first one heard)", system)
    flag(verb, "--timeout S", "end if steering cannot begin in so many seconds", float_range(0.1, 1e6))
    flag(verb, "--speedup N", "seconds of a simulated autopilot per second", float_range(0.01, 100.0), 1.0)
    add_remote(verb)
    add_live_flag(verb, "show the flight in browsers, with buttons to hold and resume")
    add_run_folder(verb)


def companion(options: argparse.Namespace) -> int:
    """Run ``cosim companion``."""
    from cosim.companion.autopilot_link import NetworkLink
    from cosim.companion.companion_options import CompanionOptions
    from cosim.companion.companion_run import Companion
    from cosim.companion.frame_alignment import SceneOrigin
    from cosim.scenario.scenario import load_scenario

    endpoint, key = network_endpoint(options)
    scene = SceneOrigin(options.scene_origin, options.surveyed_origin, options.surface_pressure, options.water_density)
    names = {field.name for field in fields(CompanionOptions)} - {"origin"}
    chosen = CompanionOptions(origin=scene, **{name: getattr(options, name) for name in names})
    scenario = load_scenario(options.scenario, options.set)
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
                print_status(f"autopilot: system {companion.session.reported.system}")
                for line in unprinted.pop().text():
                    print_status(line)
            print_status(state.replace("_", " ") + ("" if missing == "nothing" else f", waits for {missing}"))

        if sys.stdin is not None and sys.stdin.isatty():
            print_status("Enter holds the vehicle; r and Enter resumes steering")
            threading.Thread(
                target=_read_keys, args=(sys.stdin.fileno(), companion.session.commands), daemon=True
            ).start()
        run = companion.run(options.out, not options.no_report, show, live)
    print_run(options, run, not options.no_report)
    return INTERRUPTED if run.summary["status"] == "interrupted" else 0


def _read_keys(terminal: int, commands: CommandQueue) -> None:
    """Hold at each Enter, and resume at r and Enter, until the terminal (a file descriptor) is closed."""
    from cosim.simulation.commands.commands import SetMode

    if hasattr(signal, "pthread_sigmask"):  # in the background a read then fails, and does not stop the process
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTTIN})
    while True:
        try:
            data = os.read(terminal, 256)
        except OSError:  # in the background, or closed
            data = b""
        for line in data.splitlines():
            commands.submit(SetMode("reach" if line.strip().lower() == b"r" else "hold"))
        if not data:
            if not os.isatty(terminal):
                return
            time.sleep(_READ_PERIOD)  # Ctrl-D ends one read, and a terminal's next one waits again


def _scene_origin(text: str) -> tuple[float, float]:
    """Parse the flag; warn if its digits are too few for a vehicle among obstacles."""
    coordinates = origin(text)
    decimals = min(len(part.strip().partition(".")[2]) for part in text.split(","))
    if decimals < _DECIMALS:
        error = float(f"{1.1e5 * 0.1**decimals:.2g}")
        print_status(f"WARNING: --scene-origin {text}: its last digit is {error:g} m; give {_DECIMALS} decimals")
    return coordinates


def _position(text: str) -> tuple[float, float, float]:
    try:
        north, east, down = (float(part) for part in text.split(","))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r}: expected meters north, east and down, such as 1.5,-2,0") from error
    return north, east, down
