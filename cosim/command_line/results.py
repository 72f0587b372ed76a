"""Output of a command about its results: texts, which ``--quiet`` suppresses, and paths."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cosim.results.run_result import Run


def say(options: argparse.Namespace, *lines: str) -> None:
    """Print lines unless ``--quiet`` is given."""
    if not options.quiet:
        for line in lines:
            print(line, flush=True)


def print_run(options: argparse.Namespace, run: Run, report: bool = True) -> None:
    """Print the outcome of a run, and the paths of its report and replay."""
    from cosim.results.wording import verdict

    say(options, verdict(run.summary))
    for path in ("report", "replay") if report else ("summary",):
        print(run.files()[path])
