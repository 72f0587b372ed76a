"""``cosim watch``."""

from __future__ import annotations

import argparse
import contextlib
import signal
import sys
from typing import Any

_WIDE = 120  # characters of a line, where there is no terminal


def add_verb(verbs: Any) -> None:
    """Add the verb to the parser.

    Parameters
    ----------
    verbs : argparse subparsers
        Of the command.
    """
    watch = verbs.add_parser("watch", help="show a run in the terminal: live, while it is written, or played back")
    watch.add_argument(
        "run", metavar="RUN|URL",
        help="a run folder, finished or not; or the address of a live view, such as ws://127.0.0.1:8765, or its port",
    )  # fmt: skip
    watch.add_argument(
        "--rate", type=_rate, default=1.0, metavar="N|max",
        help="simulated seconds a second, when a finished run is played back (default: 1)",
    )  # fmt: skip
    watch.add_argument("--once", action="store_true", help="print one picture of the newest there is, and end")


def _rate(text: str) -> float | None:
    if text == "max":
        return None
    with contextlib.suppress(ValueError):
        if 1e-3 <= (value := float(text)) <= 1e6:
            return value
    raise argparse.ArgumentTypeError(f"{text!r}: expected a number from 0.001 to 1e6, or max")


def watch(options: argparse.Namespace) -> int:
    """Run ``cosim watch``."""
    from cosim.errors import TelemetryError

    try:
        from rich.console import Console
        from rich.live import Live
    except ImportError as error:
        raise TelemetryError("cosim watch needs rich; pip install 'subreach[view]'") from error
    from cosim.live.watching import looks, picture

    with contextlib.suppress(ValueError):  # which signal raises outside the main thread
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    terminal = sys.stdout.isatty()
    console = Console(width=None if terminal else _WIDE, highlight=False)
    ascii_only = console.options.ascii_only
    once = options.once or not terminal
    last = None
    try:
        with contextlib.ExitStack() as stack:
            live = None if once else stack.enter_context(Live(console=console, screen=True, auto_refresh=False))
            for look in looks(options.run, options.rate, once):
                last = look
                if live is not None:
                    live.update(picture(look, console.width, console.height, ascii_only), refresh=True)
    finally:
        if last is not None:  # what was seen last stays on the terminal
            console.print(picture(last, console.width, None, ascii_only))
    return 0
