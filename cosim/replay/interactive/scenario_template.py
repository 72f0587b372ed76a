"""The scenario of a page as TOML with gaps for the page's numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence

from cosim.replay.interactive.adjustable import Slot
from cosim.results.file_copies import VEHICLE_COPY
from cosim.scenario.changes import with_values
from cosim.scenario.scenario import Scenario
from cosim.scenario.toml_text import scenario_text

_MARK = 730000000.5  # first of a row of placeholders for the page's numbers, of equal length as text
_TITLE = "title-of-what-if"


def scenario_template(scenario: Scenario, slots: Sequence[Slot]) -> dict[str, list[str]]:
    """Return the parts of a scenario's file, and the keys of the values between them: ``title``, and some numbers."""
    # Failures can be added at its end.
    marks = {repr(_MARK + i): slot.key for i, slot in enumerate(slots)}
    table = with_values(scenario.table, {key: float(mark) for mark, key in marks.items()})
    if not table["failures"]:
        del table["failures"]
    if scenario.vehicle_file:
        table["vehicle"] = VEHICLE_COPY
    table["title"] = _TITLE
    marks[f'"{_TITLE}"'] = "title"
    parts = re.split(f"({'|'.join(map(re.escape, marks))})", scenario_text(table, {}))
    return {"parts": parts[::2], "keys": [marks[mark] for mark in parts[1::2]]}
