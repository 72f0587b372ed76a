"""``cosim scenes``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.flags import add_verb, flag, int_range
from cosim.errors import ScenarioError

_MAX_COUNT = 10**7  # scenes, whose flights take more than a month


def add_verbs(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    verb = add_verb(
        verbs, "scenes", scenes, "generate random scenes for campaigns, one JSON object a line", "campaigns",
        ("scenes --count 200 --seed 0 --out scenes.jsonl", "scenes --kind hard --vehicle bluerov2 --count 3"),
    )  # fmt: skip
    flag(verb, "--count N", "scenes", int_range(1, _MAX_COUNT), 100)
    flag(
        verb,
        "--seed S",
        "seed of the first scene; each further one counts up by 1",
        int_range(0, 2**63 - 1 - _MAX_COUNT),
        0,
    )
    flag(
        verb, "--kind", "hard: more obstacles, drift, a stronger current, noise, a thruster that fails; conflict: "
        "regions that exclude each other, on three vehicles; tour: the same with goals in turn; trial: scenes that "
        "each test one part of a law; mismatch: the plant is not the vehicle of the file", default="plain",
        choices=("plain", "hard", "conflict", "tour", "trial", "mismatch"),
    )  # fmt: skip
    flag(verb, "--vehicle VEHICLE", "vehicle of plain and hard scenes, a shipped name or a TOML file (default: odin)")
    flag(verb, "--out FILE", "file to write (default: standard output)", Path)


def scenes(options: argparse.Namespace) -> int:
    """Run ``cosim scenes``."""
    from cosim.campaigns.scenes.generator import generate_scenes
    from plant_fmu.archive import atomic_file

    lines = generate_scenes(options.count, options.seed, options.kind, options.vehicle)
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
