"""``cosim export``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.numbers import number, whole


def add_verb(verbs: Any) -> None:
    """Add the verb to the parser.

    Parameters
    ----------
    verbs : argparse subparsers
        Of the command.
    """
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


def export(options: argparse.Namespace) -> int:
    """Run ``cosim export``."""
    from cosim.export import export_run

    for file in export_run(
        options.folder, options.to, options.out,
        signals=options.signals, every=options.every, rate=options.rate, force=options.force,
    ):  # fmt: skip
        print(file)
    return 0
