"""``python -m benchmarks {step,law,fmu,fuzzy}``: microseconds a step and ratios, in a table."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from benchmarks import fmu, fuzzy, law, step
from benchmarks.timing import print_rows

BENCHMARKS = {"step": step, "law": law, "fmu": fmu, "fuzzy": fuzzy}
REPEATS = 5


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark that is named on the command line.

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
    options = parser.parse_args(arguments)
    benchmark = BENCHMARKS[options.name]
    print_rows(benchmark.measure(options.steps, options.repeats), options.repeats, benchmark.RATIO)


if __name__ == "__main__":
    main()
