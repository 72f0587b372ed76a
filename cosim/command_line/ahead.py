"""``cosim compile``: once, where a first run must not wait."""

from __future__ import annotations

import argparse
import time
from typing import Any


def add_verb(verbs: Any) -> None:
    """Add the verb to the command line."""
    verb = verbs.add_parser("compile", help="compile the laws now, so that no first run waits for it")
    verb.add_argument(
        "scenario", nargs="*", help="shipped names, or TOML files: what their runs need (default: every law)"
    )


def compile_all(options: argparse.Namespace) -> int:
    """Compile, and say how long it took."""
    from controller import LAWS
    from cosim.flying.ahead import compile_ahead

    work: list[tuple[str, str, list[str]]] = [(name, name, []) for name in options.scenario] or [
        (law, "paper", [f"law.name={law}", f"actuation.through={LAWS[law].output}"]) for law in LAWS
    ]
    for name, scenario, overrides in work:
        started = time.perf_counter()
        compile_ahead(scenario, overrides)
        print(f"{name}: {time.perf_counter() - started:.1f} s", flush=True)
    return 0
