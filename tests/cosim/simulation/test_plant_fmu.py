"""An FMU of the user's as the plant: the vehicle's own has its bits; a puck of C, with angles and velocity in NED."""

import numpy as np
import pytest

from controller import FunctionLaw
from cosim import Master, check_scenario, load_run, load_scenario, run_scenario
from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.command_line.cli import main
from cosim.errors import ScenarioError
from plant_fmu import PlantError, load_vehicle
from plant_fmu.build import cached_fmu
from tests.cosim.simulation.keep import Keep, kept_rows
from tests.foreign_fmu import MODES, PARAMETERS, build_foreign_fmu

TIMES = ["time.duration=3", "time.step=0.01", "time.control=0.01", "time.arbiter=0.01", "arbiter.engine=closed"]
STATE = [
    *(f"position.{axis}" for axis in "xyz"), *(f"attitude.{angle}" for angle in ("roll", "pitch", "yaw")),
    *(f"velocity.{axis}" for axis in "xyzpqr"),
]  # fmt: skip
WRENCH = [f"wrench.{axis}" for axis in "XYZKMN"]
INITIAL = {f"start_{axis}": f"position.{axis}" for axis in "xyz"}
MASS = 100.0


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def fmi(request):
    return request.param


@pytest.fixture(scope="module")
def fmus(once):
    def make(folder):
        for fmi in (2, 3):
            names = {"inputs": WRENCH, "outputs": STATE}
            build_foreign_fmu(
                folder / f"puck{fmi}.fmu", fmi, parameters=PARAMETERS | {name: 3 + i for i, name in enumerate(INITIAL)},
                inputs={name: 10 + i for i, name in enumerate(names["inputs"])},
                outputs={name: 40 + i for i, name in enumerate(names["outputs"])},
            )  # fmt: skip

    return once("pucks", make)


def puck(fmus, fmi, changes=(), **plant):
    given = {"mode": MODES.index("puck"), "gain": MASS}
    table = {"file": str(fmus / f"puck{fmi}.fmu"), "initial": INITIAL, "parameters": given} | plant
    return (
        load_scenario("paper", [*TIMES, "law.name=pd", *changes]).replace({"plant.file": ""}).replace({"plant": table})
    )


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("through", ["wrench", "thrusters"])
def test_plant_of_the_vehicle_has_its_own_bits(fmi, through):
    """With equal names, and no maps."""
    changes = [*TIMES, f"actuation.through={through}"]
    own = load_scenario("paper", changes)
    path = cached_fmu(load_vehicle("odin"), fmi)
    foreign = load_scenario("paper", [*changes, f"plant.file={path}", "plant.parameters.substep=0.005"])
    one, other = kept_rows(own), kept_rows(foreign)
    for column in one.signals.columns:
        if not column.name.endswith("_saturated") and not column.name.startswith("thrust_saturated"):
            np.testing.assert_array_equal(one[column.name], other[column.name], column.name)
    with (
        FusedFlyer(Variation(own, ["initial.position.1"])) as a,
        FusedFlyer(Variation(foreign, ["initial.position.1"])) as b,
    ):
        values = np.array([[0.0], [1.0], [0.0]])
        flown = [flyer.fly(values, np.zeros(3, np.int64)) for flyer in (a, b)]
    assert not flown[1].refused
    for field in flown[0].outcomes.dtype.names:
        np.testing.assert_allclose(flown[1].outcomes[field], flown[0].outcomes[field], rtol=1e-12, err_msg=field)


def test_angles_and_ned_velocity_become_quaternion_and_body_velocity(fmus, fmi):
    """Under a constant force and moment, by the formula of its steps."""
    wrench, step = np.array([20.0, -10.0, 5.0, 0.0, 0.0, 30.0]), 0.01
    with Master(puck(fmus, fmi, ["initial.position=[0,0,2]"]), FunctionLaw(lambda *_: wrench)) as master:
        run = Keep(master)
        master.run([run])
    n = len(run.rows)
    k = np.arange(n)
    rate = k * step * 0.3
    yaw = np.cumsum(np.r_[0.0, rate[1:]]) * step
    force = np.exp(1j * yaw) * (wrench[0] + 1j * wrench[1])
    speed = np.r_[0.0, np.cumsum(force)[:-1]] * step / MASS
    where = np.cumsum(speed) * step
    np.testing.assert_allclose(run["position.x"] + 1j * run["position.y"], where, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(run["velocity.u"] + 1j * run["velocity.v"], speed * np.exp(-1j * yaw), atol=1e-12)
    np.testing.assert_allclose(run["quaternion.e0"] + 1j * run["quaternion.e3"], np.exp(0.5j * yaw), atol=1e-12)
    np.testing.assert_allclose(run["velocity.r"], rate, atol=1e-12)
    np.testing.assert_allclose(run["measured.heading"], yaw, atol=1e-12)
    np.testing.assert_array_equal(run["actuation.X"][:-1], np.full(n - 1, 20.0))
    assert np.isnan(run["water_velocity.x"]).all() and "plant.position.x" in run.signals


@pytest.mark.medium
def test_run_with_report_replay_and_link(fmus, fmi, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = run_scenario(puck(fmus, fmi), tmp_path / "run")
    assert {path.name for path in run.folder.iterdir()} >= {"report.html", "replay.html", f"puck{fmi}.fmu"}
    again = run_scenario(tmp_path / "run" / "scenario.toml", tmp_path / "again", report=False)
    np.testing.assert_array_equal(run.record["position.x"], again.record["position.x"])
    link = ["--mavlink", "udpout:127.0.0.1:9", "--commands", "--out", "linked"]
    assert main(["run", "run/scenario.toml", *link]) == 0
    for kind in ("csv", "tlog"):
        assert main(["export", "run", "--to", kind, "--out", f"it.{kind}"]) == 0


@pytest.mark.medium(fast=6)
@pytest.mark.parametrize(
    ("plant", "changes", "words"),
    [
        (
            {"outputs": {"velocity.p": "velocity.q"}},
            [],
            "no output of puck3.fmu is velocity.p, expected velocity.p to velocity.r",
        ),
        ({"file": "none.fmu"}, [], "plant.file: none.fmu: No such file"),
        ({"inputs": dict.fromkeys(WRENCH, "time")}, [], "wrench.X of .* expected|receives the forces"),
        ({}, ["actuation.through=thrusters"], "no input of puck3.fmu receives the forces of actuation.through"),
        ({"initial": {}}, ["initial.position=[1,0,2]"], r"initial.position: puck3.fmu starts at position.x = 0"),
        ({"initial": {"start_x": "position.q"}}, [], "plant.initial.start_x is 'position.q', expected one of"),
        ({"initial": {"wrench.X": "position.x"}}, [], "wrench.X of puck3.fmu cannot be set, expected a parameter"),
        ({"parameters": {"mass": 1.0}}, [], "plant.parameters: FMU variable 'mass' is unknown"),
        ({"current": [0.1, 0.0, 0.0]}, [], r"plant.current is .*, expected its default with plant.file"),
        ({"outputs": {"position.x": "nothing"}}, [], "is no pose, velocity or other output"),
        ({}, ["limit.force=100"], "limit.force is 100.0, expected its default with plant.file"),
        ({}, ["sensing.through=sensors"], "sensing.through is 'sensors', expected its default"),
        ({}, ["initial.quaternion=[0,1,0,0]"], "initial.quaternion: puck3.fmu starts at quaternion.e0 = 1"),
    ],
)
def test_what_does_not_fit_is_refused(fmus, plant, changes, words):
    with pytest.raises(ScenarioError, match=words):
        Master(puck(fmus, 3, changes, **plant)).close()


@pytest.mark.medium(fast=1)
def test_failures_name_it_and_keep_the_record(fmus, fmi, tmp_path):
    given = {"mode": MODES.index("nan"), "at": 1.0, "gain": MASS}
    failing = {"position.x": 20}
    build_foreign_fmu(
        tmp_path / f"puck{fmi}.fmu", fmi, inputs={name: 10 + i for i, name in enumerate(WRENCH)},
        outputs={name: 40 + i for i, name in enumerate(STATE)} | failing,
    )  # fmt: skip
    scenario = puck(tmp_path, fmi, ["initial.position=[0,0,0]"], initial={}, parameters=given)
    with pytest.raises(PlantError, match=rf"puck{fmi}.fmu: t = 1 s: position.x is nan, expected a finite number"):
        run_scenario(scenario, tmp_path / "run", report=False)
    assert load_run(tmp_path / "run").record["time"][-1] == pytest.approx(0.99)


def test_check_and_what_needs_the_own_plant(fmus, tmp_path, capsys):
    scenario = puck(fmus, 3)
    found = [finding for finding in check_scenario(scenario).findings if finding.topic == "components"]
    assert [finding.status for finding in found] == ["holds", "holds"] and found[0].name == "plant"
    (tmp_path / "it.toml").write_text(scenario.toml(), encoding="utf-8")
    assert main(["export", str(tmp_path / "it.toml"), "--to", "ssp", "--out", str(tmp_path / "it.ssp")]) == 2
    assert "plant.file is given, expected none in a system of FMUs" in capsys.readouterr().err
    assert main(["sitl", "--scenario", str(tmp_path / "it.toml")]) == 2
    assert "plant.file is set, expected none" in capsys.readouterr().err
