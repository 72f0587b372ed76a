"""``cosim excite`` and ``cosim identify``: stick inputs for an identification, and parameters from its runs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.numbers import number, whole
from cosim.command_line.results import say

_EPILOG = """examples:
  cosim identify runs/pool-1 runs/pool-2 --vehicle bluerov2_heavy --out mine.toml
  cosim identify runs/pool-1 --held-out runs/pool-2 --vehicle mine.toml --out better.toml \\
      --free hydrodynamics.quadratic_damping hydrostatics.buoyancy --nuisance current force bias
"""

_EXCITE_EPILOG = """examples:
  cosim excite --vehicle bluerov2_heavy --out pool
  cosim excite --vehicle mine.toml --box 5 4 2 --depth 1.5 --current 0.05 --time 600 --out pool
  cosim run pool/excite.toml --replay-commands pool/commands.jsonl --out runs/pool
  cosim identify runs/pool --vehicle bluerov2_heavy --out mine.toml
"""


def add_verbs(verbs: Any) -> None:
    """Add the verbs to the subparsers of the command."""
    _add_excite(verbs)
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
        help="nuisance parameters: current, force, delay, lever, bias, scale, asymmetry, phase, random_force (default: "
        "current, lever, bias, scale and phase)",
    )  # fmt: skip
    identify.add_argument(
        "--held-out", nargs="+", type=Path, default=[], metavar="RUN", help="run folders that are predicted, not fitted"
    )
    identify.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="FILE.toml",
        help="the vehicle; beside it its page and FILE.posterior.jsonl",
    )


def _add_excite(verbs: Any) -> None:
    excite = verbs.add_parser(
        "excite", help="choose stick inputs that make a vehicle's parameters identifiable",
        epilog=_EXCITE_EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    excite.add_argument("--vehicle", required=True, help="a shipped vehicle or TOML file: the numbers known before")
    length = number(0.1, 1000.0)
    excite.add_argument(
        "--box", nargs=3, type=length, default=(10.0, 10.0, 4.0), metavar=("NORTH", "EAST", "DOWN"),
        help="sizes of the water that may be used [m] (default: 10 10 4)",
    )  # fmt: skip
    excite.add_argument("--depth", type=length, default=3.0, help="depth of the box's center [m] (default: 3)")
    excite.add_argument(
        "--time", type=number(1.0, 36000.0), default=300.0, help="duration of all inputs [s] (default: 300)"
    )
    excite.add_argument("--free", nargs="+", metavar="KEY", help="parameters to identify, as for cosim identify")
    excite.add_argument("--nuisance", nargs="*", metavar="NAME", help="nuisance parameters, as for cosim identify")
    excite.add_argument(
        "--current",
        type=number(0.0, 2.0),
        default=0.1,
        help="current that the box allows for [m/s] (default: 0.1)",
    )
    excite.add_argument("--seed", type=whole(0, 2**31), default=0, help="seed of the candidates (default: 0)")
    excite.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="a new folder: scenario, commands, sticks.csv, page"
    )


def excite(options: argparse.Namespace) -> int:
    """Run ``cosim excite``."""
    from cosim.identification.excitation import folder
    from cosim.identification.excitation.design import design
    from cosim.identification.parameters import DEFAULT_FREE, DEFAULT_NUISANCES
    from cosim.run.progress import ProgressBar

    folder.require_empty(options.out)
    bar_format = "{desc} {percentage:3.0f}%|{bar}| [{elapsed}]"
    with ProgressBar(not options.quiet, bar_format, total=1.0, desc="excite") as bar:
        done = design(
            options.vehicle, tuple(options.box), options.depth, options.time,
            DEFAULT_FREE if options.free is None else options.free,
            DEFAULT_NUISANCES if options.nuisance is None else options.nuisance, options.seed, bar.update_to,
            options.current,
        )  # fmt: skip
    page = folder.write_folder(done, options.out)
    say(options, folder.verdict(done), *folder.warnings(done), str(page))
    print(options.out)
    return 0


def identify(options: argparse.Namespace) -> int:
    """Run ``cosim identify``."""
    from cosim.identification import findings
    from cosim.identification.identify import identify as identify_runs
    from cosim.identification.page import write_results
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
    posterior, page = write_results(done, options.out)
    say(options, findings.verdict(done.fit), *findings.warnings(done.fit, done.logs), str(posterior), str(page))
    print(options.out)
    return 0
