"""One finding of a check."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Topic = Literal["vehicle", "law", "regions", "thrust", "components"]
Status = Literal["holds", "fails", "note"]
Number = float | bool | str | None


@dataclass(frozen=True)
class Finding:
    """A checked condition, its status, and advice on how to fulfil it."""

    topic: Topic
    name: str  # such as "Property 1" or "(38)"
    status: Status  # a note is information, not a failure
    text: str  # result, with numbers
    advice: str = ""  # proposed change, with numbers; empty unless it fails
    numbers: Mapping[str, Number] = field(default_factory=dict)


def status(holds: bool) -> Status:
    """Return the status for a condition that holds or fails."""
    return "holds" if holds else "fails"
