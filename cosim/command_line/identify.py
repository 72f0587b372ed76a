"""``cosim identify``: parameters from runs, and stick inputs for such runs."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cosim.command_line.flags import add_verb, flag, float_range, int_range, refuse_flags
from cosim.command_line.process import say

# default values
_EXCITATION: dict[str, Any] = {"box": (10.0, 10.0, 4.0), "depth": 3.0, "time": 300.0, "current": 0.1, "seed": 0}


def add_verbs(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    verb = add_verb(
        verbs, "identify", identify, "find a vehicle's parameters from recorded runs, or stick inputs for such runs",
        "howto/own-vehicle",
        ("identify runs/pool-1 --held-out runs/pool-2 --vehicle bluerov2_heavy --out mine.toml",
         "identify runs/pool-1 --vehicle mine.toml --out better.toml --free hydrostatics.buoyancy",
         "identify --excite --vehicle bluerov2_heavy --box 5 4 2 --depth 1.5 --time 600 --out pool",
         "run pool/excite.toml --replay-commands pool/commands.jsonl --out runs/pool"),
    )  # fmt: skip
    verb.add_argument("runs", nargs="*", type=Path, metavar="RUN", help="run folders that are fitted")
    flag(verb, "--vehicle START", "a shipped vehicle or TOML file: where the search starts", required=True)
    flag(
        verb, "--free KEY", "keys of the vehicle's file, such as hydrodynamics.added_mass or "
        "hydrodynamics.added_mass.2.6 (default: added mass, damping, buoyancy and its center, the thrusters' time "
        "constant, the DVL's position)", nargs="+",
    )  # fmt: skip
    flag(
        verb, "--nuisance NAME", "nuisance parameters: current, force, delay, bias, scale, asymmetry, phase, "
        "random_force (default: current, bias, scale and phase); or auto: those that predict best what "
        "was not fitted, with measured attitude", nargs="*",
    )  # fmt: skip
    flag(verb, "--measured-attitude", "take attitude and turn rates as inputs, and identify translation alone")
    flag(verb, "--held-out RUN", "run folders that are predicted, not fitted", Path, [], nargs="+")
    flag(
        verb, "--out PATH", "the vehicle's TOML file, beside which its page and FILE.posterior.jsonl are written; with "
        "--excite a new folder: scenario, commands, sticks.csv, page", Path, required=True,
    )  # fmt: skip
    excite = verb.add_argument_group("excitation")
    flag(excite, "--excite", "choose stick inputs that make the parameters identifiable, instead of fitting runs")
    length = float_range(0.1, 1000.0)
    flag(excite, "--box NORTH EAST DOWN", "sizes of the water that may be used [m] (default: 10 10 4)", length, nargs=3)
    flag(excite, "--depth M", "depth of the box's center [m] (default: 3)", length)
    flag(excite, "--time S", "duration of all inputs [s] (default: 300)", float_range(1.0, 36000.0))
    flag(excite, "--current SPEED", "current that the box allows for [m/s] (default: 0.1)", float_range(0.0, 2.0))
    flag(excite, "--seed N", "seed of the candidates (default: 0)", int_range(0, 2**31))


def identify(options: argparse.Namespace) -> int:
    """Run ``cosim identify``."""
    from cosim.identification.parameters import DEFAULT_NUISANCES
    from cosim.run.progress import ProgressBar

    nuisance = DEFAULT_NUISANCES if options.nuisance is None else options.nuisance
    work, what = (_excite, "excite") if options.excite else (_fit, "identify")
    bar_format = "{desc} {percentage:3.0f}%|{bar}| [{elapsed}]"
    with ProgressBar(not options.quiet, bar_format, total=1.0, desc=what) as bar:
        lines = work(options, options.free, nuisance, bar.update_to)
    say(options, *lines)
    print(options.out)
    return 0


def _fit(
    options: argparse.Namespace, free: Sequence[str] | None, nuisance: Sequence[str], progress: Callable[[float], None]
) -> list[str]:
    """Identify the vehicle and write it; return what to print."""
    from cosim.identification import findings
    from cosim.identification.identification import identify, summary_lines, write_results
    from cosim.identification.vehicle_file import name_of_file

    refuse_flags(options, [*_EXCITATION], "--excite with it")
    name_of_file(options.out)  # so that hours of work do not end at it
    done = identify(
        options.runs, options.vehicle, free, nuisance, options.held_out, progress, options.measured_attitude
    )
    posterior, page = write_results(done, options.out)
    warnings = findings.warnings(done.fit, done.logs)
    return [findings.verdict(done.fit), *summary_lines(done), *warnings, str(posterior), str(page)]


def _excite(
    options: argparse.Namespace, free: Sequence[str] | None, nuisance: Sequence[str], progress: Callable[[float], None]
) -> list[str]:
    """Design the stick inputs and write their folder; return what to print."""
    from cosim.identification import excitation_page
    from cosim.identification.excitation import design
    from cosim.identification.parameters import DEFAULT_FREE

    refuse_flags(options, ["runs", "held_out", "measured_attitude"], "none with --excite")
    excitation_page.require_empty(options.out)
    given = {name: getattr(options, name) for name in _EXCITATION if getattr(options, name) is not None}
    box, depth, time, current, seed = (_EXCITATION | given).values()
    free = DEFAULT_FREE if free is None else free
    done = design(options.vehicle, tuple(box), depth, time, free, nuisance, seed, progress, current)
    page = excitation_page.write_folder(done, options.out)
    return [excitation_page.verdict(done), *excitation_page.warnings(done), str(page)]
