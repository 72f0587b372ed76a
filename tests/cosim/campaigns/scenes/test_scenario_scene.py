"""Scenes that are scenarios: documented conflicts and trials, their own rules, and rejected keys."""

import collections
import dataclasses
import json

import numpy as np
import pytest

from controller import LAWS
from controller.regions.region_set import clearance_at, pack
from cosim.campaigns.scenes.as_scenario import scene_scenario
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.conflicts import make_conflict
from cosim.campaigns.scenes.flyer import SceneFlyer, _least_limit
from cosim.campaigns.scenes.generator import generate_scenes
from cosim.campaigns.scenes.kinds import kind_of
from cosim.campaigns.scenes.mismatches import is_admitted, make_mismatch
from cosim.campaigns.scenes.scene_file import decode_scene
from cosim.campaigns.scenes.trials import make_trial
from cosim.errors import ScenarioError
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.criteria import prioritized
from plant_fmu import load_vehicle

GAINS = LAWS["deployable"].gains_type()


def scene_of(table):
    return decode_scene(json.dumps(table).encode())


def scenario_of(table, **conditions):
    return scene_scenario(scene_of(table), "deployable", GAINS, Conditions(**conditions))


def made(make, wanted, count=1):
    """Return the first scenes of a kind."""
    scenes = (make(seed) for seed in range(500))
    return [scene for scene in scenes if scene["kind"].startswith(wanted)][:count]


@pytest.mark.parametrize("kind", ["conflict", "tour", "trial", "mismatch"])
def test_scenes_are_determined_by_their_seed(kind):
    one, other = (list(generate_scenes(4, 7, kind)) for _ in range(2))
    assert one == other and list(generate_scenes(1, 9, kind)) == one[2:3]
    assert [decode_scene(line.encode()).seed for line in one] == [7, 8, 9, 10]


@pytest.mark.medium
def test_priorities_follow_the_order_of_the_criteria():
    orders = set()
    for seed in range(40):
        scenario = scenario_of(make_conflict(seed))
        places = scenario.criterion_names
        orders.add(places)
        assert all(r.priority == 4.0 ** (3 - places.index(r.criterion)) for r in scenario.regions)
    assert len(orders) > 10  # of 24


@pytest.fixture(scope="module")
def mismatches():
    return [make_mismatch(seed) for seed in range(300)]


@pytest.mark.medium
def test_kinds_and_vehicles_are_evenly_distributed(mismatches):
    kinds = collections.Counter(make_conflict(seed)["kind"] for seed in range(900))
    assert len(kinds) == 18 and min(kinds.values()) > 25 and max(kinds.values()) < 80  # 50 expected
    trials = collections.Counter(make_trial(seed)["kind"] for seed in range(700))
    assert len(trials) == 7 and min(trials.values()) > 65 and max(trials.values()) < 140  # 100 expected
    kinds = collections.Counter(table["kind"] for table in mismatches)
    assert len(kinds) == 12 and 0 < kinds.pop("excluded") <= 30 and min(kinds.values()) > 8


def ratios(vehicle, parameters, name):
    """Return the ratios of a plant's parameters to those of the vehicle's file, where these are not 0."""
    given = np.array(getattr(vehicle, name), dtype=float)
    pairs = [(given[tuple(np.array(key[len(name) + 1 : -1].split(","), int) - 1)], value)
             for key, value in parameters.items() if key.startswith(f"{name}[")]  # fmt: skip
    return np.array([value / of for of, value in pairs if of])


def is_alike(numbers, low, high):
    return bool(np.ptp(numbers) < 1e-9 and low <= numbers[0] <= high)


DIFFERENCES = {
    "drag": lambda v, p: all(is_alike(ratios(v, p, f"{n}_damping"), 0.5, 2.0) for n in ("linear", "quadratic")
                             if np.any(getattr(v, f"{n}_damping"))),
    "limits": lambda v, p: all(0.5 <= x <= 1.0 for n in ("min", "max") for x in ratios(v, p, f"thrust_{n}")),
    "added mass": lambda v, p: is_alike(ratios(v, p, "added_mass"), 0.5, 1.5),
    "mass": lambda v, p: is_alike(
        np.array([p["mass"] / v.mass, p["weight"] / v.weight, p["inertia.zz"] / v.inertia[2, 2]]), 0.7, 1.3),
    "dead band": lambda v, p: 0.0 <= p["thrust_dead_band[1]"] <= 0.15,
    "lag": lambda v, p: 0.0 <= p["thrust_time_constant[1]"] <= 0.5,
    "gusts": lambda v, p: 0.05 <= p["current_variation.x"] <= 0.2 and 2.0 <= p["current_correlation_time"] <= 8.0,
    "shear": lambda v, p: 0.0 < np.hypot(p["current_shear.x"], p["current_shear.y"]) <= 0.05,
    "arms": lambda v, p: np.ptp(ratios(v, p, "thruster_matrix")) > 0.05
    and np.all(abs(ratios(v, p, "thruster_matrix") - 1.0) <= 0.1 + 1e-9),
    "other set": lambda v, p: not is_alike(ratios(v, p, "quadratic_damping"), 0.0, 100.0),
}  # fmt: skip


@pytest.mark.medium
def test_plant_of_a_mismatch_differs_by_what_its_kind_states(mismatches):
    """W - B is within 1 % of the weight in each; every kind but `several` changes nothing else."""
    common = {"seed", "buoyancy", "thrust_time_constant"}
    changed = {
        "drag": {"linear_damping", "quadratic_damping"}, "limits": {"thrust_min", "thrust_max"},
        "added mass": {"added_mass"}, "mass": {"mass", "weight", "inertia"}, "dead band": {"thrust_dead_band"},
        "lag": set(), "gusts": {"current_variation", "current_correlation_time"}, "shear": {"current_shear"},
        "arms": {"r_B", "thruster_matrix"}, "other set": {"linear_damping", "quadratic_damping", "added_mass"},
    }  # fmt: skip
    for table in mismatches:
        scenario, kind = table["scenario"], table["kind"]
        vehicle, parameters = load_vehicle(scenario["vehicle"]), scenario["plant"]["parameters"]
        net = parameters.get("weight", vehicle.weight) - parameters["buoyancy"]
        assert abs(net) <= 0.01 * vehicle.weight + 1e-9
        if kind in DIFFERENCES:
            assert DIFFERENCES[kind](vehicle, parameters), table["seed"]
            assert {key.partition("[")[0].partition(".")[0] for key in parameters} == common | changed[kind]
    gusts = [table["scenario"]["plant"]["parameters"]["seed"] for table in mismatches if table["kind"] == "gusts"]
    assert len(set(gusts)) == len(gusts)
    assert make_mismatch(2**63 - 1)["scenario"]["plant"]["parameters"]["seed"] < 2**31  # as FMI takes them


@pytest.mark.medium
def test_admission_needs_a_way_and_thrust_and_no_flight(mismatches):
    wall = {"type": "box", "center": [5.0, 0.0, 4.0], "size": [0.5, 500.0, 50.0]}
    for table in [table for table in mismatches if table["kind"] in ("gusts", "shear")][:6]:
        plant, regions = table["scenario"]["plant"], table["scenario"]["regions"]
        assert is_admitted(scenario_of(table))
        m = load_vehicle(table["scenario"]["vehicle"]).n_thrusters
        weak = {f"thrust_{end}[{j + 1}]": limit for end, limit in (("min", -0.01), ("max", 0.01)) for j in range(m)}
        for other in (
            {"regions": [*regions, regions[0] | {"name": "wall", "shape": wall}]},
            {"plant": plant | {"parameters": plant["parameters"] | weak}},
            {"plant": plant | {"parameters": plant["parameters"] | {"current_variation.x": 9.0}}},
            {"plant": plant | {"parameters": plant["parameters"] | {"current_shear.x": 2.0}}},
            {"plant": plant | {"current": [6.0, 0.0, 0.0]}},
        ):
            assert not is_admitted(scenario_of(table | {"scenario": table["scenario"] | other})), other


def test_limit_of_a_thruster_is_compared_in_the_directions_that_it_has():
    table = make_trial(1)
    vehicle = load_vehicle(table["scenario"]["vehicle"])
    scenario = scenario_of(table)
    one_way = dataclasses.replace(vehicle, thrust_min=np.zeros(vehicle.n_thrusters))
    assert _least_limit(dataclasses.replace(scenario, vehicle=one_way)) == 1.0


@pytest.mark.medium
def test_tour_has_successive_goals_on_both_sides_of_the_conflict():
    kinds = collections.Counter(make_conflict(seed, "tour")["kind"] for seed in range(300))
    assert len(kinds) == 9 and min(kinds.values()) > 15  # 33 expected
    for seed in range(20):
        scenario = scenario_of(make_conflict(seed, "tour"))
        first, then = np.array(scenario.goal.center), np.array(scenario.goal_then)
        assert then.shape == (2, 3) and scenario.mission.legs[0].stay == 3.0
        kind = scenario.title.removeprefix(f"Tour {seed}: ").split()[0]
        axis, middle = {"sides": (0, 5.0), "views": (0, 4.0), "depths": (2, 0.5 * (first[2] + then[0, 2]))}[kind]
        assert np.sign(first[axis] - middle) == np.sign(then[1, axis] - middle) == -np.sign(then[0, axis] - middle)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("kind", ["ceiling", "dock"])
def test_closing_faces_leave_no_feasible_position(kind):
    for table in made(make_conflict, kind, 5):
        scenario = scenario_of(table)
        packed = pack([secondary.region for secondary in scenario.regions])
        axis = 2 if kind == "ceiling" else 1
        for time, free in ((0.0, True), (scenario.time.duration, False)):
            packed.move_to(time)
            places = np.array([[0.0, 0.0, 4.0]] * 401)
            places[:, axis] += np.linspace(-4.0, 4.0, 401)
            best = max(min(clearance_at(packed, i, place) for i in range(2)) for place in places)
            assert (best > 1.4) if free else (best < -0.05)


def test_squeeze_has_no_position_that_satisfies_both_depth_regions():
    for table in made(make_conflict, "squeeze", 5):
        least, greatest = scenario_of(table).regions
        assert not least.region.hard and not greatest.region.hard
        assert least.region.shape.point[2] > greatest.region.shape.point[2]


@pytest.mark.medium
def test_soft_regions_block_the_passages_of_sides_and_door():
    for table in made(make_conflict, "sides", 5) + made(make_conflict, "door", 5):
        hard = [r for r in scenario_of(table).regions if r.region.hard]
        soft = [r for r in scenario_of(table).regions if not r.region.hard]
        assert hard and len({r.criterion for r in soft}) == 2


@pytest.mark.medium
def test_trial_deviates_from_nominal_in_its_tested_condition():
    (heavy,) = made(make_trial, "net weight")
    vehicle = load_vehicle(heavy["scenario"]["vehicle"])
    net = abs(vehicle.weight - heavy["scenario"]["plant"]["parameters"]["buoyancy"])
    assert net >= 25.0
    (stream,) = made(make_trial, "current")
    assert 0.25 <= np.hypot(*stream["scenario"]["plant"]["current"][:2]) <= 0.5
    (worn,) = made(make_trial, "effectiveness")
    wear = [x for key, x in worn["scenario"]["plant"]["parameters"].items() if key.startswith("thrust_effectiveness")]
    assert len(wear) == load_vehicle(worn["scenario"]["vehicle"]).n_thrusters and 0.6 <= min(wear) < max(wear) <= 1.0
    assert made(make_trial, "failure")[0]["scenario"]["failures"]
    assert len(made(make_trial, "pocket")[0]["scenario"]["regions"]) == 4


def test_conditions_change_only_their_own_keys():
    (table,) = made(make_conflict, "view")
    plain = scenario_of(table).table
    changed = scenario_of(table, arbiter="reversed", sensing="sensors", report_failures=True).table
    assert changed["arbiter"]["rules"] == "reversed" and changed["sensing"]["through"] == "sensors"
    assert changed["report_failures"] and not plain["report_failures"]
    for key in plain.keys() - {"arbiter", "sensing", "report_failures"}:
        assert changed[key] == plain[key], key


def test_the_weighted_violation_is_the_integral_of_depth_times_priority():
    (table,) = made(make_conflict, "squeeze")
    table["scenario"]["time"]["duration"] = 4.0
    table["scenario"]["time"]["step"] = 0.02  # a row of the trace at each step
    scene = scene_of(table)
    with SceneFlyer("pd") as flyer:
        score, trace = flyer.fly(scene, trace=True)
    down, expected = trace["position.z"], 0.0
    for region in table["scenario"]["regions"]:
        at, sign = region["shape"]["point"][2], region["shape"]["normal"][2]
        inside = sign * (at - down)  # m, within the half-space
        depth = np.maximum(inside if region["keep"] == "out" else -inside, 0.0)
        expected += region["priority"] * depth.sum() * 0.02
    assert score.weighted_violation == pytest.approx(expected, rel=1e-9) and expected > 0.0


def test_scene_uses_its_own_vehicle():
    tables = [made(make_conflict, f"squeeze, {vehicle}")[0] for vehicle in ("bluerov2_heavy", "odin")]
    with SceneFlyer("pd", Conditions(settled=1.0)) as flyer:
        for table in tables:
            table["scenario"]["time"]["duration"] = 2.0
            score, _ = flyer.fly(scene_of(table))
            assert score.failed_step < 0
            assert kind_of(scene_of(table)) == table["kind"]


def test_arbiter_file_weights_the_criteria_of_any_scene(tmp_path):
    """The paper's rules, from a file, give the same run as the scenario's own; others reject unknown criteria."""
    file = tmp_path / "mine.json"
    Arbiter(prioritized()).save(file)
    (scene,) = (decode_scene(line.encode()) for line in generate_scenes(1, 3, "hard"))
    ends = []
    for arbiter in ("ordered", str(file)):
        with SceneFlyer("pd", Conditions.by_arbiter(arbiter, duration=3.0)) as flyer:
            ends.append(flyer.fly(scene)[0]._replace(worst_step=0.0))
    assert ends[0] == ends[1]
    with pytest.raises(ScenarioError, match=r"arbiter\.file: mine\.json has no output 'visibility'"):
        scene_scenario(scene_of(make_conflict(0)), "pd", LAWS["pd"].gains_type(), Conditions.by_arbiter(str(file)))


@pytest.mark.parametrize(
    ("arbiter", "said"),
    [
        ("fuzzy", r"--arbiter is 'fuzzy', expected ordered, reversed, crisp, none, or a file of rules"),
        ("none.fcl", r"arbiter\.file: none\.fcl: No such file"),
        ("empty.fcl", r"--arbiter: .*empty\.fcl: "),
    ],
)
def test_invalid_arbiter_is_rejected(tmp_path, monkeypatch, arbiter, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.fcl").touch()
    with pytest.raises(ScenarioError, match=said):
        Conditions.by_arbiter(arbiter)


SCENARIO = make_conflict(0)["scenario"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"seed": -1}, r"seed is -1, expected"),
        ({"kind": ""}, r"kind is '', expected up to 60 printable"),
        ({"kind": "a\nb"}, r"kind is 'a\\nb', expected"),
        ({"scenario": {}}, r"vehicle|time"),
        ({"scenario": SCENARIO | {"law": {"name": "pd"}}}, r"scenario\.law is given, expected none"),
        ({"scenario": SCENARIO | {"vehicle": "mine.toml"}}, r"vehicle is 'mine\.toml', expected one that is shipped"),
        ({"scenario": SCENARIO | {"arbiter": {"file": "a.fcl"}}}, r"arbiter\.text is missing"),
        ({"scenario": SCENARIO | {"master": {"order": "jacobi"}}}, r"scenario\.master\.order is 'jacobi', expected"),
        ({"scenario": SCENARIO | {"regions": [{"name": "x"}]}}, r"regions\[0\]\.criterion is missing"),
        ({"more": 1}, r"more: unknown key"),
    ],
)
def test_invalid_scene_keys_are_rejected_by_name(change, said):
    table = {"seed": 0, "kind": "mine", "scenario": SCENARIO} | change
    with pytest.raises(ScenarioError, match=said):
        scene_of(table)
