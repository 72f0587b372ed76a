"""The criteria of a scenario in the order of their priority: names, colors and membership functions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import msgspec

from controller.regions.region_set import of_attitude
from cosim.errors import ScenarioError
from cosim.scenario.membership_terms import read_term, term_in_words
from cosim.scenario.region_tables import PAPER_CRITERIA, CriterionEntry, SecondaryRegion
from fuzzy_arbiter.criteria import SECTION_VI, Criterion
from fuzzy_arbiter.propositions import is_identifier
from fuzzy_arbiter.shapes import Membership
from plant_fmu.toml_tables import hint

Quantity = Literal["ramp", "clearance", "angle", "approach_time"]
# arguments of membership functions, and their units
QUANTITIES: dict[str, str] = {"ramp": "m, rad", "clearance": "m", "angle": "rad", "approach_time": "s"}
MAX_CRITERIA = 16
# for criteria without a color: Okabe and Ito's purple, then muted ones of Tol's
_COLORS = ("#CC79A7", "#882255", "#44AA99", "#999933", "#332288", "#88CCEE", "#AA4499", "#117733")
_PAPER = {criterion.name: criterion for criterion in SECTION_VI}


@dataclass(frozen=True)
class Reason:
    """One membership function of a criterion, of a region's distance or its time to contact."""

    quantity: Quantity
    term: Membership | None  # membership function of the quantity; None for a ramp
    ramp: float | None = None  # m or rad, width of a ramp; None for the arbiter's

    def is_of(self, region: SecondaryRegion) -> bool:
        """Return True if this reason applies to a region: clearance if in space, angle if of attitude."""
        other = "clearance" if of_attitude(region.region.shape) else "angle"
        return self.quantity != other

    def words(self, width: float) -> str:
        """Describe the reason in words; `width` is that of the arbiter's ramp [m or rad]."""
        if self.term is None:
            return f"within {width if self.ramp is None else self.ramp:g} m or rad"
        unit = QUANTITIES[self.quantity]
        return f"{self.quantity.replace('_', ' ')}: {term_in_words(self.term, unit)}"


@dataclass(frozen=True)
class CriterionSetup:
    """A checked criterion."""

    name: str
    color: str  # #RRGGBB
    reasons: tuple[Reason, ...]  # membership functions, the greatest of which counts

    @property
    def fuzzy(self) -> Criterion:
        """The criterion as an input of an arbiter, whose value is the membership."""
        return _PAPER.get(self.name) or Criterion(self.name, on="pressing", off="satisfied")


def fill_criteria(entries: tuple[CriterionEntry, ...]) -> tuple[CriterionEntry, ...]:
    """Fill in the defaults of order and color."""
    return tuple(_fill(entry, i, entries) for i, entry in enumerate(entries))


def check_criteria(entries: tuple[CriterionEntry, ...]) -> tuple[CriterionSetup, ...]:
    """Check the criteria; return them by descending priority."""
    if not 1 <= len(entries) <= MAX_CRITERIA:
        raise ScenarioError(f"criteria: got {len(entries)}, expected 1 to {MAX_CRITERIA}")
    setups: dict[int, CriterionSetup] = {}
    for i, entry in enumerate(fill_criteria(entries)):
        key, order = f"criteria[{i}]", entry.order or 0
        if not is_identifier(entry.name):
            raise ScenarioError(f"{key}.name is {entry.name!r}, expected no word of rules")
        if entry.name in (setup.name for setup in setups.values()):
            raise ScenarioError(f"{key}.name is {entry.name!r}, used twice, expected a name of its own")
        if order in setups:
            raise ScenarioError(f"{key}.order is {order}, as that of {setups[order].name}: expected one of its own")
        reasons = tuple(_reasons(entry.membership, f"{key}.membership"))
        setups[order] = CriterionSetup(entry.name, entry.color, reasons)
    return tuple(setups[order] for order in sorted(setups))


def _fill(entry: CriterionEntry, index: int, entries: Sequence[CriterionEntry]) -> CriterionEntry:
    used = {other.color.upper() for other in entries}
    free = [color for color in _COLORS if color not in used] or list(_COLORS)
    of_paper = {c.name: c.color for c in PAPER_CRITERIA if c.color not in used}
    without = sum(not other.color and other.name not in of_paper for other in entries[:index])
    order = index + 1 if entry.order is None else entry.order
    color = entry.color or of_paper.get(entry.name) or free[without % len(free)]
    return msgspec.structs.replace(entry, order=order, color=color)


def _reasons(membership: dict[str, Any], key: str) -> Iterator[Reason]:
    if not membership:
        yield Reason("ramp", None)
    for quantity, value in membership.items():
        where = f"{key}.{quantity}"
        if quantity not in QUANTITIES:
            raise ScenarioError(f"{where}: unknown key; {hint(quantity, QUANTITIES)}")
        if quantity == "ramp":
            number = not isinstance(value, bool) and isinstance(value, int | float)
            if not (number and 0.0 <= value < math.inf):
                raise ScenarioError(f"{where} is {value!r}, expected a width of 0 m or above")
            yield Reason("ramp", None, float(value))
        else:
            yield Reason(quantity, read_term(value, quantity == "approach_time", where))  # type: ignore[arg-type]


def check_criteria_of_regions(regions: Sequence[SecondaryRegion], criteria: Sequence[CriterionSetup]) -> None:
    """Raise `ScenarioError` unless each region has a criterion with a reason that applies to it."""
    known = {criterion.name: criterion for criterion in criteria}
    for i, region in enumerate(regions):
        key, name = f"regions[{i}].criterion", region.criterion
        if name not in known and region.is_dynamic:
            raise ScenarioError(
                f"commands.obstacles is above 0, expected 0 without a criterion {name!r}, which they have"
            )
        if name not in known:
            raise ScenarioError(f"{key} is {name!r}, which is none of criteria; {hint(name, known)}")
        if not any(reason.is_of(region) for reason in known[name].reasons):
            angle = of_attitude(region.region.shape)
            quantity, unit = ("angle", "rad: it is of attitude") if angle else ("clearance", "m: it is in space")
            raise ScenarioError(
                f"criteria.{name}.membership has no {quantity}, expected one, or ramp or approach_time, "
                f"for region {region.region.name!r}, whose clearance is in {unit}"
            )


PAPER = check_criteria(PAPER_CRITERIA)
