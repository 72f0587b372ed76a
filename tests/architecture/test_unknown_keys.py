"""Unknown keys are rejected by name in every table of every handwritten or received file."""

import copy
import json
import re
import tomllib
from functools import cache

import pytest
import tomli_w

from controller import LAWS
from controller.regions.region_set import SHAPES
from cosim.campaigns.scenes.law_gains import gains_from
from cosim.campaigns.scenes.scene_file import read_scenes
from cosim.errors import CosimError, RunError, ScenarioError
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands.sources import read_log
from fuzzy_arbiter import ArbiterError
from fuzzy_arbiter.formats import reads
from plant_fmu import PlantFmuError, load_vehicle, shipped_vehicles
from tests.architecture.modules import ROOT

LIKE_NONE = "brandnew"

ITEM = {"position": [1.0, 2.0, 3.0], "commands": [{"command": "set_heading", "heading": 1.0}]}
COMMANDS_LOG = [
    {"command": "arm", "armed": True},
    {"command": "set_mode", "mode": "hold"},
    {"command": "set_target", "position": [1.0, 2.0, 3.0]},
    {"command": "set_heading", "heading": 1.0},
    {"command": "manual_control", "wrench": [0.0] * 6},
    {"command": "add_obstacle", "number": 1, "position": [1.0, 2.0, 3.0], "radius": 1.0},
    {"command": "remove_obstacle", "number": 1},
    {"command": "shift_region", "region": "SR1", "by": [1.0, 2.0, 3.0]},
    {"command": "change_setting", "key": "a.b", "value": 1.0},
    {"command": "set_mission", "items": [ITEM]},
    {"command": "set_current_item", "item": 0},
    {"command": "reset"},
]
CRITERIA = {"criteria": [{"name": "a", "off": "below 1"}, {"name": "b"}]}


# ---- the formats: an example of each kind, and how it is read --------------------------------------------------------


def scenario(table, folder):
    path = folder / "scenario.toml"
    path.write_text(tomli_w.dumps(table))
    return load_scenario(str(path))


def vehicle(table, folder):
    path = folder / "vehicle.toml"
    path.write_text(tomli_w.dumps(table))
    return load_vehicle(path)


def scenes(table, folder):
    path = folder / "scenes.jsonl"
    path.write_text(json.dumps(table))
    return list(read_scenes(path))


def commands(table, folder):
    path = folder / "commands.jsonl"
    path.write_text(json.dumps(table) + "\n")
    return read_log(path)


def arbiter_toml(table, _):
    return reads(tomli_w.dumps(table), "toml")


def arbiter_json(table, _):
    return reads(json.dumps(table), "json")


@cache
def examples():
    """Files that are good, each with what reads it."""
    tipping = tomllib.loads((ROOT / "tests" / "data" / "fuzzy" / "tipping.toml").read_text())
    scene = json.loads((ROOT / "tests" / "data" / "scenes" / "hard.jsonl").read_text().splitlines()[0])
    scene |= {"noise": {"position": 0.1}, "failed_thruster": {"index": 1, "time": 2.0}}
    scenarios = ("paper", "docking", str(ROOT / "tests" / "cosim" / "ssp" / "all-shapes.toml"))
    found = [(scenario, tomllib.loads(load_scenario(name).toml())) for name in scenarios]
    found[1][1]["failures"] = [{"thruster": 1, "time": 3.0}]
    found += [
        (vehicle, tomllib.loads((ROOT / f"plant_fmu/vehicles/{name}.toml").read_text())) for name in shipped_vehicles()
    ]
    found += [(read, table) for read in (arbiter_toml, arbiter_json) for table in (tipping, CRITERIA)]
    return found + [(scenes, scene)] + [(commands, {"step": 1, "command": order}) for order in COMMANDS_LOG]


# tables whose keys are names that the file itself gives
FREE = re.compile(r"(inputs|outputs)\.terms|criteria\.terms")


def tables(value, path=()):
    """The path to every table within one."""
    if isinstance(value, dict):
        yield path
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from tables(inner, (*path, key))


def at(table, path):
    for key in path:
        table = table[key]
    return table


def kind_of(table, path):
    """Its path without numbers, and its type where it has one: one of a kind is enough."""
    inner = at(table, path)
    named = [inner[key] for key in ("type", "command") if isinstance(inner.get(key), str)]
    return ".".join([*(key for key in path if isinstance(key, str)), *named])


def cases():
    seen = set()
    for read, table in examples():
        for path in tables(table):
            kind = (read.__name__, kind_of(table, path), table.get("law", {}).get("name") if "gains" in path else None)
            if kind not in seen and not FREE.fullmatch(kind[1]):
                seen.add(kind)
                yield pytest.param(read, table, path, id="-".join(filter(None, kind)))


@pytest.mark.medium(fast=18)
@pytest.mark.parametrize(("read", "table", "path"), list(cases()))
def test_unknown_keys_are_rejected_by_name(read, table, path, tmp_path):
    inner = at(table, path)
    near = [key + key[-1] for key in inner][:1]
    for key in [LIKE_NONE, *near]:
        changed = copy.deepcopy(table)
        at(changed, path)[key] = 1.0
        with pytest.raises((CosimError, PlantFmuError, ArbiterError)) as caught:
            read(changed, tmp_path)
        said = str(caught.value)
        assert re.search(rf"\b{key}\b", said)
        assert "\n" not in said


@pytest.mark.parametrize("read", list(dict.fromkeys(read for read, _ in examples())), ids=lambda read: read.__name__)
def test_example_tables_are_valid(read, tmp_path):
    for reader, table in examples():
        if reader is read:
            reader(table, tmp_path)


def test_every_shape_has_an_example():
    assert {f"regions.shape.{name}" for name in SHAPES} <= {
        kind_of(table, path) for read, table in examples() if read is scenario for path in tables(table)
    }


def test_unknown_gains_are_rejected_for_every_law():
    for law in LAWS:
        with pytest.raises(RunError, match=LIKE_NONE):
            gains_from(law, [f"{LIKE_NONE}=1"])


@pytest.mark.parametrize("table", ["", "time.", "law.gains.", "arbiter.", "plant.", "plant.parameters.", "goal."])
def test_unknown_override_keys_are_rejected_by_name(table):
    with pytest.raises((ScenarioError, PlantFmuError), match=rf"\b{table}{LIKE_NONE}\b"):
        load_scenario("paper", [f"{table}{LIKE_NONE}=1"])
