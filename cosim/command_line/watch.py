"""``cosim watch``."""

from __future__ import annotations

import argparse
import contextlib
import math
import sys
from typing import Any

from cosim.command_line.flags import add_verb, flag, rate

_WIDE = 120  # characters of a line without a terminal


def add_verbs(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    verb = add_verb(
        verbs, "watch", watch, "show a run in the terminal: live, while it is written, or played back", "live",
        ("watch 8765", "watch runs/docking --rate 4", "watch runs/docking --once"),
    )  # fmt: skip
    verb.add_argument(
        "run", metavar="RUN|URL",
        help="a run folder, finished or not; or the address of a live view, such as ws://127.0.0.1:8765, or its port",
    )  # fmt: skip
    flag(verb, "--rate N|max", "simulated seconds per second in the playback of a finished run", rate, 1.0)
    flag(verb, "--once", "print one table of the newest row, and end")


def watch(options: argparse.Namespace) -> int:
    """Run ``cosim watch``."""
    from rich.console import Console
    from rich.live import Live

    from cosim.live.watching import snapshot_table, snapshots

    class Screen(Console):
        def on_broken_pipe(self) -> None:
            raise  # noqa: PLE0704 - called in the handler of that error; rich would exit with status 1

    terminal = sys.stdout.isatty()
    console = Screen(width=None if terminal else _WIDE, highlight=False)
    once, last = options.once or not terminal, None
    try:
        with contextlib.ExitStack() as stack:
            live = None if once else stack.enter_context(Live(console=console, screen=True, auto_refresh=False))
            for last in snapshots(options.run, None if options.rate == math.inf else options.rate, once):
                if live is not None:
                    live.update(snapshot_table(last), refresh=True)
    finally:
        if last is not None:  # the last table stays on the terminal
            console.print(snapshot_table(last))
    return 0
