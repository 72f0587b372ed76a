"""The flag ``--live`` of the verbs that show what they do in browsers."""

from __future__ import annotations

import argparse
import contextlib
from typing import TYPE_CHECKING

from cosim.command_line.process import tell
from cosim.live.address import HOST, PORT, parse_live

if TYPE_CHECKING:
    from cosim.live.view import LiveView


def add_live_flag(parser: argparse.ArgumentParser, what: str) -> None:
    """Add the flag to a verb, with words for `what` it does."""
    parser.add_argument(
        "--live", nargs="?", const="", metavar="[HOST:]PORT",
        help=f"{what} (default: {HOST}:{PORT}, or another port if that is taken)",
    )  # fmt: skip


def open_live(options: argparse.Namespace, stack: contextlib.ExitStack) -> LiveView | None:
    """Open the page that the flag asks for until the stack ends, and tell where it is; None where it asks for none.

    Raises
    ------
    TelemetryError
        If the address is none, leaves this machine without leave, or cannot be opened.
    """
    if options.live is None:
        return None
    from cosim.live.view import LiveView

    live = stack.enter_context(LiveView(parse_live(options.live, options.allow_remote)))
    tell(f"the run is shown at {live.url}")
    return live
