"""The columns that a record must have for its scenario."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from cosim.errors import RunError
from cosim.results.record import Record
from cosim.scenario.scenario import Scenario
from cosim.simulation.columns import column_names

log = logging.getLogger(__name__)

_OPTIONAL = ("law.", "sensed.", "water_velocity.")  # prefixes of columns that are only exported
REGION_COLUMNS = (".clearance", ".shift.x", ".shift.y", ".shift.z")  # suffixes of the required columns of a region
_NAMED = 3  # maximum number of columns named in a message


def require_columns(scenario: Scenario, record: Record) -> None:
    """Raise a RunError if a record lacks columns of its scenario; log a warning if it lacks optional ones."""
    expected, present = column_names(scenario), list(record.units)
    missing = [name for name in expected if name not in record.units]
    required = [name for name in missing if not _is_optional(name)]
    if required:
        raise RunError(f"{record.file}: has no {_list_names(required)}, which its scenario calls for")
    # code that reads neighboring columns, or the first one, relies on the order
    here = [present[0], *(name for name in present if name in expected)]
    there = [expected[0], *(name for name in expected if name in record.units)]
    odd = next((name for name, other in zip(here, there, strict=True) if name != other), None)
    if odd is not None:
        raise RunError(f"{record.file}: column {odd!r} stands elsewhere, expected the order that its scenario has")
    if missing:
        log.warning("%s: has no %s: reports, pages and exports leave them out", record.file, _list_names(missing))


def _is_optional(name: str) -> bool:
    return name.endswith(".value") or (name.startswith(_OPTIONAL) and not name.endswith(REGION_COLUMNS))


def _list_names(names: Sequence[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"column{'s' * (len(names) > 1)} {', '.join(map(repr, names[:_NAMED]))}{more}"
