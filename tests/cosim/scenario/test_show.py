"""``cosim show``: a commented template that round-trips."""

import dataclasses
import re
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller import LAWS
from controller.regions.region_set import SHAPES
from cosim.command_line.cli import main
from cosim.scenario.keys import comments, unit_of_gain, unit_of_shape
from cosim.scenario.scenario import load_scenario
from cosim.scenario.toml_file import list_scenarios
from cosim.scenario.toml_text import scenario_text
from plant_fmu import load_vehicle

WITHOUT_UNIT = {"axes", "file", "quaternion", "normal", "axis", "camera_axis"}


@pytest.fixture
def shown(capsys):
    def show(*words):
        assert main(["show", *words]) == 0
        return capsys.readouterr().out

    return show


@pytest.mark.medium(fast=3)
@pytest.mark.parametrize("name", list_scenarios())
def test_shown_scenario_round_trips(name, shown, tmp_path):
    (tmp_path / "mine.toml").write_text(shown(name))
    first, again = load_scenario(name), load_scenario(tmp_path / "mine.toml")
    for field in dataclasses.fields(first):
        if field.name not in ("name", "vehicle"):
            assert getattr(again, field.name) == getattr(first, field.name), field.name
    assert again.vehicle.name == first.vehicle.name
    assert again.toml() == first.toml()  # which the folder of a run holds
    assert shown(str(tmp_path / "mine.toml")) == (tmp_path / "mine.toml").read_text()
    (tmp_path / "short.toml").write_text(shown(name, "--short"))
    assert len((tmp_path / "short.toml").read_text()) < 0.9 * len((tmp_path / "mine.toml").read_text())
    assert load_scenario(tmp_path / "short.toml").table == again.table


CORNERS = [[float(i), 0.123456789 * i * i] for i in range(12)]


def test_shown_text_includes_flags_vehicles_and_long_shapes(shown, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(shown("paper"))
    (tmp_path / "boat.toml").write_text((load_vehicle_file("odin")).read_text())
    words = ["--set", "vehicle=boat.toml", "--set", "plant.parameters.r_G.z=0.1", "--set", "limit.force=inf"]
    words += ["--set", f'regions.SR2.shape={{type="prism", corners={CORNERS}, top=1.0, bottom=2.0}}']
    text = shown("mine.toml", *words)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "yours.toml").write_text(text)
    first = load_scenario("mine.toml", words[1::2])
    again = load_scenario(tmp_path / "elsewhere" / "yours.toml")
    assert again.vehicle_file == tmp_path / "boat.toml"
    assert again.table | {"vehicle": ""} == first.table | {"vehicle": ""}
    assert '"r_G.z" = 0.1' in text and "[regions.shape]" in text


def load_vehicle_file(name):
    from importlib import resources

    return resources.files("plant_fmu") / "vehicles" / f"{name}.toml"


@pytest.mark.parametrize("name", list_scenarios())
def test_shown_vectors_take_one_line_and_keys_are_explained(name, shown):
    text = shown(name)
    assert not re.search(r"^\s*[-\d.]+,?$", text, re.M)
    tables = re.split(r"\n(?=\[\[)", text)
    # the first of each list of tables says what its keys mean
    head = "\n".join(one for i, one in enumerate(tables) if not i or one.split("]]")[0] != tables[i - 1].split("]]")[0])
    bare = ("type", "shape", *WITHOUT_UNIT)  # a long list has its comment above
    lines = [line for line in head.splitlines() if "=" in line and not line.startswith("#") and not line.endswith("[")]
    unexplained = [line for line in lines if line.split(" = ")[0] not in bare and "  # " not in line]
    assert unexplained == []
    assert re.search(r"^duration = [\d.]+ +# s, ", text, re.M) and re.search(r"^radius = [\d.]+ +# m$", text, re.M)


def test_units_depend_on_law_vehicle_and_shape(shown):
    assert re.search(r"^k_p1 = 18.8 +# N/m3, gain of the primary region", shown("paper"), re.M)
    text = shown("docking")
    assert re.search(r"^speed = 1.2 +# m/s, greatest over ground", text, re.M)
    assert re.search(r"^buoyancy = 134.57 +# N, ", text, re.M)
    assert re.search(r"^shape = .*orientation.*  # rad, ", text, re.M)


def test_every_gain_of_every_law_is_explained():
    for name, law in LAWS.items():
        said = comments(name, load_vehicle("odin"))
        missing = [gain for gain in law.gains_type._fields if not said.get(f"law.gains.{gain}")]
        assert missing == [], name
    assert not any(key.startswith("law.gains.") for key in comments("mine.py:steer", load_vehicle("odin")))


@pytest.mark.parametrize(
    ("law", "gain", "unit"),
    [
        ("ismail_dunnigan", "k_p1", "N/m3"), ("ismail_dunnigan", "k_v2", "N m s/rad"),
        ("ismail_dunnigan", "sigma_p", "1/(m2 s)"), ("ismail_dunnigan", "k_q", ""),
        ("deployable", "coast", "s"), ("deployable", "braking_share", ""), ("deployable", "failure_threshold", ""),
        ("deployable", "current_drift", "m/s/sqrt(s)"), ("unarbitrated", "margin", "m2"),
        ("antonelli", "k_theta_moment", "s2/(kg m2)"), ("mine.py:steer", "speed", ""),
    ],
)  # fmt: skip
def test_gain_units_are_read_from_the_gain_comments(law, gain, unit):
    assert unit_of_gain(law, gain) == unit


def test_only_pure_numbers_among_gains_have_no_unit():
    without = {
        (name, gain) for name, law in LAWS.items() for gain in law.gains_type._fields if not unit_of_gain(name, gain)
    }
    of_deployable = (
        "barriers", "braking_share", "drag_estimation", "effectiveness_estimation", "failure_threshold", "max_drift",
        "path_planning",
    )  # fmt: skip
    assert without == {("ismail_dunnigan", "k_q"), *(("deployable", gain) for gain in of_deployable)}


def test_every_key_of_a_shape_has_a_unit_or_none():
    for kind, shape in SHAPES.items():
        for field in dataclasses.fields(shape):
            assert bool(unit_of_shape(kind, field.name)) == (field.name not in WITHOUT_UNIT), (kind, field.name)
    assert unit_of_shape("orientation", "tolerance") == "rad" and unit_of_shape("depth_band", "tolerance") == "m"


TEXT = st.text(st.characters(codec="utf-8", exclude_categories=["Cs"]), max_size=20)
FLAT = st.one_of(TEXT, st.booleans(), st.integers(-(2**53), 2**53), st.floats(allow_nan=False))
VALUE = st.recursive(
    FLAT, lambda inner: st.lists(inner, max_size=12) | st.dictionaries(TEXT, inner, max_size=4), max_leaves=30
)


@pytest.mark.medium
@given(st.dictionaries(TEXT, VALUE, max_size=5))
def test_tables_round_trip(table):
    for said in ({}, {"time.step": "s, a comment", **dict.fromkeys(table, "one\tmore")}):
        assert tomllib.loads(scenario_text(table, said)) == table
