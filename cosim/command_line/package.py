"""``cosim package``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def add_verb(verbs: Any) -> None:
    """Add the verb to the parser.

    Parameters
    ----------
    verbs : argparse subparsers
        Of the command.
    """
    package = verbs.add_parser("package", help="write a scenario as a system of FMUs that other masters run")
    package.add_argument("scenario", help="a shipped name (see cosim list), or a TOML file")
    package.add_argument("--to", choices=("ssp",), default="ssp", help="format (default: ssp)")
    package.add_argument("--out", type=Path, metavar="FILE", help="file to write (default: SCENARIO.ssp here)")
    package.add_argument(
        "--fmi", type=int, choices=(2, 3), default=2, help="of the FMUs (default: 2, which most masters of SSP take)"
    )
    package.add_argument(
        "--platforms", default="native",
        help="native for this machine (default); by the ziglang package: all, or such as x86_64-linux,x86_64-windows",
    )  # fmt: skip
    package.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides", help="as for run")


def package(options: argparse.Namespace) -> int:
    """Run ``cosim package``."""
    from cosim.scenario.scenario import load_scenario
    from cosim.ssp import package_system

    scenario = load_scenario(options.scenario, options.overrides)
    out = options.out or Path(f"{scenario.name}.ssp")
    print(package_system(scenario, out, options.fmi, options.platforms))
    return 0
