"""The predictive controller of the benchmarks with a stub planner: its inputs and their timing."""

import json
import math

import msgspec
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks import nmpc, nmpc_search
from benchmarks.__main__ import main
from controller import LAWS
from controller.regions import Box, DepthBand, HalfSpace, Region, Sphere, pack
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.conflicts import make_conflict
from cosim.campaigns.scenes.flyer import SceneFlyer
from cosim.campaigns.scenes.generator import make_scene
from cosim.campaigns.scenes.scenario_scene import ScenarioScene
from cosim.campaigns.scenes.scene import Scene
from plant_fmu.vehicle import load_vehicle


@pytest.fixture
def planner(monkeypatch):
    """A planner that pulls down with every vertical thruster, and keeps what it is given."""

    class Planner:
        forces, given = [0.0] * 4 + [-3.0] * 4, []

        def exchange(self, line):
            self.given.append(json.loads(line))
            count = len(self.given)
            return {
                "forces": self.forces,
                "success": count % 2 == 0,
                "path": [[count, 0.0, 2.0]] * 12,
                "seconds": 0.001,
            }

    monkeypatch.setitem(LAWS, "nmpc", nmpc.NmpcLaw)
    monkeypatch.setattr(nmpc.NmpcLaw, "function", nmpc._Step(Planner()))
    return nmpc.NmpcLaw.function.process


@pytest.mark.medium
def test_planner_receives_law_inputs_at_10_hz_and_its_forces_are_held_between_plans(planner):
    scene = msgspec.convert(make_scene(7, "hard"), Scene)
    with SceneFlyer("nmpc", Conditions(duration=2.0)) as flyer:
        score, _ = flyer.fly(scene)
    assert len(planner.given) == 21 and len(nmpc.NmpcLaw.function.times) == 21  # the last one at the end
    assert [given["again"] for given in planner.given] == [True] + [False] * 20
    first, last = planner.given[0], planner.given[19]
    assert first["goal"] == pytest.approx(scene.goal.centre)
    shallowest, deepest = scene.depth_band
    assert first["hard"] == [
        [pytest.approx([0.0, 0.0, 1.0, shallowest])] * 12,
        [pytest.approx([0.0, 0.0, -1.0, -deepest])] * 12,
    ]
    assert first["soft"] == [] and np.array(first["vehicle"]["thrusters"]).shape == (6, 8)
    assert not any("vehicle" in given for given in planner.given[1:])
    for given, time in ((first, 0.0), (last, 1.9)):
        for ball, obstacle in zip(given["spheres"], scene.obstacles, strict=True):
            assert ball[:3] == pytest.approx(np.array(obstacle.centre) + time * np.array(obstacle.velocity))
            assert ball[3:] == pytest.approx([obstacle.radius, *obstacle.velocity])
    assert first["position"] == pytest.approx(scene.start, abs=0.1)
    assert not {"weight_minus_buoyancy", "current", "failed_thruster"} & set(first)
    assert nmpc.NmpcLaw.function.failures == 11
    assert score.effort == pytest.approx(4 * 3.0 * 2.0) and score.thrust_variation == pytest.approx(4 * 3.0)
    mass = 187.5
    disturbance = last["disturbance"][2] * mass
    assert disturbance == pytest.approx(scene.weight_minus_buoyancy, abs=0.25 * abs(scene.weight_minus_buoyancy) + 1.0)


@pytest.mark.medium
def test_lag_and_munk_moment_are_compensated_as_the_plant_has_them(planner):
    lag, vehicle = 0.15, load_vehicle("bluerov2_heavy")
    planner.forces = [10.0, 10.0, -10.0, -10.0, -11.0, -11.0, -1.0, -1.0]  # without a moment
    table = make_conflict(630005)["scenario"]
    assert table["vehicle"] == vehicle.name and table["plant"]["parameters"]["thrust_time_constant[1]"] == lag
    table |= {"sensing": {}, "regions": table["regions"][:1], "time": table["time"] | {"duration": 1.5}}
    table["plant"] |= {"current": [0.0, 0.0, 0.0]}
    table["plant"]["parameters"]["buoyancy"] = vehicle.buoyancy
    scene = ScenarioScene(1, "mine", table)
    with SceneFlyer("nmpc", Conditions(), nmpc.NmpcGains(lag=lag)) as flyer:
        _, trace = flyer.fly(scene, trace=True)
    assert len(planner.given) == 16
    early = int(lag / 0.02)  # control steps
    for i in (6, 9, 12):
        given, k = planner.given[i], 5 * i + early
        position, velocity = (
            np.mean([trace[f"{group}.{axis}"][k : k + 2] for axis in axes], axis=1)
            for group, axes in (("position", "xyz"), ("velocity", "uvw"))
        )
        assert given["position"] == pytest.approx(position, abs=0.02)
        assert given["velocity"] == pytest.approx(np.array(given["R"]) @ velocity, abs=0.06)
    given, (surge, heave, pitch_rate) = planner.given[12], (trace[f"velocity.{axis}"][60] for axis in "uwq")
    assert surge > 0.3 and heave > 0.15 and abs(pitch_rate) > 0.05  # no one controls the attitude here
    munk = (vehicle.mass_matrix[0, 0] - vehicle.mass_matrix[2, 2]) * surge * heave  # Fossen (2011), section 6.3
    assert given["hold"][1] == pytest.approx(munk, rel=0.3)  # the observer comes late


@pytest.mark.parametrize(("vehicle", "error", "at_last"), [("odin", 0.02, 0.02), ("bluerov2_heavy", 0.9, 0.01)])
def test_plans_predict_drag_as_an_integrator_does(vehicle, error, at_last):
    ca = pytest.importorskip("casadi")
    from benchmarks.peers import casadi_nmpc

    file, interval = load_vehicle(vehicle), nmpc.NmpcGains().interval
    mass, linear, quadratic = np.diag(file.mass_matrix)[:3], file.linear_damping[:3], file.quadratic_damping[:3]
    push, disturbance = np.array([100.0, 20.0, -30.0]), np.array([0.1, -0.2, 0.3])
    u = np.linalg.pinv(file.thruster_matrix) @ [*push, 0.0, 0.0, 0.0]
    known = {
        "R": np.eye(3), "interval": interval, "B": file.thruster_matrix, "inverse": np.diag(1.0 / mass),
        "linear": linear, "quadratic": quadratic, "disturbance": disturbance,
    }  # fmt: skip
    known = {name: ca.DM(np.asarray(value)) for name, value in known.items()}

    def rates(_, x):
        return [*x[3:], *((push - (linear + quadratic * np.abs(x[3:])) * x[3:]) / mass + disturbance)]

    x = exact = np.array([0.0, 0.0, 4.0, 0.0, 0.3, 1.0])
    for _ in range(12):  # from rest, the first stage of a BlueROV2 comes out too fast
        x = np.array(casadi_nmpc._next(ca.DM(x), ca.DM(u), known)).ravel()
        exact = solve_ivp(rates, (0.0, interval), exact, rtol=1e-9).y[:, -1]
        assert x[3:] == pytest.approx(exact[3:], abs=error)
    assert x[3:] == pytest.approx(exact[3:], abs=at_last)


def test_spheres_and_depths_constrain_exactly_and_other_regions_by_tangents_along_the_path():
    regions = pack(
        [
            Region("rock", Sphere((1.0, 2.0, 3.0), 0.5), "out", velocity=(0.1, 0.0, 0.0)),
            Region("band", DepthBand(3.0, 2.0), "in"),
            Region("face", HalfSpace((0.0, 0.0, 1.0), (0.0, 0.0, 1.0)), "out", velocity=(0.0, 0.0, 0.2)),
            Region("wall", Box((5.0, 0.0, 3.0), (1.0, 4.0, 4.0)), "out", hard=False),
        ]
    )
    path = np.array([[2.0, 0.1, 3.0], [4.7, 0.1, 3.0]])
    found = nmpc.constraints(regions, path, 0.5)
    assert found["spheres"] == [[1.0, 2.0, 3.0, 0.5, 0.1, 0.0, 0.0]]
    least, most, face = (np.array(rows) for rows in found["hard"])
    assert least == pytest.approx(np.array([[0.0, 0.0, 1.0, 1.0]] * 2))
    assert most == pytest.approx(np.array([[0.0, 0.0, -1.0, -5.0]] * 2))
    # a point must be on the far side of the face, which is at 1.1 m after half a second, then at 1.2 m
    side = face[0, 2]
    assert abs(side) == 1.0 and side * face[:, 3] == pytest.approx([1.1, 1.2])
    # before the wall, and within it: north of 4.5 m is excluded
    assert np.array(found["soft"][0]) == pytest.approx(np.array([[-1.0, 0.0, 0.0, -4.5]] * 2))


@pytest.mark.medium
def test_tangents_follow_the_path_of_the_plan_before(monkeypatch, planner):
    paths = []
    monkeypatch.setattr(nmpc, "constraints", lambda regions, path, interval: paths.append(path.copy()) or {})
    with SceneFlyer("nmpc", Conditions(duration=0.3)) as flyer:
        flyer.fly(msgspec.convert(make_scene(7, "plain"), Scene))
    assert (paths[0] == paths[0][0]).all()
    assert [path[0, 0] for path in paths[1:]] == [1.0, 2.0, 3.0]


class Flown:
    """In place of flights: safe where the margin is, fast where the forces are cheap."""

    def __init__(self):
        self.count = 0

    def fly(self, gains, kind, seed, longer):
        self.count += 1
        time = 11.0 + 3.0 * abs(math.log(gains.w_u / 0.3)) + 0.1 * (seed % 3)
        score = nmpc_search.Score(True, time, gains.margin - 0.08, 1.0, 1.0, 0.0, -1)
        return nmpc_search.Flight(score, [1.0], 0)


def test_the_search_finds_fast_settings_among_safe_ones():
    flights = Flown()
    found = nmpc_search.search(flights, 60, 0)
    assert found.outcome.violations == 0 and found.gains.margin >= 0.08 and found.gains.stages in nmpc_search.STAGES
    assert found.gains.w_u == pytest.approx(0.3, rel=0.15)
    assert flights.count < 0.7 * 60 * nmpc_search.SCENES
    assert nmpc_search.search(Flown(), 60, 0).gains == found.gains


@pytest.mark.medium
def test_flights_in_the_file_are_not_flown_again(monkeypatch, tmp_path, planner):
    started = []

    def choose(self, *what):
        started.append(what)
        nmpc.NmpcLaw.function = nmpc._Step(planner)

    monkeypatch.setattr(nmpc.Planners, "choose", choose)
    monkeypatch.setattr(nmpc_search, "DURATION", 0.2)
    path = tmp_path / "flights.jsonl"
    gains = nmpc.NmpcGains()
    flown = nmpc_search.Flights(None, path).fly(gains, "plain", 3, 0.4)
    assert started == [(12, True)] * 2  # not settled after 0.2 s
    again = nmpc_search.Flights(None, path)
    assert repr(again.fly(gains, "plain", 3, 0.4)) == repr(flown) and len(flown.times) == 5  # NaN is in it
    assert len(started) == 2 and len(path.read_text().splitlines()) == 2
    again.fly(gains._replace(margin=0.2), "plain", 3, 0.4)
    assert len(started) == 4


def test_unknown_kind_is_rejected(capsys):
    with pytest.raises(SystemExit):
        main(["nmpc", "tour"])
    assert "'tour'" in capsys.readouterr().err
