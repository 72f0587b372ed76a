"""What every row of a campaign of scenes rests on."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.store.plan import SCENES, code_digest, versions


@dataclass(frozen=True)
class Plan:
    """What every row of a campaign of scenes rests on."""

    law: str
    gains: dict[str, float]
    conditions: Conditions
    scenes: int
    scenes_sha256: str
    code_sha256: str  # of the sources of all packages: rows of different code are not mixed
    versions: dict[str, str]

    def table(self) -> dict[str, Any]:
        """Return it as a table for JSON."""
        outages = [asdict(outage) for outage in self.conditions.outages]  # a list, as JSON reads them
        return {"kind": SCENES} | asdict(self) | {"conditions": asdict(self.conditions) | {"outages": outages}}


def plan_of(law: str, gains: Any, conditions: Conditions, scenes: int, digest: str) -> Plan:
    """Return the plan of a campaign with the code and the libraries that are here.

    Parameters
    ----------
    law : str
        One of those in `controller.LAWS`.
    gains : NamedTuple
        Of the law.
    conditions : Conditions
        How scenes are flown.
    scenes : int
        How many.
    digest : str
        Of the scenes.

    Returns
    -------
    Plan
        Any two that are equal give the same rows on the same machine.
    """
    return Plan(law, gains._asdict(), conditions, scenes, digest, code_digest(), versions())
