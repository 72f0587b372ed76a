"""Scenario files: every key validated, every error named."""

import re
import tomllib
import typing
from importlib import resources

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from controller.regions import Pipe, Sphere
from cosim.batch.variation import Variation
from cosim.campaigns.sweeps.design import Vary, vary_from
from cosim.errors import CosimError, ScenarioError
from cosim.scenario.scenario import load_scenario, validate_scenario
from cosim.scenario.toml_file import list_scenarios
from plant_fmu.toml_tables import Table, fields_of, types_in
from tests.refusals import refusals

MINIMAL = """
vehicle = "bluerov2_heavy"
time = { duration = 2.0 }
initial = { position = [0.0, 0.0, 1.0] }
goal = { type = "sphere", center = [3.0, 0.0, 2.0], radius = 0.5 }
"""


def saved(tmp_path, text, name="mine.toml"):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_shipped_scenarios_load():
    assert list_scenarios() == [
        "dense-field", "depth-transit", "docking", "harbour", "inspection-visibility", "moving-obstacle", "paper",
        "paper-calibrated", "paper-deployable", "paper-limited", "pile-inspection", "pipe-inspection",
        "sitl",
    ]  # fmt: skip
    for name in list_scenarios():
        assert load_scenario(name).title


def test_minimal_file_gets_defaults(tmp_path):
    scenario = load_scenario(saved(tmp_path, MINIMAL))
    assert scenario.steps == 2000 and scenario.control_every == scenario.arbiter_every == 1
    assert scenario.arbiter.ramp == 0.2
    assert scenario.limit.force == float("inf")
    assert scenario.goal == Sphere((3.0, 0.0, 2.0), 0.5)
    assert scenario.regions == ()


def test_overlap_includes_only_keep_out_regions():
    assert load_scenario("paper", ["regions.SR1.keep=in", "intersection=[]"]).intersection == (1, 2)


def test_circular_base_is_rejected(tmp_path):
    with pytest.raises(ScenarioError, match="base"):
        load_scenario(saved(tmp_path, 'base = "mine.toml"\n'))


def test_vehicle_path_is_relative_to_the_file_that_names_it(tmp_path):
    boat = (resources.files("plant_fmu") / "vehicles" / "odin.toml").read_text()
    for folder in ("common", "mine"):
        (tmp_path / folder).mkdir()
    saved(tmp_path / "common", boat, "boat.toml")
    base = load_scenario(saved(tmp_path / "common", MINIMAL.replace('"bluerov2_heavy"', '"boat.toml"'), "base.toml"))
    assert tomllib.loads(base.toml())["vehicle"] == str(tmp_path / "common" / "boat.toml")
    assert tomllib.loads(base.toml("copy.toml"))["vehicle"] == "copy.toml"
    # files of one name in two folders are two files
    saved(tmp_path / "common", 'base = "base.toml"\n', "a.toml")
    saved(tmp_path / "common", 'base = "a.toml"\n', "b.toml")
    for name in ("base", "b"):
        scenario = load_scenario(saved(tmp_path / "mine", f'base = "../common/{name}.toml"\n', "a.toml"))
        assert base.vehicle.mass == scenario.vehicle.mass == 125.0


def test_overrides_reach_every_depth(tmp_path):
    scenario = load_scenario(
        "paper",
        ["law.gains.k_p1=3", "regions.SR2.shape.radius=0.25", "regions.0.gain=7", "limit.force=inf",
         "vehicle=bluerov2_heavy",
         "plant.parameters.mass=14", 'regions.SR3.shape={type="pipe",points=[[0,0,0],[1,0,0]],radius=0.3}'],
    )  # fmt: skip
    assert scenario.law.gains.k_p1 == 3.0
    assert scenario.regions[1].region.shape.radius == 0.25
    assert scenario.regions[0].region.gain == 7.0
    assert scenario.vehicle.name == "bluerov2_heavy"
    assert scenario.plant.parameters == {"mass": 14.0}
    assert scenario.regions[2].region.shape == Pipe(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), 0.3)


def test_patterns_set_all_keys_that_they_match():
    limits = {f"thrust_max[{i + 1}]": 20.0 for i in range(8)}
    changes = ["plant.parameters.thrust_max=20", "plant.parameters.r_*=0", "regions.*wall.gain=7", "time.*=0.02"]
    scenario = load_scenario("docking", [*changes, "plant.parameters.thrust_max[2]=5", "time.duration=1"])
    centers = {f"{name}.{axis}": 0.0 for name in ("r_B", "r_G") for axis in "xyz"}
    buoyancy = {"buoyancy": 134.57}
    assert scenario.plant.parameters == buoyancy | limits | centers | {"thrust_max[2]": 5.0}
    assert [r.region.gain for r in scenario.regions] == [10.0, 7.0, 7.0, 100.0, 100.0, 7.0]
    assert (scenario.time.step, scenario.time.control, scenario.time.duration) == (0.02, 0.02, 1.0)
    assert scenario.replace({"plant.parameters.thrust_max": 20}).plant.parameters == buoyancy | limits | centers
    assert scenario.replace({"regions.*.gain": 1.0}).regions[0].region.gain == 1.0


@given(*[st.floats(-1.5, 1.5)] * 3)
def test_angles_replace_the_quaternion_of_every_attitude(roll, pitch, yaw):
    angles = f"[{roll}, {pitch}, {yaw}]"
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat(scalar_first=True)
    keys = ("initial.", "law.desired_", "regions.heading.shape.")
    scenario = load_scenario("docking", [f"{key}roll_pitch_yaw={angles}" for key in keys])
    shape = scenario.regions[0].region.shape
    for attitude in (scenario.initial.quaternion, scenario.law.desired_quaternion, shape.quaternion):
        assert attitude == pytest.approx(expected, abs=1e-12)
    back = scenario.replace({"initial.quaternion": [1.0, 0.0, 0.0, 0.0]})
    assert back.initial.quaternion == (1.0, 0.0, 0.0, 0.0)


def test_a_quaternion_and_angles_at_once_are_refused(tmp_path):
    table = load_scenario("docking").table
    both = table | {"initial": table["initial"] | {"roll_pitch_yaw": [0.0, 0.0, 1.0]}}
    with pytest.raises(ScenarioError, match="initial: pass either quaternion or roll_pitch_yaw"):
        validate_scenario(both, "both")
    angles = tomllib.loads(MINIMAL)
    angles["initial"]["roll_pitch_yaw"] = [0.0, 0.0, 1.0]
    file = saved(tmp_path, tomli_w.dumps(angles), "angles.toml")
    mine = saved(tmp_path, f'base = "{file.name}"\n[initial]\nquaternion = [0.0, 0.0, 0.0, 1.0]\n', "mine.toml")
    assert load_scenario(mine).initial.quaternion == (0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        *refusals("scenarios"),
        ("docking thrusters=20", ["thrusters: unknown key; did you mean", "plant.parameters.thruster_matrix"]),
        ("docking weight=20", ["weight: unknown key; did you mean plant.parameters.weight"]),
        ("docking tmie.step=20", ["tmie: unknown key; did you mean 'time'?"]),
        ("docking xyzzy=20", ["xyzzy: unknown key; expected one of vehicle, time,"]),
        ("docking regions.x*.gain=20", ["regions.x*.gain: no key matches"]),
        ("docking plant.parameters.sub*=20", ["sub* is no parameter of the FMU"]),
        ("docking initial.roll_pitch_yaw=90", ["initial.roll_pitch_yaw: expected a list"]),
        ("paper time.duration=1\nb=2", ["one key=value"]),
        ('paper intersection=["SR1"]\nregions=[]', ["one key=value"]),
        ("paper regions.SR1.name=$\\frac$", ["name"]),
        (f"paper law.gains.k_p1={'9' * 400}", ["law.gains"]),
    ],
)
def test_invalid_keys_give_one_line_errors(asked, words):
    name, _, overrides = asked.partition(" ")
    with pytest.raises(ScenarioError) as caught:
        load_scenario(name, overrides.split(" ; "))
    said = str(caught.value)
    assert "\n" not in said and all(word in said for word in words)


def test_gains_go_with_the_name_of_their_law(tmp_path):
    """A base's gains are those of the base's law: naming another one drops them, naming the same one keeps them."""
    through = "actuation.through=thrusters"
    other = load_scenario("paper", ["law.gains.k_p1=3", "law.name=deployable", through, "law.gains.speed=0.5"])
    assert (type(other.law.gains).__name__, other.law.gains.speed) == ("DeployableGains", 0.5)
    assert load_scenario("paper", ["law.gains.k_p1=3", "law.name=ismail_dunnigan"]).law.gains.k_p1 == 3.0
    assert load_scenario(saved(tmp_path, 'base = "paper"\nlaw = { name = "ismail_dunnigan" }\n')).law.gains.k_v1 == 90.0
    text = 'base = "paper"\nlaw = { name = "deployable" }\nactuation = { through = "thrusters" }\n'
    assert load_scenario(saved(tmp_path, text)).law.gains == type(other.law.gains)()


def test_moving_regions_are_listed():
    scenario = load_scenario("paper", ["goal.velocity=[0.1,0,0]", "regions.SR2.streamed=true"])
    assert scenario.moving == ("goal", "SR2")
    assert scenario.goal_region.velocity == (0.1, 0.0, 0.0)
    assert scenario.goal == Sphere((8.0, 0.0, 5.0), 0.5)
    assert load_scenario("paper").moving == ()


@pytest.mark.parametrize(
    ("keys", "exact"),
    [
        *((keys, True) for keys in ([], ["sensing.seed=3"], ["sensing.dead_for=1.0"], ["sensing.dead_from=1.0"])),
        (["sensing.dead_from=1.0", "sensing.dead_for=1.0"], False),
        (["sensing.position_noise=0.1"], False), (["sensing.velocity_noise=0.1"], False),
    ],
)  # fmt: skip
def test_sensing_is_exact_without_sensor_faults(keys, exact):
    assert load_scenario("paper", keys).sensing.exact == exact


@pytest.mark.parametrize(
    "key",
    ["regions.port wall.gain", 'regions."port wall".gain', "regions.'port wall'.gain",
     ' "regions" . "port\\u0020wall" . \'gain\' ', 'regions."1".gain'],
)  # fmt: skip
def test_keys_may_be_quoted_as_in_toml(key):
    docking = load_scenario("docking")
    wanted = load_scenario("docking", ["regions.1.gain=50"]).toml()
    assert load_scenario("docking", [f"{key}=50"]).toml() == docking.replace({key: 50.0}).toml() == wanted
    varied = Variation(docking, [key])
    assert varied.scenario([50.0], docking.sensing.seed).regions[1].region.gain == 50.0
    assert vary_from([f"{key}=50,60"])[0].key == Vary(key, values=(1.0,)).key == varied.keys[0]


@pytest.mark.parametrize(
    "key", ['regions."port wall.gain', 'regions.port" wall".gain', "regions.'", 'regions."\\x".gain']
)
def test_half_quoted_keys_are_refused(key):
    for act in (
        lambda: load_scenario("docking", [f"{key}=50"]),
        lambda: load_scenario("docking").replace({key: 50.0}),
        lambda: vary_from([f"{key}=1:2"]),
        lambda: Variation(load_scenario("docking"), [key]),
    ):
        with pytest.raises(CosimError, match="regions") as refused:
            act()
        assert "\n" not in str(refused.value)


def test_values_may_hold_quotes_and_equals_signs():
    assert load_scenario("docking", ["title=\"a = 'b'\""]).title == "a = 'b'"
    assert load_scenario("docking", ["title=it's = so"]).title == "it's = so"


@pytest.mark.parametrize("missing", ["vehicle", "time", "initial", "goal"])
def test_missing_keys_are_named(tmp_path, missing):
    text = "\n".join(line for line in MINIMAL.splitlines() if not line.startswith(missing))
    with pytest.raises(ScenarioError, match=rf"mine\.toml: {missing} is missing"):
        load_scenario(saved(tmp_path, text))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('title = "\\n - at `$[0].time.zz`"', r"title is '\n - at `$[0].time.zz`', expected one line"),
        ('"x` - at `$.zz[3]" = 1', "x` - at `$.zz[3]: unknown key"),
        ('arbiter = { "x` - at `$[0].time" = 1 }', "arbiter.x` - at `$[0].time: unknown key"),
    ],
)
def test_text_like_a_path_in_an_error_is_not_taken_for_one(tmp_path, line, words):
    with pytest.raises(ScenarioError, match=re.escape(f"mine.toml: {words}")):
        load_scenario(saved(tmp_path, f"{line}\n{MINIMAL}"))


@pytest.mark.parametrize("content", [b"\xff\xfe", b"a = [", b""])
def test_broken_files_are_refused(tmp_path, content):
    path = tmp_path / "broken.toml"
    path.write_bytes(content)
    with pytest.raises(ScenarioError, match=r"broken\.toml"):
        load_scenario(path)


def test_partial_tables_get_defaults():
    table = load_scenario("paper", ["sensing.position_noise=0.02"]).table
    assert table["sensing"].keys() == load_scenario("paper").table["sensing"].keys()
    assert table["sensing"]["position_noise"] == 0.02 and table["sensing"]["seed"] == 0


def tables_of(kind):
    return [kind, *(table for inner in kind.__subclasses__() for table in tables_of(inner))]


@pytest.mark.parametrize("table", tables_of(Table))
def test_no_number_of_a_range_stands_beside_a_tuple(table):
    """msgspec 0.22 reads foreign memory where a union holds a number with bounds and a tuple of fixed length."""
    for name, annotation in fields_of(table).items():
        choices = list(types_in(annotation))
        fixed = [kind for kind, _ in choices if typing.get_origin(kind) is tuple and ... not in kind.__args__]
        bounded = [kind for kind, metas in choices if kind in (int, float) and any(m.ge is not m.gt for m in metas)]
        assert not (fixed and bounded), name
