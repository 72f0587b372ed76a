"""``cosim sweep`` and ``cosim rerun``."""

from __future__ import annotations

import argparse
import functools
from pathlib import Path
from typing import Any

from cosim.command_line.campaigns import (
    add_campaign_folder,
    add_cluster,
    executor_of,
    fly,
    load_with_law,
    own_laws,
    refuse_both,
)  # fmt: skip
from cosim.command_line.flags import add_changes, add_verb, flag
from cosim.command_line.process import INTERRUPTED, print_run, print_status, say


def add_verbs(verbs: Any) -> None:
    """Add the verbs to the subparsers of the command."""
    verb = add_verb(
        verbs, "sweep", sweep, "fly a scenario many times with varied numbers", "campaigns",
        ("sweep docking --vary initial.position.1=-4:-2 law.gains.speed=0.3:1.5:log --samples 1000 --out sweeps/start",
         "sweep paper-limited --vary law.gains.k_p1=10:30:5 law.gains.k_q=5,10,20 --design grid --out sweeps/gains",
         "sweep pool.toml --vehicles mine.posterior.jsonl --out sweeps/mine"),
    )  # fmt: skip
    verb.add_argument(
        "scenario", help="a shipped name (cosim show lists them), or a TOML file; it stands before --vary"
    )
    varied = verb.add_mutually_exclusive_group(required=True)
    flag(varied, "--vary KEY=LOW:HIGH[:N][:log]", "a key and its range, or KEY=A,B,C", nargs="+", action="extend")
    flag(varied, "--vehicles FILE.jsonl", "vehicles that cosim identify has drawn: each is the plant of a row", Path)
    flag(verb, "--law NAME|FILE", "law such as pd, an .fmu file, or FILE.py:NAME; instead of the scenario's own")
    flag(verb, "--samples N", "number of rows, unless the design is a grid", int)
    flag(
        verb,
        "--design grid|random|sobol|lhs|paired",
        "how rows are spread over the ranges (default: random; of --vehicles: paired)",
    )
    flag(verb, "--seed S", "seed of the design and the rows", int, 0)
    add_campaign_folder(verb)
    add_cluster(verb)
    add_changes(verb, "a key of the scenario in all rows")

    verb = add_verb(
        verbs, "rerun", rerun, "repeat a row of a campaign, to the last bit and with full record", "campaigns",
        ("rerun sweeps/start 17 --out runs/worst",),
    )  # fmt: skip
    verb.add_argument("folder", type=Path, metavar="DIR", help="the folder of a sweep or campaign")
    verb.add_argument("row", type=int, metavar="ROW", help="number of the row; of a campaign, the seed of the scene")
    flag(verb, "--out RUN", "run folder (default: runs/SCENARIO-row-ROW-TIME)", Path)
    flag(verb, "--law FILE.py:NAME", "the law of the row, if it is Python code")


def sweep(options: argparse.Namespace) -> int:
    """Run ``cosim sweep``."""
    from cosim.campaigns.pages.sweep_page import sweep_lines, write_sweep_page
    from cosim.campaigns.parameter_sweep import run_sweep
    from cosim.campaigns.sweeps.design import Design, vary_from, vary_vehicles

    vary = vary_vehicles(options.vehicles) if options.vehicles else vary_from(options.vary)
    kind: Any = options.design or ("paired" if options.vehicles else "random")
    design = Design(vary, kind, options.samples, options.seed)
    refuse_both(design.vary, options.set)
    scenario, own = load_with_law(options.scenario, options.law, options.set)

    def work() -> Any:
        with executor_of(options) as executor:
            how: Any = {"workers": options.workers or 1, "executor": executor, "progress": not options.quiet}
            return run_sweep(scenario, design, options.out, law=own, **how)

    page = functools.partial(write_sweep_page, laws=own_laws(own))
    return fly(options, work, lambda done: sweep_lines(done.summary), page)


def rerun(options: argparse.Namespace) -> int:
    """Run ``cosim rerun``."""
    from cosim.campaigns.rerun import rerun as rerun_row
    from cosim.scenario.law_factory import read_law

    law = read_law(options.law) if options.law else None
    done = rerun_row(options.folder, options.row, options.out, not options.quiet, law)
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
