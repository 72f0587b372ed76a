"""Malicious scenarios, vehicles, arbiters, scenes and commands give one short line of a known kind."""

import copy
import functools
import json
import math
import operator
import tomllib

import pytest
import tomli_w

from cosim.errors import CosimError
from cosim.scenario.scenario import load_scenario
from cosim.scenario.toml_file import _folder as scenarios
from fuzzy_arbiter import formats as arbiters
from plant_fmu import load_vehicle
from plant_fmu.toml_tables import MAX_FILE
from plant_fmu.vehicle import _folder as vehicles
from tests.security.fuzzing.mutations import paths_in
from tests.security.fuzzing.registry import KINDS

PAPER = tomllib.loads((scenarios() / "paper.toml").read_text(encoding="utf-8"))


def error_of(read, path, content):
    """Return the error message of a file's content."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(KINDS) as caught:
        read(path)
    message = str(caught.value)
    assert message.isprintable() and len(message) < 3000 + len(str(path))
    return message


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


READERS = {
    "scenario": (load_scenario, "toml"), "vehicle": (load_vehicle, "toml"),
    **{f"arbiter {suffix}": (arbiters.load, suffix) for suffix in ("toml", "json", "fcl", "fis", "fll")},
}  # fmt: skip


@pytest.mark.medium(fast=41)
@pytest.mark.filterwarnings("ignore:.*are taken as Windows-1252")
@pytest.mark.parametrize("text", BROKEN.values(), ids=BROKEN)
@pytest.mark.parametrize(("read", "suffix"), READERS.values(), ids=READERS)
def test_invalid_files_are_rejected(read, suffix, tmp_path, text):
    assert error_of(read, tmp_path / f"it.{suffix}", text)


def with_value(table, path, value):
    """Return a table with another value at a path."""
    changed = copy.deepcopy(table)
    entry = functools.reduce(operator.getitem, path[:-1], changed)
    entry[path[-1]] = value
    return changed


def numbers_in(table):
    """Return the paths of numbers in a table."""
    entries = ((path, functools.reduce(operator.getitem, path, table)) for path in paths_in(table))
    return [path for path, x in entries if isinstance(x, int | float) and not isinstance(x, bool)]


@pytest.mark.parametrize("value", [math.nan, -math.inf, 10**399], ids=str)
def test_invalid_scenario_numbers_are_rejected_by_key(tmp_path, value):
    for path in numbers_in(PAPER):
        message = error_of(load_scenario, tmp_path / "it.toml", tomli_w.dumps(with_value(PAPER, path, value)))
        assert next(key for key in reversed(path) if isinstance(key, str)) in message, path


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ("time.duration=1e9", "time.duration"), ("time.step=1e-12", "time.duration"),
        ("arbiter.points=1000000000", "arbiter.points"),
        ("commands.enabled=true\ncommands.obstacles=1000000", "commands.obstacles"),
    ],
)  # fmt: skip
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


@pytest.mark.parametrize("read", [load_scenario, load_vehicle])
def test_key_with_terminal_codes_is_escaped(read, tmp_path):
    assert r"\x1b[31mred" in error_of(read, tmp_path / "it.toml", b'"\\u001b[31mred" = 1')


@pytest.mark.parametrize("name", ["../../x", "/etc/passwd", "a/b", "con", "a b", "x" * 65, "é", "$(id)", "-o"])
def test_vehicle_names_reject_special_characters(tmp_path, name):
    """They become names of files, and of functions in C."""
    table = tomllib.loads((vehicles() / "odin.toml").read_text(encoding="utf-8"))
    assert "name" in error_of(load_vehicle, tmp_path / "it.toml", tomli_w.dumps(table | {"name": name}))
