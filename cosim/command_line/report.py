"""``cosim report``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.flags import add_verb, flag, refuse_flags
from cosim.command_line.process import FAULT, print_status, say

_FORMATS = ("html", "png")


def add_verbs(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    verb = add_verb(
        verbs, "report", report, "write summary, report and replay of runs again, also of killed ones", "replay",
        ("report runs/docking", "report runs/docking --format png", "report runs/a runs/b --replay --out both.html"),
    )  # fmt: skip
    verb.add_argument("folders", type=Path, nargs="+", metavar="RUN", help="a run folder, also of a killed run")
    flag(verb, "--format html|png", "pages with replay (default), or pictures", _formats, [], action="extend")
    flag(verb, "--replay", "write the replay alone: a page that plays one or several runs")
    flag(verb, "--out FILE", "with --replay: file to write (default: replay.html, in the folder of a single run)", Path)
    flag(verb, "--title TEXT", "with --replay: title of the page (default: the scenario's)")
    flag(verb, "--interactive", "with --replay: let the page fly its run again with other numbers")


def _formats(text: str) -> list[str]:
    formats = [part.strip() for part in text.split(",")]
    for name in formats:
        if name not in _FORMATS:
            raise argparse.ArgumentTypeError(f"{name!r}: expected {', '.join(_FORMATS)}")
    return formats


def report(options: argparse.Namespace) -> int:
    """Run ``cosim report``; continue with the other folders after an invalid one."""
    from controller import ControllerError
    from cosim.errors import CosimError
    from cosim.replay.pages import replay
    from cosim.run.run_folder import report_again
    from plant_fmu import PlantFmuError

    if options.replay:
        refuse_flags(options, ["format"], "no --replay with it")
        print(replay(options.folders, options.out, options.title, options.interactive))
        return 0
    refuse_flags(options, ["out", "title", "interactive"], "--replay with it")
    status = 0
    for folder in options.folders:
        try:
            outcome, files = report_again(folder, options.format or ["html"])
        except (CosimError, ControllerError, PlantFmuError) as error:
            print_status(str(error))
            status = FAULT
            continue
        say(options, outcome)
        print(*files, sep="\n")
    return status
