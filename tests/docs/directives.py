"""What HTML comments above a block say of it; a reader of the page does not see them.

The same for a page that is to be free of them stands in ``beside/PAGE.toml``, by how a block begins.

==========================================  =======================================================================
``not run: REASON``                         of a block, or with ``"PREFIX"`` after ``run`` of the lines that begin so
``run with: ARGUMENTS``                     appended to its commands, or with ``"PREFIX"`` to those that begin so
``exits: STATUS``                           of its commands, or with ``"PREFIX"`` of those that begin so; otherwise 0
``given: PATH as NAME``                     a file of the repository is copied into the folder before
``file: NAME``                              the block is written into the folder
``setup sh`` or ``setup python``, lines     done before the block, or with a ``"PREFIX"`` before the first command so
``scenario``, ``vehicle``, ``arbiter``      what a block of TOML is; a scenario with ``onto: NAME`` has it as its base
``column map``                              likewise, of the columns of a log
``scenes``                                  of a block of JSON: each line is a scene of a campaign
``commands of: SCENARIO``                     of a block of JSON: each line is a command that a run of it takes
``alone``                                   the block of Python runs in a process of its own, with names of its own
``slow``                                    the page runs with --slow alone
==========================================  =======================================================================
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Self

REASONS = ("needs ", "takes ", "changes ", "formula", "drawing", "template ", "excerpt ")
_PREFIXED = re.compile(r'(run with|not run|exits)(?: "([^"]+)")?: (\S.*)')
_GIVEN = re.compile(r"given: (\S+) as (\S+)")
_NAMED = re.compile(r"(file|commands of): (\S.*)")
_KIND = re.compile(r"(scenario|vehicle|arbiter|column map|scenes)(?: onto: (\S+))?")
_SETUP = re.compile(r'setup (sh|python)(?: "([^"]+)")?\n(.*)', re.S)
_WORDS = re.compile(
    r"(run with|not run|exits|given|file:|setup|scenario|vehicle|arbiter|column map|scenes|commands of"
    r"|alone|slow)\b"
)


class PageError(AssertionError):
    """A page is incorrect, or cannot be checked by the runner."""


@dataclass
class Directives:
    """The directives of a block; pairs begin with a prefix, "" for all commands."""

    not_run: list[tuple[str, str]] = field(default_factory=list)
    run_with: list[tuple[str, str]] = field(default_factory=list)
    exits: list[tuple[str, str]] = field(default_factory=list)
    given: list[tuple[str, str]] = field(default_factory=list)
    setups: list[tuple[str, str, str]] = field(default_factory=list)
    kind: str = ""
    onto: str = ""
    file: str = ""
    commands_of: str = ""
    alone: bool = False
    slow: bool = False

    @classmethod
    def read(cls, where: str, comments: Iterable[str]) -> Self:
        """Parse directives from comments; an unknown form is a PageError."""
        found = cls()
        for text in comments:
            found._add(where, text)
        return found

    @property
    def skipped(self) -> str:
        """Why the whole block is not run; empty if it is."""
        return next((reason for prefix, reason in self.not_run if not prefix), "")

    def _add(self, where: str, text: str) -> None:
        if match := _PREFIXED.fullmatch(text):
            verb, prefix, value = match[1], match[2] or "", match[3]
            if verb == "not run" and not value.startswith(REASONS):
                raise PageError(f"{where}: not run for an unknown reason {value!r}, expected one of {REASONS}")
            if verb == "exits" and not value.isdigit():
                raise PageError(f"{where}: exits {value!r}, expected a number")
            {"not run": self.not_run, "exits": self.exits}.get(verb, self.run_with).append((prefix, value))
        elif match := _GIVEN.fullmatch(text):
            self.given.append((match[1], match[2]))
        elif match := _NAMED.fullmatch(text):
            setattr(self, match[1].replace(" ", "_"), match[2])
        elif match := _KIND.fullmatch(text):
            self.kind, self.onto = match[1], match[2] or ""
        elif match := _SETUP.fullmatch(text):
            self.setups.append((match[2] or "", match[1], match[3]))
        elif text in ("slow", "alone"):
            setattr(self, text, True)
        else:
            raise PageError(f"{where}: unknown directive {text.splitlines()[0] if text else ''!r}")


def looks_like_one(text: str) -> bool:
    """Return whether a comment begins as a directive does."""
    return _WORDS.match(text) is not None


def of_command(pairs: Iterable[tuple[str, str]], words: list[str]) -> list[str]:
    """Return the values whose prefix, word by word, begins the command."""
    return [value for prefix, value in pairs if words[: len(prefix.split())] == prefix.split()]
