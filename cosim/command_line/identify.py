"""``cosim identify``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.results import say

_EPILOG = """examples:
  cosim identify runs/pool-1 runs/pool-2 --vehicle bluerov2_heavy --out mine.toml
  cosim identify runs/pool-1 --held-out runs/pool-2 --vehicle mine.toml --out better.toml \\
      --free hydrodynamics.quadratic_damping hydrostatics.buoyancy --nuisance current force bias
"""


def add_verb(verbs: Any) -> None:
    """Add the verb to the parser.

    Parameters
    ----------
    verbs : argparse subparsers
        Of the command.
    """
    identify = verbs.add_parser(
        "identify", help="find a vehicle's parameters from recorded runs",
        epilog=_EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    identify.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="run folders that are fitted")
    identify.add_argument(
        "--vehicle", required=True, metavar="START", help="a shipped vehicle or TOML file: where the search starts"
    )
    identify.add_argument(
        "--free", nargs="+", metavar="KEY",
        help="keys of the vehicle's file, such as hydrodynamics.added_mass or hydrodynamics.added_mass.2.6 (default: "
        "added mass, damping, buoyancy and its centre, the thrusters' time constant)",
    )  # fmt: skip
    identify.add_argument(
        "--nuisance", nargs="*", metavar="NAME",
        help="what is estimated beside: current, force, delay, lever, bias, scale (default: current lever bias)",
    )  # fmt: skip
    identify.add_argument(
        "--held-out", nargs="+", type=Path, default=[], metavar="RUN", help="run folders that are predicted, not fitted"
    )
    identify.add_argument(
        "--out", type=Path, required=True, metavar="FILE.toml", help="the vehicle; its page beside it"
    )


def identify(options: argparse.Namespace) -> int:
    """Run ``cosim identify``."""
    from cosim.identification import findings
    from cosim.identification.identify import identify as identify_runs
    from cosim.identification.identify import write_vehicle
    from cosim.identification.page import write_page
    from cosim.identification.parameters import DEFAULT_FREE, DEFAULT_NUISANCES
    from cosim.identification.vehicle_file import name_of_file
    from cosim.run.progress import ProgressBar

    name_of_file(options.out)  # so that hours of work do not end at it
    bar_format = "{desc} {percentage:3.0f}%|{bar}| [{elapsed}]"
    with ProgressBar(not options.quiet, bar_format, total=1.0, desc="identify") as bar:
        done = identify_runs(
            options.runs, options.vehicle, DEFAULT_FREE if options.free is None else options.free,
            DEFAULT_NUISANCES if options.nuisance is None else options.nuisance, options.held_out, bar.update_to,
        )  # fmt: skip
    write_vehicle(done, options.out)
    page = write_page(done, options.out)
    say(options, findings.verdict(done.fit), *findings.warnings(done.fit, done.logs), str(page))
    print(options.out)
    return 0
