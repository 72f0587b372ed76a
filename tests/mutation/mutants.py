"""Mutants: each arithmetic sign of the sources in ``plan.toml``, changed one at a time."""

from __future__ import annotations

import functools
import re
import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
OTHER = {"+": "-", "-": "+", "+=": "-=", "-=": "+="}
_STRINGS = r"\"(?:\\.|[^\"\\])*\"|'(?:\\.|[^'\\])*'"
_IGNORED = {
    ".py": rf"#[^\n]*|\"\"\".*?\"\"\"|{_STRINGS}|->",
    ".c": rf"/\*.*?\*/|//[^\n]*|#\s*(?:include|if|ifdef|ifndef|endif)[^\n]*|{_STRINGS}|\+\+|--|->",
}
_IGNORED[".h"] = _IGNORED[".c"]
_NUMBER_OR_NAME = r"\.?\d(?:[eEpP][+-]|[\w.])*|[^\W\d]\w*"


@dataclass(frozen=True)
class Mutant:
    """A source in which one sign is another."""

    path: str  # from the root of the project, with slashes
    text: str  # the line, stripped
    ordinal: int  # from 1, among the signs of such lines of the file
    line: int  # from 1
    offset: int  # characters from the beginning of the source
    before: str

    @property
    def key(self) -> str:
        """The mutant's name, which outlives changes elsewhere in the file."""
        return f"{self.path} | {self.text} | {self.ordinal}"

    def apply(self, source: str) -> str:
        """Replace the sign in the source."""
        return source[: self.offset] + OTHER[self.before] + source[self.offset + len(self.before) :]


def find_mutants(path: str, source: str) -> list[Mutant]:
    """Find the signs of a source in Python or C, in their order."""
    pattern = rf"{_IGNORED[Path(path).suffix]}|{_NUMBER_OR_NAME}|(?P<sign>[+-]=?)"
    lines, count, mutants = source.splitlines(), Counter[str](), []
    for match in re.finditer(pattern, source, re.DOTALL):
        if match["sign"]:
            line = source.count("\n", 0, match.start()) + 1
            text = lines[line - 1].strip()
            count[text] += 1
            mutants.append(Mutant(path, text, count[text], line, match.start(), match["sign"]))
    return mutants


@dataclass(frozen=True)
class Part:
    """Sources, and the tests that must notice what is changed in them."""

    sources: list[str]  # patterns from the root of the project
    tests: list[str]  # files below tests/, in the order in which they run
    without: list[str]  # tests in whose names these stand are left out


@functools.cache
def load_plan() -> dict[str, Part]:
    """Load ``plan.toml``: of each source the first part that names it."""
    plan: dict[str, Part] = {}
    for table in tomllib.loads((HERE / "plan.toml").read_text(encoding="utf-8"))["part"]:
        part = Part(table["sources"], table["tests"], table.get("without", []))
        for path in (path for pattern in part.sources for path in ROOT.glob(pattern)):
            plan.setdefault(path.relative_to(ROOT).as_posix(), part)
    return plan


def all_mutants() -> list[Mutant]:
    """Find the mutants of all sources of the plan, ordered by path and line."""
    return [m for path in sorted(load_plan()) for m in find_mutants(path, (ROOT / path).read_text(encoding="utf-8"))]


def equivalent_mutants() -> dict[str, str]:
    """Load why a mutant changes nothing that a test could see, by the key of each that `equivalent.toml` names."""
    groups = tomllib.loads((HERE / "equivalent.toml").read_text(encoding="utf-8"))["group"]
    return {key: group["reason"] for group in groups for key in group["mutants"]}
