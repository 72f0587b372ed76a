"""Mutate signs one at a time, run the tests, and report surviving mutants."""

from __future__ import annotations

import argparse
import fnmatch
import sys
from pathlib import Path

from tests.mutation.plan import all_mutants, equivalent
from tests.mutation.report import report
from tests.mutation.running import results_of, sample


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    parser.add_argument("--sample", type=int, metavar="N", help="of all mutants only N, drawn at random")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn (1)")
    parser.add_argument("--only", metavar="PATTERN", default="*", help="only of sources like controller/regions/*")
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time (2)")
    parser.add_argument("--results", type=Path, metavar="FILE", help="JSON lines: read if there, and continued")
    parser.add_argument("--again", action="store_true", help="ask the tests again about what survived in FILE")
    parser.add_argument("--list", action="store_true", help="only name the mutants")
    arguments = parser.parse_args()

    listed = equivalent()
    mutants = [mutant for mutant in all_mutants() if fnmatch.fnmatch(mutant.path, arguments.only)]
    if arguments.sample is not None:
        mutants = sample(mutants, arguments.sample, arguments.seed)
    if arguments.list:
        print("\n".join(mutant.key for mutant in mutants))
        return 0
    asked = [mutant for mutant in mutants if mutant.key not in listed]
    results = results_of(asked, arguments.jobs, arguments.results, again=arguments.again)
    print(report(mutants, listed, results))
    return int(any(result.survived or result.doubtful for result in results.values()))


if __name__ == "__main__":
    sys.exit(main())
