"""``cosim run``."""

from __future__ import annotations

import argparse
import contextlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.command_line.flags import add_changes, add_run_folder, add_verb, flag, rate, refuse_flags
from cosim.command_line.link_flags import add_link_flags, add_live_flag, links_from, open_live
from cosim.command_line.process import INTERRUPTED, print_run, say
from cosim.errors import TelemetryError
from cosim.report.figure_process import FigureProcess, figure_process

if TYPE_CHECKING:
    from cosim.mavlink.run_links import Mavlink
    from cosim.results.run_result import Run


# flags that a system of FMUs has not
_OF_SCENARIOS = (
    "law", "rate", "replay_commands", "live", "mavlink", "commands", "await_arm", "signing_key", "allow_system",
)  # fmt: skip


def add_verbs(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    verb = add_verb(
        verbs, "run", run, "run a scenario and write its folder", "tutorial",
        ("run docking --out runs/docking", "run paper --set arbiter.engine=closed --set regions.SR1.gain=5000",
         "run mine.toml --mavlink udpout:127.0.0.1:14550 --commands", "run harbour --live --commands", "run loop.ssp"),
    )  # fmt: skip
    verb.add_argument("scenario", help="a shipped name (cosim show lists them), a TOML file, or a system of FMUs, .ssp")
    add_run_folder(verb)
    add_changes(verb, "a key of the scenario, such as law.gains.k_p1=10 or regions.SR1.shape.radius=0.7")
    flag(verb, "--law NAME|FILE", "law such as pd, an .fmu file, or FILE.py:NAME; instead of the scenario's own")
    flag(verb, "--rate N|max", "maximum simulated seconds per second (default: max; 1 with --commands or --live)", rate)
    flag(verb, "--json", "print the outcome, and the paths of the files, as JSON")
    flag(verb, "--replay-commands FILE", "repeat the commands.jsonl of an earlier run, with its scenario", Path)
    add_live_flag(verb, "show the run in browsers while it goes on, and take their commands with --commands")
    add_link_flags(verb, commands=True)


def run(options: argparse.Namespace) -> int:
    """Run ``cosim run``."""
    if options.scenario.endswith(".ssp"):
        return _run_system(options)
    import cosim.run.run_scenario  # noqa: F401 -- so that a process to be forked has what it needs

    with contextlib.ExitStack() as stack:
        return _run(options, stack, None if options.no_report else stack.enter_context(figure_process()))


def _run(options: argparse.Namespace, stack: contextlib.ExitStack, drawing: FigureProcess | None) -> int:
    from cosim.command_line.campaigns import load_with_law
    from cosim.run.run_scenario import run_scenario

    overrides = [*options.set]
    if options.commands:
        refuse_flags(options, ["replay_commands"], "no --commands with it: the commands are those of the log")
        overrides.append("commands.enabled=true")
    if options.await_arm:
        overrides.append("commands.await_arm=true")
    mavlink = _mavlink(options)
    scenario, own = load_with_law(options.scenario, options.law, overrides)
    usual = 1.0 if options.commands or options.live is not None else math.inf
    max_rate = usual if options.rate is None else options.rate
    live = open_live(options, stack)
    done = run_scenario(
        scenario, options.out, mavlink, None if max_rate == math.inf else max_rate, progress=not options.quiet,
        report=not options.no_report, commands_log=options.replay_commands, live=live, law=own, figure_process=drawing,
    )  # fmt: skip
    if options.json:
        print(_json(done), end="")
    else:
        print_run(options, done, not options.no_report)
    return INTERRUPTED if done.summary["status"] == "interrupted" else 0


def _run_system(options: argparse.Namespace) -> int:
    """Run a system of FMUs."""
    from cosim.io.strict_json import json_text
    from cosim.results.record import RECORD
    from cosim.results.run_result import REPORT
    from cosim.run.run_system import run_system

    refuse_flags(options, _OF_SCENARIOS, "a scenario with it: a system of FMUs runs alone")
    run = run_system(Path(options.scenario), options.out, options.set, report=not options.no_report)
    if options.json:
        print(json_text({"folder": str(run.folder), "summary": run.summary}), end="")
    else:
        say(options, run.outcome)
        print(run.folder / (RECORD if options.no_report else REPORT))
    return INTERRUPTED if run.summary["status"] == "interrupted" else 0


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
        refuse_flags(options, ["signing_key", "allow_system"], "--mavlink with it")
        if options.commands and options.live is None:
            raise TelemetryError("--commands: expected --mavlink or --live with it")
    endpoints, link = links_from(options)
    if not endpoints:
        return None
    from cosim.mavlink.run_links import Mavlink

    return Mavlink(tuple(endpoints), link)
