"""``cosim replay``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def add_verb(verbs: Any) -> None:
    """Add the verb to the parser.

    Parameters
    ----------
    verbs : argparse subparsers
        Of the command.
    """
    replay = verbs.add_parser("replay", help="write the page in which one or several runs can be seen again")
    replay.add_argument("folders", type=Path, nargs="+", metavar="RUN", help="a run folder, also of a killed run")
    replay.add_argument(
        "--out", type=Path, metavar="FILE",
        help="file to write (default: replay.html, in the folder of a single run, or here for several)",
    )  # fmt: skip
    replay.add_argument("--title", help="of the page (default: the scenario's)")


def replay(options: argparse.Namespace) -> int:
    """Run ``cosim replay``."""
    from cosim.replay.pages import replay as write

    print(write(options.folders, options.out, options.title))
    return 0
