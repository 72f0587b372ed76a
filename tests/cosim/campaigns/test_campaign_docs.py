"""Tables and numbers of the page on campaigns are those of the code; its commands and snippets run in tests/docs."""

import re

import pytest

from cosim.batch.outcome import FIELDS
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.scene import Scene
from cosim.campaigns.scenes.scene_rows import SCHEMA
from cosim.campaigns.sweeps.design import KINDS, vary_from
from plant_fmu.toml_tables import fields_of, table_in
from tests.test_reference_tables import DOCS, rows

PAGE = "campaigns.md"


def test_every_key_of_a_scene_is_documented():
    words = " ".join(row[0] for row in rows(PAGE, "keys of cosim/campaigns/scenes/scene.py"))
    for name, annotation in fields_of(Scene).items():
        table, _ = table_in(annotation)
        assert f"`{name}" in words
        for inner in fields_of(table) if table else ():
            assert f".{inner}`" in words, (name, inner)


@pytest.mark.parametrize(
    ("table", "units"),
    [
        (
            "columns of cosim/campaigns/scenes/scene_rows.py",
            {f.name: f.metadata[b"unit"].decode() for f in SCHEMA},
        ),
        ("outcomes of cosim/batch/outcome.py", {name: unit for name, (_, unit, _) in FIELDS.items()}),
    ],
)
def test_every_column_is_documented_with_its_unit(table, units):
    documented = [(name.strip("`"), unit) for name, unit, _ in rows(PAGE, table)]
    assert documented == [(name, unit.replace(".", " ")) for name, unit in units.items()]


def test_the_conditions_are_those_of_the_score():
    c, text = Conditions(), " ".join((DOCS / PAGE).read_text().split())
    assert f"lasts {c.duration:g} s, with the law every {c.control} s and the plant every {c.plant_step} s" in text
    assert f"for the last {c.settled:g} s" in text


def test_designs_and_ranges_are_documented():
    assert [row[0].strip("`") for row in rows(PAGE, "designs of a sweep")] == list(KINDS)
    numbers = {"key": "k", "low": "1", "high": "2", "points": "3", "a": "1", "b": "2", "c": "3"}
    for texts, *_ in rows(PAGE, "ranges of --vary"):
        for text in re.findall("`(.*?)`", texts):
            vary_from([re.sub(r"[a-z]+", lambda word: numbers.get(word.group(), word.group()), text)])
