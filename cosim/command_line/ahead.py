"""``cosim compile``: once, where a first run must not wait."""

from __future__ import annotations

import argparse
import time
from typing import Any

from cosim.command_line.results import say


def add_verb(verbs: Any) -> None:
    """Add the verb to the command line."""
    verb = verbs.add_parser("compile", help="compile the laws now, so that no first run waits for it")
    verb.add_argument(
        "scenario", nargs="*", help="shipped names, or TOML files: what their runs need (default: every law)"
    )


def compile_all(options: argparse.Namespace) -> int:
    """Compile, and say how long it took."""
    from cosim.command_line.compiling import compile_ahead

    for name, scenario, overrides in [(name, name, []) for name in options.scenario] or _laws():
        started = time.perf_counter()
        compile_ahead(scenario, overrides)
        say(options, f"{name}: {time.perf_counter() - started:.1f} s")
    return 0


def _laws() -> list[tuple[str, str, list[str]]]:
    """Return every law, a scenario, and what brings the law into it; with the paper's law its analysis.

    The one that takes longest comes last: who is in a hurry compiles it beside the others.
    """
    from controller import LAWS

    analysis = {"ismail_dunnigan": ["record.lyapunov=true"]}
    return [
        (name, "paper", [f"law.name={name}", f"actuation.through={law.output}", *analysis.get(name, [])])
        for name, law in sorted(LAWS.items(), key=lambda law: law[0] == "deployable")
    ]
