"""``cosim export``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.flags import LIST, add_changes, add_verb, flag, float_range, int_range, refuse_flags
from cosim.command_line.process import say_if_interrupted


def add_verbs(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    verb = add_verb(
        verbs, "export", export, "write a run in the format of another tool, or a scenario as a system of FMUs",
        "export", ("export runs/docking --to csv", "export runs/docking --to mcap --rate 50 --out flight.mcap",
                   "export docking --to ssp --out docking.ssp", "export docking --to fmu"),
    )  # fmt: skip
    verb.add_argument(
        "source", metavar="RUN|SCENARIO", help="the run folder; with --to ssp or fmu a shipped name or TOML file"
    )
    flag(
        verb, "--to FORMAT", "csv (spreadsheets), mcap (Foxglove, PlotJuggler), rrd (Rerun), rosbag2 (ROS 2), tlog "
        "(QGroundControl); or ssp: plant, controller and arbiter of a scenario as FMUs that other masters run; or fmu: "
        "those, or an SSP file, as one FMU",
        required=True,
    )  # fmt: skip
    flag(verb, "--out FILE", "file to write (default: RUN.FORMAT or SCENARIO.FORMAT here)", Path)
    flag(verb, "--force", "replace a file that exists")
    thinned = verb.add_mutually_exclusive_group()
    flag(thinned, "--every N", "export every N-th step (default: all)", int_range(1, 10**9))
    flag(thinned, "--rate HZ", "steps per simulated second", float_range(1e-9, 1e9))
    flag(verb, "--signals GLOB", "such as 'position.*' (default: all); the time is always included", **LIST)
    flag(
        verb, "--fmi", "with ssp or fmu: FMI version (default: 2, which most SSP masters support)", int, choices=(2, 3)
    )
    flag(verb, "--platforms NAMES", "with ssp or fmu: native (default), all, or such as x86_64-linux,x86_64-windows")
    add_changes(verb, "a key of the scenario, with ssp or fmu")


def export(options: argparse.Namespace) -> int:
    """Run ``cosim export``."""
    from cosim.export import export_run

    if options.to in ("ssp", "fmu"):
        return _export_system(options)
    refuse_flags(options, ["fmi", "platforms", "set"], "--to ssp or fmu with it")

    def run() -> None:
        for file in export_run(
            options.source, options.to, options.out,
            signals=options.signals, every=options.every or 1, rate=options.rate, force=options.force,
        ):  # fmt: skip
            print(file)

    return say_if_interrupted(run, "nothing is written, and the same command begins again")


def _export_system(options: argparse.Namespace) -> int:
    from cosim.errors import ExportError
    from cosim.scenario.scenario import load_scenario
    from cosim.ssp import package_system, write_container
    from plant_fmu.archive import temporary_folder

    to, source = options.to, Path(options.source)
    refuse_flags(options, ["every", "rate", "signals"], f"no --to {to} with it")
    is_system = to == "fmu" and source.suffix == ".ssp"
    if is_system:
        refuse_flags(options, ["platforms", "set"], "a scenario with it")
    scenario = None if is_system else load_scenario(options.source, options.set)
    out = options.out or Path(f"{scenario.name if scenario else source.stem}.{to}")
    if out.is_file() and not options.force:
        raise ExportError(f"{out}: exists; expected a new file, or --force to replace it")
    fmi, platforms = options.fmi or 2, options.platforms or "native"
    if scenario is None:
        print(write_container(source, out, fmi))
    elif to == "ssp":
        print(package_system(scenario, out, fmi, platforms))
    else:
        with temporary_folder("cosim-") as folder:
            print(write_container(package_system(scenario, folder / f"{scenario.name}.ssp", fmi, platforms), out, fmi))
    return 0
