"""``cosim run``."""

from __future__ import annotations

import argparse
import contextlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.command_line.link_flags import add_link_flags, add_live_flag, links_from, open_live
from cosim.command_line.numbers import rate
from cosim.command_line.process import INTERRUPTED
from cosim.command_line.results import print_run
from cosim.errors import TelemetryError

if TYPE_CHECKING:
    from cosim.mavlink.run_links import Mavlink
    from cosim.results.run_result import Run


def add_verb(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    run = verbs.add_parser("run", help="run a scenario and write its folder")
    run.add_argument("scenario", help="a shipped name (see cosim list), or a TOML file")
    run.add_argument("--out", type=Path, metavar="DIR", help="run folder (default: runs/SCENARIO-TIME)")
    run.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
        help="change a key of the scenario, such as law.gains.k_p1=10 or regions.SR1.shape.radius=0.7; may be repeated",
    )  # fmt: skip
    run.add_argument(
        "--rate", type=rate, metavar="N|max",
        help="greatest number of simulated seconds per second (default: 1 with --commands or --live, else max)",
    )  # fmt: skip
    run.add_argument("--json", action="store_true", help="print the outcome, and the paths of the files, as JSON")
    run.add_argument("--no-report", action="store_true", help="leave out the report, its figures and the replay")
    run.add_argument(
        "--replay-commands", dest="commands_log", type=Path, metavar="FILE",
        help="repeat the commands of an earlier run from its commands.jsonl, with its scenario.toml",
    )  # fmt: skip
    add_live_flag(run, "show the run in browsers while it goes on, and take their commands with --commands")
    add_link_flags(run, commands=True)


def run(options: argparse.Namespace) -> int:
    """Run ``cosim run``."""
    from cosim.run.run import run_scenario
    from cosim.scenario.scenario import load_scenario

    overrides = [*options.overrides]
    if options.commands:
        if options.commands_log is not None:
            raise TelemetryError("--replay-commands: expected no --commands with it: the commands are those of the log")
        overrides.append("commands.enabled=true")
    if options.await_arm:
        overrides.append("commands.await_arm=true")
    mavlink = _mavlink(options)
    scenario = load_scenario(options.scenario, overrides)
    usual = 1.0 if options.commands or options.live is not None else math.inf
    max_rate = usual if options.rate is None else options.rate
    with contextlib.ExitStack() as stack:
        live = open_live(options, stack)
        done = run_scenario(
            scenario, options.out, mavlink, None if max_rate == math.inf else max_rate,
            progress=not options.quiet,
            report=not options.no_report, commands_log=options.commands_log, live=live,
        )  # fmt: skip
    if options.json:
        print(_json(done), end="")
    else:
        print_run(options, done, not options.no_report)
    return INTERRUPTED if done.summary["status"] == "interrupted" else 0


def _json(run: Run) -> str:
    from cosim.io.strict_json import json_text
    from cosim.results.wording import verdict

    files = {what: str(path) for what, path in run.files().items()}
    return json_text(
        {"folder": str(run.folder), "files": files, "verdict": verdict(run.summary), "summary": run.summary}
    )


def _mavlink(options: argparse.Namespace) -> Mavlink | None:
    """Return the MAVLink setup from the flags; None without endpoints."""
    if not options.mavlink:
        for flag in ("signing_key", "allow_system"):
            if getattr(options, flag):
                raise TelemetryError(f"--{flag.replace('_', '-')}: expected --mavlink with it")
        if options.commands and options.live is None:
            raise TelemetryError("--commands: expected --mavlink or --live with it")
    endpoints, link = links_from(options)
    if not endpoints:
        return None
    from cosim.mavlink.run_links import Mavlink

    return Mavlink(tuple(endpoints), link)
