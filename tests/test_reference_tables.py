"""Reference tables of the pages list what the code has."""

import dataclasses
import re
from pathlib import Path
from typing import get_args

import msgspec
import pytest

from controller.regions.shapes import ENTRIES
from cosim.campaigns.ablation import VARIANTS
from cosim.companion.companion_options import SteerBy
from cosim.export.formats import FORMATS
from cosim.logs.column_map import MAPPED
from cosim.mavlink.messages.message_table import message_specs
from cosim.mavlink.vehicle.profile import PROFILES
from cosim.scenario.arbiter_rules import Kind
from cosim.scenario.criteria import Quantity
from cosim.scenario.toml_file import list_scenarios
from fuzzy_arbiter.definition import Normalization
from plant_fmu import load_vehicle
from plant_fmu.autopilot import Autopilot
from plant_fmu.compiling.platforms import PLATFORMS
from plant_fmu.variables.table import variables

DOCS = Path(__file__).parents[1] / "docs"


def rows(page, name, head=False):
    """Return the rows of the table in a block of figures, as lists of cells; `head`: with that of the titles."""
    block = re.search(rf"<!-- figures: {re.escape(name)} -->\n(.*?)<!-- end", (DOCS / page).read_text(), re.S)[1]
    lines = [line[1:-1] for line in block.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)] for line in lines[0 if head else 1 :]]


def test_streamed_messages_are_documented_at_their_rates():
    documented = {}
    for rate, messages in rows("mavlink.md", "rates of cosim/mavlink/messages/message_table.py"):
        for name, own_rate in re.findall(r"\b([A-Z][A-Z0-9_]{3,})(?: (0\.\d))?", messages):
            documented[name] = 0.0 if rate == "on request" else float(own_rate or rate)
    assert documented == {spec.name: spec.rate for spec in message_specs().values()}


def test_keys_of_the_autopilot_table_are_documented_with_their_defaults():
    documented = {}
    for keys, _, defaults, _ in rows("sitl.md", "keys of plant_fmu/autopilot.py"):
        names = re.findall(r"`(\w+)`", keys)
        documented |= dict(zip(names, defaults.replace("`", "").split(", "), strict=True))
    fields = {field.name: field.default for field in msgspec.structs.fields(Autopilot)}
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


def test_modes_and_sticks_of_each_profile_are_documented():
    names, autopilots, _, *modes, sticks = rows("mavlink.md", "profiles of cosim/mavlink/vehicle/profile.py", head=True)
    for column, name in enumerate(names[1:], 1):
        profile = PROFILES[re.findall(r"`(\w+)`", name)[0]]
        assert autopilots[column].split()[-1] == str(profile.autopilot)
        assert sticks[column] == str(profile.centered_stick)
        for number, row in zip(profile.custom_modes.values(), modes, strict=True):
            main, sub = number >> 16 & 0xFF, number >> 24
            expected = ([main, sub] if sub else [main]) if profile.is_packed else [number]
            assert [int(digits) for digits in re.findall(r"\d+", row[column].partition("(")[0])] == expected, row


def test_quantities_of_a_column_map_are_documented():
    tables = rows("howto/logs.md", "quantities of cosim/logs/column_map.py")
    documented = [name for keys, *_ in tables for name in re.findall(r"`(\w+)`", keys)]
    assert sorted(documented) == sorted(MAPPED)


def test_variants_of_an_ablation_are_documented():
    tables = rows("campaigns.md", "variants of cosim/campaigns/ablation.py")
    assert [name for keys, _ in tables for name in re.findall(r"`([\w-]+)`", keys)] == list(VARIANTS)


def test_documented_variables_of_the_fmu_exist():
    names = {re.sub(r"\[\d\]", "[i]", variable.name) for variable in variables(load_vehicle("odin"), coupled=True)}
    for table in ("parameters of the FMU", "inputs of a coupled FMU"):
        for row in rows("fmu.md", table):
            for name in re.findall(r"`(\w[\w.]*(?:\[i\])?)`", " ".join(row)):
                assert name in names or any(other.startswith(f"{name}.") for other in names), name


@pytest.mark.parametrize(
    ("page", "table", "names"),
    [
        ("criteria.md", "reasons of a criterion", get_args(Quantity)),
        ("criteria.md", "inputs of rules", [kind for kind in get_args(Kind) if kind != "given"]),
        ("howto/companion.md", "ways to steer", get_args(SteerBy)),
        ("arbiter.md", "normalizations", get_args(Normalization)),
        ("fmu.md", "platforms", PLATFORMS),
        ("scenarios.md", "shipped scenarios", list_scenarios()),
        ("export.md", "formats of cosim/export", FORMATS),
    ],
)
def test_documented_choices_are_those_of_the_code(page, table, names):
    documented = [name for row in rows(page, table) for name in re.findall(r"`([a-z]\w*(?:-\w+)?)[\w.]*`", row[0])]
    assert sorted(documented) == sorted(names)
