"""The native schema: the long form, the short form of criteria, and errors that name the key."""

import json
import tomllib
from dataclasses import replace

import pytest

from fuzzy_arbiter import Output, Shape, System, Term, Variable, falling, rising, trapezoid, triangle
from fuzzy_arbiter.criteria import Criterion, prioritized
from fuzzy_arbiter.errors import DefinitionError, FormatError
from fuzzy_arbiter.formats import reads, writes
from tests.fuzzy_arbiter.formats.systems import FAULTS, FOREIGN, REFUSED, TIPPING

LONG = FOREIGN["sail.toml"]


def test_terms_may_use_named_shapes():
    terms = {"calm": falling(2, 6), "strong": trapezoid(2, 6, 8, 12), "too strong": rising(8, 12)}
    sail = {"reefed": triangle(0, 0.25, 0.5), "full": rising(0.5, 1)}
    rules = (
        "if wind is calm then sail is full",
        'if wind is strong or wind is "too strong" then sail is reefed with 0.5',
    )
    expected = System((Variable("wind", (0, 20), terms),), (Output("sail", (0, 1), sail, 0.5),), rules)
    assert reads(LONG, "toml") == reads(json.dumps(tomllib.loads(LONG)), "json") == expected
    data = tomllib.loads(LONG)
    data["outputs"][0]["default"] = None
    assert reads(json.dumps(data), "json").outputs[0].default is None


SHORT = FOREIGN["criteria.toml"]


def test_criteria_are_the_short_form():
    criteria = (Criterion("obstacle", "near", "far", falling(1, 3)), Criterion("depth"))
    weight = Output("w", (0, 1), (Term("low", falling(0.3, 0.7)), Term("high", rising(0.3, 0.7))))
    assert reads(SHORT, "toml") == prioritized(criteria, "minimal", weight, "sum", "clip", 55, "regions")
    assert reads('{"criteria": [{"name": "a"}]}', "json") == prioritized([Criterion("a")])


def test_term_points_are_on_one_line_of_standard_json_and_toml():
    line = "[[0.0, 1.0], [5.0, 0.0]]"
    for format, parse, said in (("json", json.loads, f'"poor": {line},'), ("toml", tomllib.loads, f"poor = {line}")):
        text = writes(TIPPING, format)
        assert said in [row.strip() for row in text.splitlines()]
        assert parse(text)["inputs"][0]["terms"]["poor"] == [[0.0, 1.0], [5.0, 0.0]]
        assert parse(text)["points"] == 101


@pytest.mark.parametrize("format", ["json", "toml"])
def test_any_name_and_shape_round_trips(format):
    names = ("not exist", "it's", "a\\b", "is", "é日𝛼", "1.5", "[x]", "#", "if a is b then c is d")
    terms = tuple(Term(name, Shape(((0, 0.25), (1, 0.5), (1, 0), (3, 0.125 + i / 64)))) for i, name in enumerate(names))
    system = System(
        (Variable("\\", (0, 3), terms),),
        (Output("=", (-1e99, 3), terms, default=-7e-310),),
        tuple(f'if "\\" is not "{name}" then "=" is "{name}"' for name in names),
        name="'''",
    )
    assert reads(writes(system, format), format) == system


def changed(path, value):
    data = tomllib.loads(LONG)
    *folders, key = path
    place = data
    for folder in folders:
        place = place[folder]
    place[key] = value
    return json.dumps(data)


@pytest.mark.parametrize(("path", "value", "fault"), FAULTS["sail.toml"])
def test_errors_name_the_key(path, value, fault):
    with pytest.raises((FormatError, DefinitionError), match=fault):
        reads(changed(path, value), "json")


@pytest.mark.parametrize(
    ("format", "text", "fault"),
    [
        *(("json", *row) for row in REFUSED["json"]),
        *(("toml", *row) for row in REFUSED["toml"]),
        ("json", '{"points": ' + "1" * 5000 + "}", "^expected JSON: Exceeds the limit"),
        *(
            (
                "toml",
                LONG.replace("universe = [0, 20]", f"universe = [0, {x}]"),
                rf"universe: got {x}, expected a finite",
            )
            for x in ("inf", "nan")
        ),
    ],
)
def test_invalid_files_are_rejected(format, text, fault):
    with pytest.raises((FormatError, DefinitionError), match=fault):
        reads(text, format)


def test_a_system_is_written_whole():
    data = json.loads(writes(replace(TIPPING, outside="clip"), "json"))
    assert list(data) == [
        *("name", "conjunction", "disjunction", "implication", "normalization", "outside", "points"),
        *("inputs", "outputs", "rules"),
    ]
    assert tomllib.loads(writes(replace(TIPPING, outside="clip"), "toml")) == data
