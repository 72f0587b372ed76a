"""``python -m benchmarks VERB``: times and ratios in a table, the search for the gains of baselines, and its scenes."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from benchmarks import baselines, fmu, fuzzy, law, mavlink, scenes, sitl, step
from benchmarks.timing import print_rows

BENCHMARKS = {"step": step, "law": law, "fmu": fmu, "fuzzy": fuzzy, "mavlink": mavlink, "sitl": sitl}
REPEATS = 5


def main(arguments: Sequence[str] | None = None) -> None:
    """Run what is named on the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: those of the process.
    """
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    verbs = parser.add_subparsers(dest="name", required=True)
    for name, benchmark in BENCHMARKS.items():
        verb = verbs.add_parser(name, help=(benchmark.__doc__ or "").splitlines()[0])
        verb.add_argument("--steps", type=int, default=benchmark.STEPS, help="a repeat (default: %(default)s)")
        verb.add_argument("--repeats", type=int, default=REPEATS, help="default: %(default)s")
        if benchmark is mavlink:
            verb.add_argument("--datagrams", type=int, help="hostile ones a flood (default: ten a step)")
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
    verb = verbs.add_parser("scenes", help=(scenes.__doc__ or "").splitlines()[0])
    verb.add_argument("first", type=int, help="seed")
    verb.add_argument("count", type=int, help="of seeds")
    verb.add_argument("--hard", action="store_true")
    options = parser.parse_args(arguments)
    if options.name == "scenes":
        scenes.print_scenes(options.first, options.count, options.hard)
    elif options.name == "baselines":
        unknown = set(options.laws) - set(baselines.RANGES)
        if unknown:
            parser.error(f"law is {sorted(unknown)[0]!r}, expected one of {', '.join(baselines.RANGES)}")
        if options.draws < 0 or options.workers < 1:
            parser.error("expected 0 or more draws, and 1 or more workers")
        baselines.main(options.laws or baselines.RANGES, options.draws, options.seed, options.workers)
    else:
        benchmark = BENCHMARKS[options.name]
        more = {"datagrams": options.datagrams} if benchmark is mavlink else {}
        print_rows(benchmark.measure(options.steps, options.repeats, **more), options.repeats, benchmark.RATIO)


if __name__ == "__main__":
    main()
