"""Unknown keys are rejected by name in every table of every handwritten or received file."""

import copy
import json
import re
import tomllib
from functools import cache, reduce
from operator import getitem

import msgspec
import pytest
import tomli_w

from controller import LAWS
from controller.regions.region_set import SHAPES
from controller.regions.shapes import ENTRIES
from cosim.campaigns.scenes.law_gains import gains_from
from cosim.campaigns.scenes.scene_file import read_scenes
from cosim.errors import CosimError, RunError, ScenarioError
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands.sources import read_log
from fuzzy_arbiter import ArbiterError
from fuzzy_arbiter.formats import load
from plant_fmu import PlantFmuError, load_vehicle
from plant_fmu.vehicle import shipped_vehicles
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
READERS = {  # how a table is written, and what reads it
    "scenario": (tomli_w.dumps, "toml", load_scenario),
    "vehicle": (tomli_w.dumps, "toml", load_vehicle),
    "scenes": (json.dumps, "jsonl", lambda path: list(read_scenes(path))),
    "commands": (lambda table: json.dumps(table) + "\n", "jsonl", read_log),
    "arbiter in TOML": (tomli_w.dumps, "toml", load),
    "arbiter in JSON": (json.dumps, "json", load),
}
# tables whose keys are names that the file itself gives
FREE = re.compile(r"(inputs|outputs)\.terms|criteria\.terms")


def read(kind, table, folder):
    write, suffix, reader = READERS[kind]
    path = folder / f"it.{suffix}"
    path.write_text(write(table))
    return reader(path)


@cache
def examples():
    """Valid tables, each with the kind of its file."""
    tipping = tomllib.loads((ROOT / "tests" / "data" / "fuzzy" / "tipping.toml").read_text())
    scene = json.loads((ROOT / "tests" / "data" / "scenes" / "hard.jsonl").read_text().splitlines()[0])
    scene |= {"noise": {"position": 0.1}, "failed_thruster": {"index": 1, "time": 2.0}}
    scenarios = ("paper", "docking", str(ROOT / "tests" / "cosim" / "ssp" / "all-shapes.toml"))
    valid = [("scenario", tomllib.loads(load_scenario(name).toml())) for name in scenarios]
    from_files = [msgspec.to_builtins({"type": name} | vars(ENTRIES[name].example)) for name in ("mesh", "points")]
    region = {"criterion": "obstacle", "keep": "out", "gain": 1.0}
    valid[1][1]["regions"] += [region | {"name": shape["type"], "shape": shape} for shape in from_files]
    valid[1][1]["failures"] = [{"thruster": 1, "time": 3.0}]
    vehicles = [(ROOT / f"plant_fmu/vehicles/{name}.toml").read_text() for name in shipped_vehicles()]
    valid += [("vehicle", tomllib.loads(text)) for text in vehicles]
    valid += [(kind, table) for kind in list(READERS)[-2:] for table in (tipping, CRITERIA)]
    return valid + [("scenes", scene)] + [("commands", {"step": 1, "command": order}) for order in COMMANDS_LOG]


def tables(value, path=()):
    """The path to every table within one."""
    if isinstance(value, dict):
        yield path
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from tables(inner, (*path, key))


def kind_of(table, path):
    """Its path without numbers, and its type where it has one: one of a kind is enough."""
    inner = reduce(getitem, path, table)
    named = [inner[key] for key in ("type", "command") if isinstance(inner.get(key), str)]
    return ".".join([*(key for key in path if isinstance(key, str)), *named])


def cases():
    seen = set()
    for file, table in examples():
        for path in tables(table):
            kind = (file, kind_of(table, path), table.get("law", {}).get("name") if "gains" in path else None)
            if kind not in seen and not FREE.fullmatch(kind[1]):
                seen.add(kind)
                yield pytest.param(file, table, path, id="-".join(filter(None, kind)))


@pytest.mark.medium(fast=18)
@pytest.mark.parametrize(("file", "table", "path"), list(cases()))
def test_unknown_keys_are_rejected_by_name(file, table, path, tmp_path):
    near = [key + key[-1] for key in reduce(getitem, path, table)][:1]
    for key in [LIKE_NONE, *near]:
        changed = copy.deepcopy(table)
        reduce(getitem, path, changed)[key] = 1.0
        with pytest.raises((CosimError, PlantFmuError, ArbiterError)) as caught:
            read(file, changed, tmp_path)
        assert re.search(rf"\b{key}\b", str(caught.value)) and "\n" not in str(caught.value)


@pytest.mark.parametrize("file", READERS)
def test_example_tables_are_valid(file, tmp_path):
    tables = [table for kind, table in examples() if kind == file]
    assert tables
    for table in tables:
        read(file, table, tmp_path)


def test_every_shape_has_an_example():
    kinds = {kind_of(table, path) for file, table in examples() if file == "scenario" for path in tables(table)}
    assert {f"regions.shape.{name}" for name in SHAPES} <= kinds


def test_unknown_gains_are_rejected_for_every_law():
    for law in LAWS:
        with pytest.raises(RunError, match=LIKE_NONE):
            gains_from(law, [f"{LIKE_NONE}=1"])


@pytest.mark.parametrize("table", ["", "time.", "law.gains.", "arbiter.", "plant.", "plant.parameters.", "goal."])
def test_unknown_override_keys_are_rejected_by_name(table):
    with pytest.raises((ScenarioError, PlantFmuError), match=rf"\b{table}{LIKE_NONE}\b"):
        load_scenario("paper", [f"{table}{LIKE_NONE}=1"])
