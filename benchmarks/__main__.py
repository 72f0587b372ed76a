"""``python -m benchmarks VERB``: times and ratios in a table, and the search for the gains of baselines."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

from benchmarks import (
    autopilot,
    baselines,
    calibration,
    everything,
    fmu,
    fuzzy,
    fuzzy_accuracy,
    law,
    long_record,
    mavlink,
    nmpc_search,
    page,
    peer_environment,
    scaling,
    sitl,
    step,
    view,
)
from benchmarks.autopilot.flights import OTHER, RANDOM, Task, make_flights
from benchmarks.autopilot.simulated_link import FAULTS
from benchmarks.machine import description
from benchmarks.peer_environment import Environment
from benchmarks.table import Table, as_json, print_tables, write_json
from cosim.companion.companion_options import SteerBy, SticksBy
from cosim.errors import ScenarioError

BENCHMARKS = {"step": step, "law": law, "fmu": fmu, "fuzzy": fuzzy, "mavlink": mavlink, "sitl": sitl, "view": view}
TABLES = {"all": everything, "scaling": scaling}
REPEATS = 5
BUDGET = 0.2  # s, default time of a repeat


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    verbs = parser.add_subparsers(dest="name", required=True)

    def add(name: str, help: str | None, repeats: int = REPEATS) -> argparse.ArgumentParser:
        verb = verbs.add_parser(name, help=(help or "").splitlines()[0])
        verb.add_argument("--repeats", type=int, default=repeats, help="default: %(default)s")
        verb.add_argument("--json", type=Path, metavar="FILE", help="write the figures there too")
        return verb

    for name, chosen in TABLES.items():
        verb = add(name, chosen.__doc__, chosen.REPEATS)
        verb.add_argument("subjects", nargs="*", metavar="SUBJECT", help=f"of {', '.join(chosen.SUBJECTS)}")
        verb.add_argument(
            "--budget", type=float, default=BUDGET, metavar="S", help="of a repeat (default: %(default)s)"
        )
        if name == "all":
            verb.add_argument("--peers-python", metavar="PYTHON", help="that has the peers (default: one of their own)")
    verb = verbs.add_parser("page", help=(page.__doc__ or "").splitlines()[0])
    verb.add_argument("files", nargs="*", type=Path, metavar="FILE", help="what --json wrote (default: measure now)")
    verbs.add_parser("calibration", help=(calibration.__doc__ or "").splitlines()[0])
    verbs.add_parser("peers", help="install the peers, and try those again that could not be")
    for name, benchmark in BENCHMARKS.items():
        verb = add(name, benchmark.__doc__)
        verb.add_argument("--steps", type=int, default=benchmark.STEPS, help="a repeat (default: %(default)s)")
        if benchmark is mavlink:
            verb.add_argument("--datagrams", type=int, help="hostile ones a flood (default: ten a step)")

    verb = verbs.add_parser("fuzzy-accuracy", help=(fuzzy_accuracy.__doc__ or "").splitlines()[0])
    verb.add_argument("--systems", type=int, default=fuzzy_accuracy.SYSTEMS, help="default: %(default)s")
    verb.add_argument("--seed", type=int, default=0, help="of the draws (default: %(default)s)")
    verb = verbs.add_parser("baselines", help=(baselines.__doc__ or "").splitlines()[0])
    verb.add_argument("laws", nargs="*", metavar="LAW", help=f"of {', '.join(baselines.RANGES)} (default: all)")
    verb.add_argument(
        "--draws",
        type=int,
        default=baselines.DRAWS,
        help="0: fly the gains that they have (default: %(default)s)",
    )
    verb.add_argument("--seed", type=int, default=0, help="of the draws (default: %(default)s)")
    verb.add_argument("--workers", type=int, default=2, help="processes (default: %(default)s)")
    verb = verbs.add_parser("nmpc", help=(nmpc_search.__doc__ or "").splitlines()[0])
    verb.add_argument("kinds", nargs="*", metavar="KIND", help=f"of {', '.join(nmpc_search.FLOWN)} (default: all)")
    verb.add_argument("--seed", type=int, default=0, help="of the first scene, or draw (default: %(default)s)")
    verb.add_argument("--count", type=int, default=nmpc_search.COUNT, help="scenes of a kind (default: %(default)s)")
    verb.add_argument("--draws", type=int, default=0, help="search among so many draws, instead of flying KIND")
    verb.add_argument("--peers-python", metavar="PYTHON", help="that has CasADi (default: one of their own)")
    verb.add_argument("--json", type=Path, metavar="FILE", help="of flights; those that it has are not repeated")
    _add_autopilot(verbs)
    verb = verbs.add_parser("long-record", help=(long_record.__doc__ or "").splitlines()[0])
    verb.add_argument("--rows", type=int, nargs="+", default=long_record.ROWS, help="of the runs (default: 1 and 10 M)")
    verb.add_argument(
        "--work",
        nargs="+",
        choices=long_record.WORK,
        default=list(long_record.WORK),
        help="default: all",
        metavar="WHAT",
    )
    verb.add_argument("--scenario", default=long_record.SCENARIO, help="whose rows are repeated (default: %(default)s)")
    verb.add_argument("--folder", type=Path, help="for the files, some GB (default: that of temporary files)")
    return parser


def _add_autopilot(verbs: Any) -> None:
    verb = verbs.add_parser("autopilot", help=(autopilot.__doc__ or "").splitlines()[0])
    verb.add_argument("--ardusub", type=Path, required=True, metavar="FILE", help="ArduSub's program for SITL")
    verb.add_argument("--scenario", nargs="+", default=[], metavar="NAME", help="shipped ones, or random-SEED")
    verb.add_argument("--random", type=int, default=0, metavar="N", help="so many random scenes, from random-SEED on")
    verb.add_argument(
        "--other-set", action="store_true", help="their plant has the other published drag and added mass: other-SEED"
    )
    verb.add_argument("--seed", type=int, default=0, help="of the first random scene (default: %(default)s)")
    verb.add_argument("--steer-by", nargs="+", choices=get_args(SteerBy), default=["sticks"], help="default: sticks")
    verb.add_argument("--sticks-by", choices=get_args(SticksBy), default="manual-control", help="default: %(default)s")
    verb.add_argument(
        "--fault", nargs="+", choices=FAULTS, default=[""], help="what fails after 5 s", metavar="WHAT"
    )  # fmt: skip
    verb.add_argument("--level-dive", type=float, default=Task.level_dive, metavar="M", help="as for cosim companion")
    verb.add_argument("--parameter", nargs="+", default=[], metavar="NAME=VALUE", help="of ArduSub, beside the file's")
    verb.add_argument("--instance", type=int, default=0, help="of ArduSub, for its ports (default: %(default)s)")
    verb.add_argument("--json", type=Path, metavar="FILE", help="of flights; those that it has are not repeated")
    verb.add_argument("--keep", type=Path, metavar="DIR", help="keep each flight's files there")


def _autopilot(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    if not options.ardusub.is_file():
        parser.error(f"--ardusub: {options.ardusub} is no file, expected ArduSub's program for SITL")
    prefix = OTHER if options.other_set else RANDOM
    names = [*options.scenario, *(f"{prefix}{options.seed + i}" for i in range(options.random))]
    tasks = [
        Task(name, by, options.sticks_by, fault, options.level_dive, tuple(options.parameter))
        for name in names
        for by in options.steer_by
        for fault in options.fault
    ]
    try:
        for task in tasks:
            task.load()
    except ScenarioError as error:
        parser.error(str(error))
    make_flights(tasks, options.ardusub, options.instance, options.json, options.keep)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the verb of the command line."""
    parser = _parser()
    options = parser.parse_args(arguments)
    match options.name:
        case "long-record":
            long_record.print_table(options.rows, options.work, options.scenario, options.folder)
        case "fuzzy-accuracy":
            fuzzy_accuracy.print_worst(options.systems, options.seed)
        case "baselines":
            _baselines(parser, options)
        case "nmpc":
            if unknown := set(options.kinds) - set(nmpc_search.FLOWN):
                parser.error(f"kind is {sorted(unknown)[0]!r}, expected one of {', '.join(nmpc_search.FLOWN)}")
            if options.count < 1 or options.draws < 0:
                parser.error("expected 1 or more scenes, and 0 or more draws")
            kinds = options.kinds or nmpc_search.FLOWN
            nmpc_search.main(kinds, options.seed, options.count, options.draws, options.peers_python, options.json)
        case "autopilot":
            _autopilot(parser, options)
        case "calibration":
            calibration.main()
        case "peers":
            for peer, version in peer_environment.install(again=True).items():
                print(f"{peer:24} {version}")
        case "page":
            _page(parser, options.files)
        case _:
            figures = _figures(parser, options)
            if options.json is not None:
                write_json(options.json, figures)


def _figures(parser: argparse.ArgumentParser, options: argparse.Namespace) -> dict[str, Any]:
    """Measure times, print them, and return them as plain values."""
    if options.repeats < 1:
        parser.error("expected 1 or more repeats")
    machine = description(options.repeats)
    if options.name in TABLES:
        chosen = TABLES[options.name]
        if unknown := set(options.subjects) - set(chosen.SUBJECTS):
            parser.error(f"subject is {sorted(unknown)[0]!r}, expected one of {', '.join(chosen.SUBJECTS)}")
        where = {"environment": Environment(options.peers_python)} if chosen is everything else {}
        machine += [f"peers: {environment.summary()}" for environment in where.values()]
        tables = chosen.measure(options.subjects or list(chosen.SUBJECTS), options.budget, options.repeats, **where)
    else:
        chosen = BENCHMARKS[options.name]
        more = {"datagrams": options.datagrams} if chosen is mavlink else {}
        tables = [Table("", tuple(chosen.measure(options.steps, options.repeats, **more)))]
    print_tables(tables, chosen.RATIO, machine)
    return as_json(options.name, tables, chosen.RATIO, machine)


def _page(parser: argparse.ArgumentParser, files: Sequence[Path]) -> None:
    try:
        known = [page.read_figures(file) for file in files]
        figures = known or [_figures(parser, parser.parse_args([name])) for name in TABLES]
        page.PAGE.write_text(page.rewrite(page.PAGE.read_text(encoding="utf-8"), figures), encoding="utf-8")
    except page.PageError as error:
        parser.error(str(error))


def _baselines(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    unknown = set(options.laws) - set(baselines.RANGES)
    if unknown:
        parser.error(f"law is {sorted(unknown)[0]!r}, expected one of {', '.join(baselines.RANGES)}")
    if options.draws < 0 or options.workers < 1:
        parser.error("expected 0 or more draws, and 1 or more workers")
    baselines.main(options.laws or baselines.RANGES, options.draws, options.seed, options.workers)


if __name__ == "__main__":
    main()
