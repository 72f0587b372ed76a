"""``cosim export`` and ``cosim package``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.numbers import number, whole
from cosim.command_line.process import say_if_interrupted


def add_verbs(verbs: Any) -> None:
    """Add the verbs to the subparsers of the command."""
    export = verbs.add_parser("export", help="write a run in the format of another tool")
    export.add_argument("folder", type=Path, metavar="RUN", help="the run folder")
    export.add_argument(
        "--to", required=True, metavar="FORMAT",
        help="csv (spreadsheets), mcap (Foxglove, PlotJuggler), rrd (Rerun), tlog (QGroundControl)",
    )  # fmt: skip
    export.add_argument("--out", type=Path, metavar="FILE", help="file to write (default: RUN.FORMAT here)")
    thinned = export.add_mutually_exclusive_group()
    thinned.add_argument(
        "--every", type=whole(1, 10**9), default=1, metavar="N", help="export every N-th step (default: all)"
    )
    thinned.add_argument("--rate", type=number(1e-9, 1e9), metavar="HZ", help="steps per simulated second")
    export.add_argument(
        "--signals", nargs="+", action="extend", default=[], metavar="GLOB",
        help="names or patterns such as 'position.*' '*.clearance' (default: all); the time is always included",
    )  # fmt: skip
    export.add_argument("--force", action="store_true", help="replace a file that exists")

    package = verbs.add_parser("package", help="write a scenario as a system of FMUs that other masters run")
    package.add_argument("scenario", help="a shipped name (see cosim list), or a TOML file")
    package.add_argument("--to", choices=("ssp",), default="ssp", help="format (default: ssp)")
    package.add_argument("--out", type=Path, metavar="FILE", help="file to write (default: SCENARIO.ssp here)")
    package.add_argument(
        "--fmi",
        type=int,
        choices=(2, 3),
        default=2,
        help="FMI version (default: 2, which most SSP masters support)",
    )
    package.add_argument(
        "--platforms", default="native",
        help="native for this machine (default); by the ziglang package: all, or such as x86_64-linux,x86_64-windows",
    )  # fmt: skip
    package.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides", help="as for run")


def export(options: argparse.Namespace) -> int:
    """Run ``cosim export``."""
    from cosim.export import export_run

    def run() -> None:
        for file in export_run(
            options.folder, options.to, options.out,
            signals=options.signals, every=options.every, rate=options.rate, force=options.force,
        ):  # fmt: skip
            print(file)

    return say_if_interrupted(run, "nothing is written, and the same command begins again")


def package(options: argparse.Namespace) -> int:
    """Run ``cosim package``."""
    from cosim.scenario.scenario import load_scenario
    from cosim.ssp import package_system

    scenario = load_scenario(options.scenario, options.overrides)
    out = options.out or Path(f"{scenario.name}.ssp")
    print(package_system(scenario, out, options.fmi, options.platforms))
    return 0
