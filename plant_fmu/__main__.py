"""Command line: ``python -m plant_fmu {build,list,docs}``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from plant_fmu.build import FMI_VERSIONS, build_fmu
from plant_fmu.description import documentation
from plant_fmu.errors import PlantFmuError
from plant_fmu.platforms import ALL, NATIVE, PLATFORMS
from plant_fmu.vehicle import load_vehicle, shipped_vehicles


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m plant_fmu", description="Underwater vehicles as FMUs.")
    verbs = parser.add_subparsers(dest="verb", required=True)

    build = verbs.add_parser("build", help="write the FMU of a vehicle")
    build.add_argument("--vehicle", required=True, help="a shipped name, or a TOML file")
    build.add_argument("--fmi", type=int, choices=FMI_VERSIONS, default=3, help="FMI 2.0 or 3.0 (default: 3)")
    build.add_argument(
        "--platforms",
        default=NATIVE,
        help=f"{NATIVE} for this machine (default); by the ziglang package: {ALL}, or some of {','.join(PLATFORMS)}",
    )
    build.add_argument("--out", type=Path, help="file to write (default: NAME.fmu here)")

    verbs.add_parser("list", help="list the shipped vehicles")

    docs = verbs.add_parser("docs", help="print the page of an FMU's variables, in Markdown")
    docs.add_argument("--vehicle", required=True, help="a shipped name, or a TOML file")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: those of the process.

    Returns
    -------
    int
        0, or 2 where the user must mend something.
    """
    options = _parser().parse_args(arguments)
    try:
        if options.verb == "list":
            for name in shipped_vehicles():
                print(f"{name:16} {load_vehicle(name).title}")
        elif options.verb == "docs":
            print(documentation(load_vehicle(options.vehicle)), end="")
        else:
            vehicle = load_vehicle(options.vehicle)
            print(build_fmu(vehicle, options.fmi, options.out or Path(f"{vehicle.name}.fmu"), options.platforms))
    except PlantFmuError as error:
        print(f"plant_fmu: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
