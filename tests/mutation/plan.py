"""The mutated sources, the tests for each, and the equivalent mutants."""

from __future__ import annotations

import functools
import tomllib
from dataclasses import dataclass
from pathlib import Path

from tests.mutation.mutants import Mutant, mutants_of

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent


@dataclass(frozen=True)
class Part:
    """Sources, and the tests that are to notice what is changed in them."""

    sources: tuple[str, ...]  # patterns from the root of the project
    tests: tuple[str, ...]  # files from the root of the project; in this order
    without: tuple[str, ...]  # tests in whose names these stand are not asked
    slow: bool  # whether those marked slow are


@functools.cache
def parts() -> list[Part]:
    """Return the parts that `plan.toml` names."""
    with (HERE / "plan.toml").open("rb") as file:
        return [
            Part(
                tuple(part["sources"]),
                tuple(f"tests/{file}" for file in part["tests"]),
                tuple(part.get("without", ())),
                part.get("slow", False),
            )
            for part in tomllib.load(file)["part"]
        ]


def part_of(path: str) -> Part:
    """Return the first part that names a source."""
    for part in parts():
        if any(path in _files(pattern) for pattern in part.sources):
            return part
    raise ValueError(f"{path}: no part of plan.toml names it")


def all_mutants() -> list[Mutant]:
    """Return every mutant of every source of the plan, ordered by path and place."""
    paths = sorted({path for part in parts() for pattern in part.sources for path in _files(pattern)})
    return [mutant for path in paths for mutant in mutants_of(path, (ROOT / path).read_text(encoding="utf-8"))]


def equivalent() -> dict[str, str]:
    """Return why a mutant changes nothing that a test could see, by the key of each that `equivalent.toml` names.

    Raises
    ------
    ValueError
        If there is no such mutant, or it is named twice.
    """
    with (HERE / "equivalent.toml").open("rb") as file:
        groups = tomllib.load(file).get("group", [])
    named = [(key, group["reason"]) for group in groups for key in group["mutants"]]
    existing = {mutant.key for mutant in all_mutants()}
    for i, (key, _) in enumerate(named):
        if key not in existing:
            raise ValueError(f"equivalent.toml: there is no mutant {key!r}")
        if key in dict(named[:i]):
            raise ValueError(f"equivalent.toml: {key!r} stands there twice")
    return dict(named)


@functools.cache
def _files(pattern: str) -> list[str]:
    return [path.relative_to(ROOT).as_posix() for path in ROOT.glob(pattern)]
