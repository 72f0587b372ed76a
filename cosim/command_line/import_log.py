"""``cosim import``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.numbers import number
from cosim.command_line.process import say_if_interrupted
from cosim.command_line.results import print_run

_BAR = "{desc} {percentage:3.0f}%|{bar}| [{elapsed}<{remaining}]"


def add_verb(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    log = verbs.add_parser("import", help="read the log of a vehicle as a run")
    log.add_argument(
        "log", type=Path, metavar="LOG", help=".bin, .tlog, .ulg, .csv, .parquet, .mcap, .db3, .bag or a bag's folder"
    )
    log.add_argument("--vehicle", required=True, help="a shipped vehicle or a TOML file, whose thrusters are driven")
    log.add_argument("--scenario", help="shipped name or TOML file, whose goal and regions judge it (default: none)")
    log.add_argument("--map", type=Path, metavar="FILE", dest="columns", help="column map, for tables and bags of ROS")
    log.add_argument("--rate", type=number(1e-3, 1e4), metavar="HZ", help="rows per second (default: by the log)")
    log.add_argument(
        "--curve", choices=("linear", "quadratic", "t200"),
        help="curve from servo pulse to force (default: that of the vehicle's file)",
    )  # fmt: skip
    log.add_argument(
        "--voltage",
        type=number(1.0, 1e3),
        metavar="V",
        help="supply voltage of the thrusters (default: that of the log)",
    )
    log.add_argument("--out", type=Path, metavar="RUN", help="the run folder (default: a new one below runs)")
    log.add_argument("--overwrite", action="store_true", help="replace the run that the folder holds")
    log.add_argument("--no-report", action="store_true", help="write no report and no replay")


def import_(options: argparse.Namespace) -> int:
    """Run ``cosim import``."""
    from cosim.logs import import_log
    from cosim.run.progress import ProgressBar

    def run() -> None:
        with ProgressBar(not options.quiet, _BAR, total=1.0, desc=options.log.name) as bar:
            done = import_log(
                options.log, options.vehicle, options.out,
                scenario=options.scenario, columns=options.columns, rate=options.rate, curve=options.curve,
                voltage=options.voltage, report=not options.no_report, overwrite=options.overwrite, moved=bar.update_to,
            )  # fmt: skip
        print_run(options, done, not options.no_report)

    return say_if_interrupted(run, "nothing is written, and the same command begins again")
