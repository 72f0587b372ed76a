"""Command line: ``python -m plant_fmu {build,check,list,docs,plot,ssv,reference}``."""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from plant_fmu.installing import install_hint


def _missing(error: ModuleNotFoundError) -> str:
    command = install_hint("./fuzzy_arbiter", ".")
    return f"plant_fmu: {error.name} is not installed: run {command} in the checkout of subreach"


try:
    from plant_fmu.archive import write_atomic
    from plant_fmu.build import FMI_VERSIONS, build_fmu
    from plant_fmu.checking.check import check_fmu
    from plant_fmu.checking.task import Result
    from plant_fmu.compiling.platforms import ALL, NATIVE, PLATFORMS, WASM
    from plant_fmu.contents.layered import reference_files
    from plant_fmu.contents.parameter_set import ssv
    from plant_fmu.contents.reference import reference
    from plant_fmu.description import documentation
    from plant_fmu.errors import PlantFmuError, one_line
    from plant_fmu.pictures import IMAGES, PICTURES, image
    from plant_fmu.vehicle import load_vehicle, shipped_vehicles
except ModuleNotFoundError as error:  # in a checkout that is not installed
    print(_missing(error), file=sys.stderr)
    sys.exit(2)

FAULT, INTERRUPTED, NO_READER = 2, 130, 141


class _Version(argparse.Action):
    """Print the version, which takes a while to find."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib import metadata

        try:
            version = metadata.version("subreach")
        except metadata.PackageNotFoundError:
            version = "of a folder that is not installed"
        print(f"plant_fmu {version}")
        parser.exit()


class _Parser(argparse.ArgumentParser):
    """Report a wrong option in one line, as all other errors."""

    def print_help(self, file: Any = None) -> None:
        """Print it; argparse itself would pass over output that fails."""
        print(self.format_help(), end="", file=file)

    def error(self, message: str) -> NoReturn:
        verb = self.prog.removeprefix("python -m plant_fmu").strip()
        _report(f"{verb + ': ' if verb else ''}{message}; see --help")
        self.exit(FAULT)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="python -m plant_fmu", description="Underwater vehicles as FMUs.")
    parser.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    verbs = parser.add_subparsers(dest="verb", required=True)

    build = verbs.add_parser("build", help="write the FMU of a vehicle")
    build.add_argument("--vehicle", required=True, help="a shipped name, or a TOML file")
    build.add_argument("--fmi", type=int, choices=FMI_VERSIONS, default=3, help="FMI 2.0 or 3.0 (default: 3)")
    build.add_argument(
        "--platforms",
        default=NATIVE,
        help=f"{NATIVE} for this machine (default); by the ziglang package: {ALL}, or some of {','.join(PLATFORMS)}; "
        f"beside these {WASM}, a WebAssembly component",
    )
    build.add_argument("--coupled", action="store_true", help="with inputs for currents, external forces and the like")
    build.add_argument("--arrays", action="store_true", help="with arrays, sensors on clocks, and event mode (FMI 3.0)")
    build.add_argument("--small", action="store_true", help="with body and thrusters alone, for co-simulation")
    build.add_argument("--out", type=Path, help="file to write (default: NAME.fmu here)")

    check = verbs.add_parser("check", help="validate an FMU, and simulate it in FMPy and in Plant")
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

    results = verbs.add_parser("reference", help="write a maneuver and its results, integrated without the FMU")
    results.add_argument("--vehicle", required=True, help="a shipped name, or a TOML file")
    results.add_argument("--out", type=Path, default=Path(), help="folder to write to (default: here)")
    return parser


def _write(out: Path, text: str) -> Path:
    write_atomic(out, text.encode())
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


def _print_results(results: Sequence[Result]) -> None:
    rows = [("importer", "version", "type", "verdict", "difference", "note")]
    for result in results:
        difference = "" if result.difference is None else f"{result.difference:.1e}"
        rows.append((result.importer, result.version, result.interface, result.status, difference, result.note))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
    if any(result.difference is not None for result in results):
        print("difference: maximum over the outputs at the stop time, to FMPy's co-simulation")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    if sys.stdout is None:  # closed by the parent process: the next file that is opened would take its place
        _report("standard output is closed; expected it open, such as on /dev/null")
        return FAULT
    try:
        try:
            return _run(_parser().parse_args(arguments))
        finally:
            sys.stdout.flush()
    except ModuleNotFoundError as error:  # this package is not installed: its version goes into an FMU
        print(_missing(error), file=sys.stderr)
        return FAULT
    except PlantFmuError as error:
        _report(str(error))
        return FAULT
    except BrokenPipeError:
        _drop_output()
        return NO_READER
    except OSError as error:  # for example a full disk behind the output
        _drop_output()
        _report(f"{error.filename or 'standard output'}: {error.strerror or error}")
        return FAULT
    except KeyboardInterrupt:
        _report("interrupted")
        return INTERRUPTED


def _run(options: argparse.Namespace) -> int:
    if options.verb == "list":
        names = shipped_vehicles()
        for name in names:
            print(f"{name:{max(map(len, names))}}  {load_vehicle(name).title}")
        return 0
    if options.verb == "check":
        results = check_fmu(options.fmu, options.stop_time, options.step, dict(options.set))
        _print_results(results)
        return 1 if any(result.status == "failed" for result in results) else 0
    vehicle = load_vehicle(options.vehicle)
    if options.verb == "docs":
        print(documentation(vehicle), end="")
    elif options.verb == "plot":
        figure = PICTURES[options.picture](vehicle)
        write_atomic(options.out, image(figure, options.out.suffix[1:].lower()))
        print(options.out)
    elif options.verb == "ssv":
        print(_write(options.out or Path(f"{vehicle.name}.ssv"), ssv(vehicle)))
    elif options.verb == "reference":
        for name, text in reference_files(vehicle, reference(vehicle)).items():
            print(_write(options.out / name, text))
    else:
        out, kind = options.out or Path(f"{vehicle.name}.fmu"), ("coupled", "arrays", "small")
        choices = {name: getattr(options, name) for name in kind}
        print(build_fmu(vehicle, options.fmi, out, options.platforms, **choices))
    return 0


def _report(message: str) -> None:
    """Print one line on standard error; nothing where that is closed or gone."""
    if sys.stderr is not None:  # else `print` would take standard output
        with contextlib.suppress(OSError):
            print(f"plant_fmu: {one_line(message)}", file=sys.stderr, flush=True)


def _drop_output() -> None:
    """Redirect standard output to the null device, else the interpreter fails again as it flushes at its end."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == "__main__":
    sys.exit(main())
