"""``cosim report`` and ``cosim replay``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.process import FAULT, print_status
from cosim.command_line.results import say

_FORMATS = ("html", "png")


def add_verbs(verbs: Any) -> None:
    """Add the verbs to the subparsers of the command."""
    report = verbs.add_parser("report", help="write summary and report of runs again, or of killed ones")
    report.add_argument("folders", type=Path, nargs="+", metavar="RUN", help="a run folder")
    report.add_argument(
        "--format", type=_formats, action="append", default=[], metavar="html|png", dest="formats",
        help="html: a page with its figures, and the replay (default), which browsers print; png: the figures as "
        "pictures; both with a comma between them",
    )  # fmt: skip

    replay = verbs.add_parser("replay", help="write a page that replays one or several runs")
    replay.add_argument("folders", type=Path, nargs="+", metavar="RUN", help="a run folder, also of a killed run")
    replay.add_argument(
        "--out", type=Path, metavar="FILE",
        help="file to write (default: replay.html, in the folder of a single run, or here for several)",
    )  # fmt: skip
    replay.add_argument("--title", help="title of the page (default: the scenario's)")
    replay.add_argument(
        "--interactive", action="store_true",
        help="let the page simulate its run again, with another goal, regions, current, noise or gains",
    )  # fmt: skip


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
    from cosim.results.wording import verdict
    from cosim.run.run_folder import report_again
    from plant_fmu import PlantFmuError

    formats = [name for group in options.formats for name in group] or ["html"]
    bad = 0
    for folder in options.folders:
        try:
            summary, files = report_again(folder, formats)
        except (CosimError, ControllerError, PlantFmuError) as error:
            print_status(str(error))
            bad += 1
            continue
        say(options, verdict(summary))
        print(*files, sep="\n")
    return FAULT if bad else 0


def replay(options: argparse.Namespace) -> int:
    """Run ``cosim replay``."""
    from cosim.replay.pages import replay as write

    print(write(options.folders, options.out, options.title, options.interactive))
    return 0
