"""One thing that a check has found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Status = Literal["holds", "fails", "note"]
Number = float | bool | str | None


@dataclass(frozen=True)
class Finding:
    """What was looked at, how it stands, and what would mend it."""

    topic: Literal["vehicle", "law", "regions", "thrust"]
    name: str  # such as "Property 1" or "(38)"
    status: Status  # a note is worth knowing, and no fault
    text: str  # what was found, with its figures
    advice: str = ""  # what to change, with figures; empty unless it fails
    numbers: Mapping[str, Number] = field(default_factory=dict)


def status(holds: bool) -> Status:
    """Return the status of what holds or fails."""
    return "holds" if holds else "fails"
