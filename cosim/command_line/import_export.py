"""``cosim import`` and ``cosim export``: from a log to a run, and from a run to a file of another tool."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.numbers import number, whole
from cosim.command_line.results import print_run

_BAR = "{desc} {percentage:3.0f}%|{bar}| [{elapsed}<{remaining}]"


def add_verbs(verbs: Any) -> None:
    """Add the verbs to the parser.

    Parameters
    ----------
    verbs : argparse subparsers
        Of the command.
    """
    log = verbs.add_parser("import", help="read the log of a vehicle as a run")
    log.add_argument("log", type=Path, metavar="LOG", help=".bin, .tlog, .ulg, .csv, .parquet or .mcap")
    log.add_argument("--vehicle", required=True, help="a shipped vehicle or a TOML file, whose thrusters are driven")
    log.add_argument("--scenario", help="shipped name or TOML file, whose goal and regions judge it (default: none)")
    log.add_argument(
        "--map", type=Path, metavar="FILE", dest="columns", help="column map, for .csv, .parquet and .mcap"
    )
    log.add_argument("--rate", type=number(1e-3, 1e4), metavar="HZ", help="rows a second (default: by the log)")
    log.add_argument(
        "--curve", choices=("linear", "quadratic", "t200"),
        help="from servo pulse to force (default: that of the vehicle's file)",
    )  # fmt: skip
    log.add_argument(
        "--voltage", type=number(1.0, 1e3), metavar="V", help="of the thrusters' supply (default: as the log says)"
    )
    log.add_argument("--out", type=Path, metavar="RUN", help="the run folder (default: a new one below runs)")
    log.add_argument("--overwrite", action="store_true", help="replace the run that the folder holds")
    log.add_argument("--no-report", action="store_true", help="write no report and no replay")

    export = verbs.add_parser("export", help="write a run in the format of another tool")
    export.add_argument("folder", type=Path, metavar="RUN", help="the run folder")
    export.add_argument(
        "--to", required=True, metavar="FORMAT",
        help="csv (pandas), npz (NumPy), mat (MATLAB), mcap (Foxglove, PlotJuggler), rrd (Rerun), "
        "tlog (QGroundControl)",
    )  # fmt: skip
    export.add_argument("--out", type=Path, metavar="FILE", help="file to write (default: RUN.FORMAT here)")
    thinned = export.add_mutually_exclusive_group()
    thinned.add_argument(
        "--every", type=whole(1, 10**9), default=1, metavar="N", help="one step of so many (default: all)"
    )
    thinned.add_argument("--rate", type=number(1e-9, 1e9), metavar="HZ", help="steps a simulated second, in its place")
    export.add_argument(
        "--signals", nargs="+", action="extend", default=[], metavar="GLOB",
        help="names or patterns such as 'position.*' '*.clearance' (default: all); the time is always there",
    )  # fmt: skip
    export.add_argument("--force", action="store_true", help="replace a file that exists")


def import_(options: argparse.Namespace) -> int:
    """Run ``cosim import``."""
    from cosim.logs import import_log
    from cosim.run.progress import ProgressBar

    with ProgressBar(not options.quiet, _BAR, total=1.0, desc=options.log.name) as bar:
        run = import_log(
            options.log, options.vehicle, options.out,
            scenario=options.scenario, columns=options.columns, rate=options.rate, curve=options.curve,
            voltage=options.voltage, report=not options.no_report, overwrite=options.overwrite, moved=bar.update_to,
        )  # fmt: skip
    print_run(options, run, not options.no_report)
    return 0


def export(options: argparse.Namespace) -> int:
    """Run ``cosim export``."""
    from cosim.export import export_run

    for file in export_run(
        options.folder, options.to, options.out,
        signals=options.signals, every=options.every, rate=options.rate, force=options.force,
    ):  # fmt: skip
        print(file)
    return 0
