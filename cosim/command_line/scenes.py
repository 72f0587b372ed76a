"""``cosim scenes``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.numbers import whole
from cosim.errors import ScenarioError

_MAX_COUNT = 10**7  # scenes, whose flights take more than a month


def add_verb(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    scenes = verbs.add_parser("scenes", help="generate random scenes for campaigns, one JSON object a line")
    scenes.add_argument("--count", type=whole(1, _MAX_COUNT), default=100, metavar="N", help="scenes (default: 100)")
    scenes.add_argument(
        "--seed", type=whole(0, 2**63 - 1 - _MAX_COUNT), default=0, metavar="S",
        help="seed of the first scene, which the next ones count up (default: 0); the same seed gives the same scene",
    )  # fmt: skip
    scenes.add_argument(
        "--kind", choices=("plain", "hard", "conflict", "tour", "trial"), default="plain",
        help="hard: more obstacles, drift, a stronger current, noise, a thruster that fails; conflict: regions that "
        "exclude each other, on three vehicles; tour: the same with goals in turn; trial: scenes that each test one "
        "part of a law (default: plain)",
    )  # fmt: skip
    scenes.add_argument("--out", type=Path, metavar="FILE", help="file to write (default: standard output)")


def scenes(options: argparse.Namespace) -> int:
    """Run ``cosim scenes``."""
    from cosim.campaigns.scenes.generator import generate_scenes
    from plant_fmu.archive import atomic_file

    lines = generate_scenes(options.count, options.seed, options.kind)
    if options.out is None:
        for line in lines:
            print(line)
        return 0
    try:
        with atomic_file(options.out) as file:
            for line in lines:
                file.write(f"{line}\n".encode())
    except OSError as error:
        raise ScenarioError(f"{options.out}: {error.strerror or error}") from error
    print(options.out)
    return 0
