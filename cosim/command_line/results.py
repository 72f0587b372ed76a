"""What a command prints of what it has done: words, which ``--quiet`` leaves out, and paths."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cosim.results.run_result import Run


def say(options: argparse.Namespace, *lines: str) -> None:
    """Print words on what happened, unless the user wants none."""
    if not options.quiet:
        for line in lines:
            print(line, flush=True)


def print_run(options: argparse.Namespace, run: Run, report: bool = True) -> None:
    """Print what a run came to, and where to look.

    Parameters
    ----------
    options : argparse.Namespace
        Of the verb.
    run : Run
        Done or interrupted.
    report : bool
        Whether it has a report and a replay.
    """
    from cosim.results.wording import verdict

    say(options, verdict(run.summary))
    for path in ("report", "replay") if report else ("summary",):
        print(run.files()[path])
