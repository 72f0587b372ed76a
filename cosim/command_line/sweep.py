"""``cosim sweep`` and ``cosim rerun``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.campaigns import add_cluster, add_replays, executor_of, require_one_count, resumable
from cosim.command_line.process import INTERRUPTED, print_status
from cosim.command_line.results import print_run, say
from cosim.errors import RunError

_EPILOG = """examples:
  cosim sweep docking --vary initial.position.1=-4:-2 law.gains.speed=0.3:1.5:log --samples 1000 --out sweeps/start
  cosim sweep paper --set arbiter.engine=closed --vary law.gains.k_p1=10:30:5 law.gains.k_q=5,10,20 --design grid \\
      --workers 2 --out sweeps/gains
  cosim sweep pool.toml --set arbiter.engine=closed --vehicles mine.posterior.jsonl --out sweeps/mine
  cosim rerun sweeps/start 17 --out runs/worst
"""


def add_verbs(verbs: Any) -> None:
    """Add the verbs to the subparsers of the command."""
    sweep = verbs.add_parser(
        "sweep", help="fly a scenario many times with varied numbers",
        epilog=_EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    sweep.add_argument("scenario", help="a shipped name (see cosim list), or a TOML file; it stands before --vary")
    varied = sweep.add_mutually_exclusive_group(required=True)
    varied.add_argument(
        "--vary", nargs="+", action="extend", metavar="KEY=LOW:HIGH[:N][:log]",
        help="a key of the scenario and its range, with the number of points on a grid; or KEY=A,B,C",
    )  # fmt: skip
    varied.add_argument(
        "--vehicles", type=Path, metavar="FILE.jsonl",
        help="vehicles that cosim identify has drawn: each is the plant of a row, and the law knows the scenario's own",
    )  # fmt: skip
    sweep.add_argument("--samples", type=int, metavar="N", help="number of rows, unless the design is a grid")
    sweep.add_argument(
        "--design",
        metavar="grid|random|sobol|lhs|paired",
        help="how rows are spread (default: random; of --vehicles: paired)",
    )
    sweep.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the design and the rows (default: 0)")
    sweep.add_argument(
        "--out", type=Path, required=True, metavar="DIR",
        help="a new folder, or one that this command began: it goes on with what is left",
    )  # fmt: skip
    sweep.add_argument("--engine", default="fused", help=argparse.SUPPRESS)
    add_cluster(sweep)
    add_replays(sweep)
    sweep.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
        help="change a key of the scenario in all rows; may be repeated",
    )  # fmt: skip

    rerun = verbs.add_parser("rerun", help="repeat a row of a campaign, to the last bit and with full record")
    rerun.add_argument("folder", type=Path, metavar="DIR", help="the folder of a sweep or campaign")
    rerun.add_argument("row", type=int, metavar="ROW", help="number of the row; of a campaign, the seed of the scene")
    rerun.add_argument("--out", type=Path, metavar="RUN", help="run folder (default: runs/SCENARIO-row-ROW-TIME)")


def sweep(options: argparse.Namespace) -> int:
    """Run ``cosim sweep``."""
    from cosim.campaigns.pages.sweep_page import sweep_lines, write_sweep_page
    from cosim.campaigns.sweep import run_sweep
    from cosim.campaigns.sweeps.design import Design, vary_from, vary_vehicles
    from cosim.scenario.scenario import load_scenario
    from cosim.scenario.toml_file import split_change

    require_one_count(options)
    vary = vary_vehicles(options.vehicles) if options.vehicles else vary_from(options.vary)
    kind: Any = options.design or ("paired" if options.vehicles else "random")
    design = Design(vary, kind, options.samples, options.seed)
    both = {vary.key for vary in design.vary} & {split_change(text)[0] for text in options.overrides}
    if both:
        raise RunError(f"{min(both)} is set and varies, expected either")
    scenario = load_scenario(options.scenario, options.overrides)

    def run() -> None:
        with executor_of(options) as executor:
            n = options.workers or 1
            done = run_sweep(scenario, design, options.out, options.engine, n, executor, progress=not options.quiet)
        if not done.flown:
            say(options, f"{options.out}: was complete already")
        say(options, *sweep_lines(done.summary))
        print(write_sweep_page(options.out, options.replays))

    return resumable(run, options.out)


def rerun(options: argparse.Namespace) -> int:
    """Run ``cosim rerun``."""
    from cosim.campaigns.reruns.rerun import rerun as rerun_row

    done = rerun_row(options.folder, options.row, options.out, progress=not options.quiet)
    if done.other_code:
        print_status("the code is not that which flew the row")
    for name, (before, now) in done.differing.items():
        print_status(f"row {done.key}: {name} was {before!r}, is {now!r} now")
    if not done.differing:
        say(options, f"row {done.key}: flown again, identical to the last bit")
    for name, (before, now) in done.apart.items():
        print_status(f"row {done.key}, step by step: {name} was {before!r}, is {now!r} now")
    if done.stopped is not None:
        say(options, f"row {done.key}: step by step too the plant stops: {done.stopped}")
    if done.run is not None:
        print_run(options, done.run)
        if done.run.summary["status"] == "interrupted":
            return INTERRUPTED
    return 1 if done.differing or done.apart else 0
