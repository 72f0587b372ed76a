"""Every function that user runs execute as C is shipped precompiled."""

import ctypes
import platform
import sys
from types import FunctionType

import numpy as np
import pytest

from controller import LAWS, FunctionLaw, VehicleState
from controller.compiling import function, library
from controller.laws.deployable.gains import DeployableGains
from controller.navigation import Navigator, SensorModel
from controller.regions import Sphere
from controller.regions.region_set import Region, clearances_at
from controller.translator.types import type_of
from cosim.batch.fused import FusedFlyer
from cosim.batch.shipped_functions import shipped_functions, shipped_texts, write_libraries, write_sources
from cosim.batch.variation import Variation
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import SceneFlyer
from cosim.campaigns.scenes.generator import generate_scenes
from cosim.campaigns.scenes.scene_file import read_scenes
from cosim.mavlink.vehicle.proximity import Proximity
from cosim.precheck.path_search import find_path
from cosim.precheck.stability import start_weights
from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master
from cosim.ssp.controller import controller_component
from plant_fmu import load_vehicle
from plant_fmu.build import cached_fmu

THROUGH_SENSORS = ["sensing.through=sensors", "sensing.position_noise=0.0", "sensing.velocity_noise=0.0"]
SHORT = ["time.duration=0.1", "arbiter.engine=closed"]


@pytest.fixture
def called(monkeypatch):
    """Functions with the types of their arguments, as they are bound."""
    found, bind = set(), function.BoundCall.__init__

    def noted(self, called, arguments, *known):
        if isinstance(called, FunctionType):
            found.add((called, tuple(map(type_of, arguments))))
        bind(self, called, arguments, *known)

    monkeypatch.setattr(function.BoundCall, "__init__", noted)
    return found


@pytest.mark.medium
def test_shipped_functions_are_exactly_those_called(called, tmp_path):
    for name in ("docking", "harbour", "pipe-inspection", "moving-obstacle"):
        scenario = load_scenario(name, ["time.duration=0.1"])
        with Master(scenario) as master:
            master.run()
        Proximity(scenario)
    with Master(load_scenario("pipe-inspection", ["time.duration=0.1", *THROUGH_SENSORS])) as master:
        master.run()
    (tmp_path / "scenes").write_text("\n".join(generate_scenes(1)))
    for scene in read_scenes(tmp_path / "scenes"):
        for law in LAWS:
            with SceneFlyer(law, Conditions(duration=0.1)) as flyer:
                flyer.fly(scene, trace=True)
    for law in ("ismail_dunnigan", "deployable"):
        variation = Variation(load_scenario("paper", [*SHORT, f"law.name={law}", "actuation.through=thrusters"]), ())
        with FusedFlyer(variation) as flyer:
            flyer.fly(np.zeros((1, 0)), np.zeros(1, np.int64))
    with Master(load_scenario("docking", ["time.duration=0.1", "commands.enabled=true"])) as master:
        master.measure_initial_state()
        master.run()
    state = VehicleState(np.zeros(3), np.zeros(4), np.zeros(6), np.ones(8), np.zeros(12))
    Navigator(SensorModel(), state).step(0.0)
    start_weights(load_scenario("paper"))
    with Master(load_scenario("paper", SHORT), FunctionLaw(lambda *_: np.zeros(6))) as master:
        master.run()
    controller = cached_fmu(controller_component(load_scenario("paper", SHORT)), 3)
    with Master(load_scenario("paper", [*SHORT, f"law.file={controller}"])) as master:
        master.run()
    plant = str(cached_fmu(load_vehicle("odin"), 3))
    others = {"components": [{"name": "twin", "file": plant}], "plant.file": plant, "master.order": "jacobi"}
    with Master(load_scenario("paper", SHORT).replace(others)) as master:
        master.run()
    find_path([], load_scenario("paper").goal_region, (0.0, 0.0, 0.0), DeployableGains(), 0.1)
    clearances_at(np.zeros((2, 3)), Region("ball", Sphere((0.0, 0.0, 0.0), 1.0), "out"))
    assert called == {(one, tuple(map(type_of, arguments))) for one, arguments in shipped_functions()}


def test_each_function_is_written_to_its_own_c_file(tmp_path):
    write_sources(tmp_path / "laws")
    names = {path.stem for path in (tmp_path / "laws").iterdir()}
    assert (
        names == set(shipped_texts()) and {"deployable_law_step", "score_fly", "one_step_advance", "arbiter"} <= names
    )


@pytest.mark.slow
@pytest.mark.timeout(1200)  # hundreds of compilations
@pytest.mark.parametrize("platforms", ["native", "all"])
def test_libraries_are_written_for_each_platform(tmp_path, platforms):
    if platforms == "all":
        pytest.importorskip("ziglang", reason="the build extra is not installed")
    write_libraries(platforms, tmp_path)
    n = len(shipped_texts())
    folders = sorted(folder.name for folder in tmp_path.iterdir())
    assert len(folders) == (1 if platforms == "native" else 5)
    for folder in folders:
        names = {path.name for path in (tmp_path / folder).iterdir()}
        assert len(names) == 2 * n and sum(name.endswith(".sha256") for name in names) == n
    if sys.platform == "linux" and platform.machine() == "x86_64":
        for path in (tmp_path / library._platform()).glob("*.so"):
            assert library.has_valid_checksum(path) and ctypes.CDLL(str(path)).entry
