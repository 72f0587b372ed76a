"""``cosim import``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.flags import add_verb, flag, float_range
from cosim.command_line.process import print_run, say, say_if_interrupted

_BAR = "{desc} {percentage:3.0f}%|{bar}| [{elapsed}<{remaining}]"


def add_verbs(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    verb = add_verb(
        verbs, "import", import_, "read the log of a vehicle as a run", "howto/logs",
        ("import dive.BIN --vehicle bluerov2_heavy --out runs/dive",
         "import dive.csv --vehicle mine.toml --map columns.toml --scenario pool.toml"),
    )  # fmt: skip
    verb.add_argument(
        "logs", type=Path, nargs="+", metavar="LOG",
        help=".bin, .tlog, .ulg, .csv, .parquet, .mcap, .db3, .bag or a bag's folder; several of one run are joined",
    )  # fmt: skip
    flag(verb, "--vehicle NAME", "the vehicle of the log: a shipped name, or a TOML file", required=True)
    flag(verb, "--scenario NAME", "shipped name or TOML file, whose goal and regions score the run (default: none)")
    flag(verb, "--map FILE", "column map, for tables and bags of ROS; without one a draft is printed", Path)
    flag(verb, "--rate HZ", "rows per second (default: by the log)", float_range(1e-3, 1e4))
    curves = "linear", "quadratic", "t200"
    flag(verb, "--curve", "curve from servo pulse to force (default: that of the vehicle's file)", choices=curves)
    flag(verb, "--voltage V", "supply voltage of the thrusters (default: that of the log)", float_range(1.0, 1e3))
    flag(verb, "--out RUN", "the run folder (default: a new one below runs)", Path)
    flag(verb, "--overwrite", "replace the run that the folder holds")
    flag(verb, "--no-report", "write no report and no replay")


def import_(options: argparse.Namespace) -> int:
    """Run ``cosim import``."""
    from cosim.errors import ImportLogError
    from cosim.logs import import_log
    from cosim.results.log_facts import load_log_facts
    from cosim.run.progress import ProgressBar

    def run() -> None:
        with ProgressBar(not options.quiet, _BAR, total=1.0, desc=options.logs[0].name) as bar:
            done = import_log(
                options.logs, options.vehicle, options.out,
                scenario=options.scenario, columns=options.map, rate=options.rate, curve=options.curve,
                voltage=options.voltage, report=not options.no_report, overwrite=options.overwrite,
                on_progress=bar.update_to,
            )  # fmt: skip
        say(options, *load_log_facts(done.folder).remarks)
        print_run(options, done, not options.no_report)

    try:
        return say_if_interrupted(run, "nothing is written, and the same command begins again")
    except ImportLogError as error:
        print(error.draft, end="")
        raise
