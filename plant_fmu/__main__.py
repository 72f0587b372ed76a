"""Command line: ``python -m plant_fmu {build,check,list,docs,plot,ssv,reference}``."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from plant_fmu.archive import write_whole
from plant_fmu.build import FMI_VERSIONS, build_fmu
from plant_fmu.check import Verdict, check_fmu
from plant_fmu.contents.layered import reference_files
from plant_fmu.contents.parameter_set import ssv
from plant_fmu.contents.reference import reference
from plant_fmu.description import documentation
from plant_fmu.errors import PlantFmuError
from plant_fmu.pictures import IMAGES, PICTURES, image
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

    check = verbs.add_parser("check", help="try an FMU in every validator and importer that is installed")
    check.add_argument("fmu", type=Path, metavar="FILE.fmu", help="any FMU of FMI 2.0 or 3.0; its binary is run")
    check.add_argument("--stop-time", type=float, metavar="S", help="default: the FMU's own, else 10")
    check.add_argument("--step", type=float, metavar="S", help="default: the FMU's own, else 0.01")
    check.add_argument(
        "--set", type=_assignment, action="append", default=[], metavar="NAME=NUMBER", help="start value of a variable"
    )

    verbs.add_parser("list", help="list the shipped vehicles")

    docs = verbs.add_parser("docs", help="print the page of an FMU's variables, in Markdown")
    docs.add_argument("--vehicle", required=True, help="a shipped name, or a TOML file")

    plot = verbs.add_parser("plot", help="draw the thrusters of a vehicle, or the variables of its FMU")
    plot.add_argument("vehicle", metavar="VEHICLE", help="a shipped name, or a TOML file")
    plot.add_argument("picture", choices=tuple(PICTURES), metavar="PICTURE", help=", ".join(PICTURES))
    plot.add_argument("--out", type=_picture_file, required=True, metavar="FILE", help=".png, .svg or .pdf")

    numbers = verbs.add_parser("ssv", help="write the parameters of a vehicle as an SSP parameter set")
    numbers.add_argument("--vehicle", required=True, help="a shipped name, or a TOML file")
    numbers.add_argument("--out", type=Path, help="file to write (default: NAME.ssv here)")

    results = verbs.add_parser("reference", help="write a manoeuvre and its results, integrated without the FMU")
    results.add_argument("--vehicle", required=True, help="a shipped name, or a TOML file")
    results.add_argument("--out", type=Path, default=Path(), help="folder to write to (default: here)")
    return parser


def _write(out: Path, text: str) -> Path:
    write_whole(out, text.encode())
    return out


def _picture_file(text: str) -> Path:
    if Path(text).suffix[1:].lower() not in IMAGES:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a name that ends in .{', .'.join(IMAGES)}")
    return Path(text)


def _assignment(text: str) -> tuple[str, float]:
    name, _, number = text.rpartition("=")
    try:
        value = float(number)
        if math.isfinite(value):
            return name, value
        raise ValueError(number)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected NAME=NUMBER") from None


def _print_verdicts(verdicts: Sequence[Verdict]) -> None:
    rows = [("importer", "version", "type", "verdict", "difference", "note")]
    for verdict in verdicts:
        result = verdict.result
        difference = "" if verdict.difference is None else f"{verdict.difference:.1e}"
        rows.append((result.importer, result.version, result.interface, result.status, difference, result.note))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
    compared = [verdict for verdict in verdicts if verdict.difference is not None]
    if compared:
        print("difference: the greatest of an output at the stop time to FMPy's co-simulation")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: those of the process.

    Returns
    -------
    int
        0; 1 if an importer failed with a checked FMU; 2 where the user must mend something; 130 if interrupted.
    """
    options = _parser().parse_args(arguments)
    try:
        if options.verb == "list":
            names = shipped_vehicles()
            for name in names:
                print(f"{name:{max(map(len, names))}}  {load_vehicle(name).title}")
        elif options.verb == "docs":
            print(documentation(load_vehicle(options.vehicle)), end="")
        elif options.verb == "plot":
            figure = PICTURES[options.picture](load_vehicle(options.vehicle))
            write_whole(options.out, image(figure, options.out.suffix[1:].lower()))
            print(options.out)
        elif options.verb == "ssv":
            vehicle = load_vehicle(options.vehicle)
            print(_write(options.out or Path(f"{vehicle.name}.ssv"), ssv(vehicle)))
        elif options.verb == "reference":
            vehicle = load_vehicle(options.vehicle)
            for name, text in reference_files(vehicle, reference(vehicle)).items():
                print(_write(options.out / name, text))
        elif options.verb == "check":
            verdicts = check_fmu(options.fmu, options.stop_time, options.step, dict(options.set))
            _print_verdicts(verdicts)
            return 1 if any(verdict.result.status == "failed" for verdict in verdicts) else 0
        else:
            vehicle = load_vehicle(options.vehicle)
            print(build_fmu(vehicle, options.fmi, options.out or Path(f"{vehicle.name}.fmu"), options.platforms))
    except PlantFmuError as error:
        print(f"plant_fmu: {error}", file=sys.stderr)
        return 2
    except OSError as error:  # a full disk, or a reader that has gone
        print(f"plant_fmu: {error.filename or 'output'}: {error.strerror or error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("plant_fmu: interrupted", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
