"""Malicious scenarios, vehicles, arbiters, scenes and commands give one short line of a known kind."""

import json
import math
import tomllib

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from controller import ControllerError
from cosim.campaigns.scenes.scene_file import decode_scene
from cosim.errors import CosimError
from cosim.scenario.scenario import load_scenario
from cosim.scenario.toml_file import _folder as scenarios
from cosim.simulation.commands.sources import read_log
from fuzzy_arbiter import Arbiter, ArbiterError
from fuzzy_arbiter import formats as arbiters
from plant_fmu import PlantFmuError, load_vehicle
from plant_fmu.toml_tables import MAX_FILE

SCENARIO = (scenarios() / "paper.toml").read_text(encoding="utf-8")
VEHICLE = 'name = "odin"\n'
SCENE = {
    "seed": 1, "start": [0, 0, 1], "goal": {"centre": [1, 1, 1], "radius": 1}, "obstacles": [], "depth_band": [0, 9],
    "current": [0, 0, 0], "weight_minus_buoyancy": 0, "righting_moment": 1,
}  # fmt: skip
ARBITERS = {format: arbiters.writes(Arbiter().system, format) for format in ("json", "toml", "fcl", "fll")}
KINDS = (CosimError, PlantFmuError, ArbiterError, ControllerError)


def scenario(path, text):
    path.write_bytes(text)
    load_scenario(path)


def vehicle(path, text):
    path.write_bytes(text)
    load_vehicle(path)


def error_of(read, path, text):
    """Return the error message of a text, "" if it is accepted."""
    content = text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass")
    said = ""
    try:
        read(path, content)
    except KINDS as error:
        said = str(error)
    assert said.isprintable() and len(said) < 3000 + len(str(path))
    return said


LONG = "a" * 1_000_000
BROKEN = {
    "too long": b"#" * (MAX_FILE + 1),
    "deep lists": b"title = " + b"[" * 5000 + b"]" * 5000,
    "deep tables": b"[" + b".".join([b"a"] * 3000) + b"]",
    "deep dotted keys": b"plant.parameters." + b".".join([b"a"] * 3000) + b" = 1",
    "a huge number": b"time.duration = 0x" + b"f" * 100_000,
    "a large number": b"time.duration = 1" + b"0" * 400,
    "many digits": b"time.duration = " + b"9" * 10_000,
    "no UTF-8": b'title = "\xff"',
    "a null": b'vehicle = "\\u0000.toml"',
    "a long name": f'vehicle = "{LONG}"'.encode(),
    "a long base": f'base = "{LONG}"'.encode(),
    "a long key": f"{LONG} = 1".encode(),
    "another's file": b'vehicle = "../../../../etc/passwd"',
}


@pytest.mark.medium(fast=9)
@pytest.mark.parametrize("text", BROKEN.values(), ids=BROKEN)
@pytest.mark.parametrize("read", [scenario, vehicle])
def test_invalid_files_are_rejected(read, tmp_path, text):
    assert error_of(read, tmp_path / "it.toml", text)


@pytest.mark.medium(fast=32)
@pytest.mark.parametrize("text", BROKEN.values(), ids=BROKEN)
@pytest.mark.parametrize("format", ["toml", "json", "fcl", "fis", "fll"])
def test_invalid_arbiter_files_are_rejected(tmp_path, text, format):
    assert error_of(arbiter, tmp_path / f"it.{format}", text)


def arbiter(path, text):
    path.write_bytes(text)
    arbiters.load(path)


def numbers_of(value, where=()):
    """Return where in a table numbers stand."""
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        return [place for key, inner in items for place in numbers_of(inner, (*where, key))]
    return [where] if isinstance(value, int | float) and not isinstance(value, bool) else []


def with_value(table, where, value):
    table = json.loads(json.dumps(table))
    *path, last = where
    at = table
    for key in path:
        at = at[key]
    at[last] = value
    return table


PAPER = tomllib.loads(SCENARIO)


@pytest.mark.parametrize("value", [math.nan, -math.inf, 10**399], ids=str)
def test_invalid_scenario_numbers_are_rejected_by_key(tmp_path, value):
    for where in numbers_of(PAPER):
        table = with_value(PAPER, where, value)
        said = error_of(scenario, tmp_path / "it.toml", tomli_w.dumps(table))
        key = str(next(part for part in reversed(where) if isinstance(part, str)))
        assert key in said, (where, said)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ("time.duration=1e9", "time.duration"),
        ("time.step=1e-12", "time.duration"),
        ("arbiter.points=1000000000", "arbiter.points"),
        ("commands.enabled=true\ncommands.obstacles=1000000", "commands.obstacles"),
    ],
)
def test_excessive_sizes_are_rejected_by_key(change, key):
    with pytest.raises(CosimError, match=key):
        load_scenario("paper", change.split("\n"))


@pytest.mark.parametrize("name", ["</script>", "../x", "a/b", "a\nb", "", "$\\frac{$", "\u202e", "a" * 41, "\0"])
def test_region_names_reject_special_characters(name):
    with pytest.raises(CosimError, match="name"):
        load_scenario("paper", [f"regions.0.name={json.dumps(name)}"])


@pytest.mark.parametrize("key", ["title", "law.name"])
@pytest.mark.parametrize("text", ["a:\x1b[31mred", "a:\nb", "a:\x9b2J", "a:\u202eb", "a:" + "b" * 199])
def test_displayed_texts_reject_terminal_codes(key, text):
    with pytest.raises(CosimError, match=f"{key} is .*printable") as caught:
        load_scenario("paper", [f"{key}={json.dumps(text)}"])
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("read", [scenario, vehicle])
def test_key_with_terminal_codes_is_escaped(read, tmp_path):
    assert r"\x1b[31mred" in error_of(read, tmp_path / "it.toml", b'"\\u001b[31mred" = 1')


@pytest.mark.parametrize("name", ["../../x", "/etc/passwd", "a/b", "con", "a b", "x" * 65, "é", "$(id)", "-o"])
def test_vehicle_names_reject_special_characters(tmp_path, name):
    """They become names of files, and of functions in C."""
    from plant_fmu.vehicle import _folder

    table = tomllib.loads((_folder() / "odin.toml").read_text(encoding="utf-8"))
    said = error_of(vehicle, tmp_path / "it.toml", tomli_w.dumps(table | {"name": name}))
    assert "name" in said


@pytest.mark.parametrize(
    "line", [b"[" * 100_000, b'{"seed":' * 50_000, b"\xff", b"{}", b"1", b'{"seed":1' + b"0" * 5000]
)
def test_invalid_scenes_and_commands_are_rejected(tmp_path, line):
    assert error_of(lambda path, text: decode_scene(text), tmp_path, line)
    (tmp_path / "log").write_bytes(line + b"\n")
    assert error_of(lambda path, text: read_log(path), tmp_path / "log", line)


# ---- any change of a sound text ----

NASTY = st.sampled_from(
    [math.nan, math.inf, 0, -1, 1e300, 1e-300, 10**399, 2**64, "", "\0", "../../x", "</script>", "é\u202e", "a" * 5000,
     [], {}, [[]], {"a": {}}, True, [1] * 500, "$\\frac{$"]
)  # fmt: skip


@given(st.data())
def test_any_value_in_a_scenario_is_accepted_or_rejected(tmp_path_factory, data):
    table = with_value(PAPER, data.draw(st.sampled_from(places(PAPER))), data.draw(NASTY))
    error_of(scenario, tmp_path_factory.getbasetemp() / "it.toml", tomli_w.dumps(table))


@given(st.data())
def test_any_value_in_a_scene_is_accepted_or_rejected(data):
    table = with_value(SCENE, data.draw(st.sampled_from(places(SCENE))), data.draw(NASTY))
    error_of(lambda path, text: decode_scene(text), "", json.dumps(table))


def places(value, where=()):
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        inner = [place for key, inner in items for place in places(inner, (*where, key))]
        return ([where] if where else []) + inner
    return [where]


TOKENS = st.sampled_from(
    ["", '"', "'", "[", "]", "{", "}", "=", ":=", ";", "(", ")", "(*", "*)", "\n", "\0", "\\", "nan", "1e999",
     "9" * 5000, "0x" + "f" * 5000, '"""', "IF ", "THEN ", "NOT " * 500, "(" * 2000, "[" * 2000, "\ud7ff", "\u2028"]
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("format", ARBITERS)
@given(st.data())
def test_mutated_arbiter_file_is_read_or_rejected(tmp_path_factory, format, data):
    text = changed(ARBITERS[format], data)
    error_of(arbiter, tmp_path_factory.getbasetemp() / f"it.{format}", text)


@given(st.data())
def test_mutated_scenario_is_read_or_rejected(tmp_path_factory, data):
    error_of(scenario, tmp_path_factory.getbasetemp() / "it.toml", changed(SCENARIO, data))


def changed(text, data):
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(text)))
        text = text[:at] + data.draw(TOKENS | st.text(max_size=3)) + text[at + data.draw(st.integers(0, 20)) :]
    return text
