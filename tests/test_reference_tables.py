"""Reference tables of the pages list what the code has."""

import dataclasses
import re
from pathlib import Path

from pymavlink.dialects.v20 import all as dialect

from controller.regions.shapes import ENTRIES
from cosim.mavlink.messages.table import MESSAGES
from plant_fmu.autopilot import Autopilot

DOCS = Path(__file__).parents[1] / "docs"


def rows(page, name):
    """Return the rows of the table in a block of figures, as lists of cells."""
    block = re.search(rf"<!-- figures: {re.escape(name)} -->\n(.*?)<!-- end", (DOCS / page).read_text(), re.S)[1]
    lines = [line[1:-1] for line in block.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)] for line in lines[1:]]


def test_streamed_messages_are_documented_at_their_rates():
    documented = {}
    for rate, messages in rows("mavlink.md", "rates of cosim/mavlink/messages/table.py"):
        for name, own_rate in re.findall(r"\b([A-Z][A-Z0-9_]{3,})(?: (0\.\d))?", messages):
            documented[name] = 0.0 if rate == "on request" else float(own_rate or rate)
    names = {spec.id: dialect.mavlink_map[spec.id].msgname for spec in MESSAGES.values()}
    assert documented == {names[spec.id]: spec.rate for spec in MESSAGES.values()}


def test_keys_of_the_autopilot_table_are_documented_with_their_defaults():
    documented = {}
    for keys, _, defaults, _ in rows("sitl.md", "keys of plant_fmu/autopilot.py"):
        names = re.findall(r"`(\w+)`", keys)
        documented |= dict(zip(names, defaults.replace("`", "").split(", "), strict=True))
    fields = {field.name: field.default for field in dataclasses.fields(Autopilot)}
    fields |= {"frame": "required", "channels": "1 2 3 …"}
    assert documented == {name: str(default) for name, default in fields.items()}


def test_shapes_are_documented_with_their_keys():
    documented = {
        re.findall(r"`(\w+)`", kind)[0]: re.findall(r"`(\w+)`", keys)
        for kind, keys, *_ in rows("scenarios.md", "shapes of controller/regions/shapes")
    }
    assert documented.keys() == ENTRIES.keys()
    for kind, keys in documented.items():
        assert sorted(keys) == sorted(field.name for field in dataclasses.fields(ENTRIES[kind].shape)), kind
