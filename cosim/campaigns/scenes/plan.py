"""Plan of a campaign of scenes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import msgspec

from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.store.plan import SCENES, code_digest, versions


@dataclass(frozen=True)
class Plan:
    """All inputs that determine the rows of a campaign of scenes."""

    law: str
    gains: dict[str, float]
    conditions: Conditions
    scenes: int  # number of scenes
    scenes_sha256: str  # digest of the scenes
    code_sha256: str  # digest of the sources of all packages, so that rows of different code are not mixed
    versions: dict[str, str]  # versions of Python and of libraries

    def table(self) -> dict[str, Any]:
        """Return the plan as a table for JSON."""
        plan: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(self))
        return {"kind": SCENES} | plan


def plan_of(law: str, gains: Any, conditions: Conditions, scenes: int, digest: str) -> Plan:
    """Make the plan of a campaign with the installed code and libraries."""
    return Plan(law, gains._asdict(), conditions, scenes, digest, code_digest(), versions())
