"""Controller and arbiter as separate FMUs, against the Python law, regions and arbiter."""

import ctypes
import logging
import re
from pathlib import Path
from typing import NamedTuple

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave

from controller import LAWS, LawError
from controller.potential_field import Field
from cosim.scenario.scenario import load_scenario
from cosim.ssp import arbiter_component, controller_component
from cosim.ssp.loop import Loop
from cosim.ssp.system import MOTION, WRENCH
from examples.laws.sliding_mode import SlidingModeLaw
from fuzzy_arbiter import Arbiter
from plant_fmu import PlantError, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.checking.check import check_fmu
from plant_fmu.running.co_simulation_instance import CoSimulationInstance
from plant_fmu.vehicle_component import make_vehicle_component
from tests.cosim.ssp.jacobi import Parts
from tests.cosim.ssp.noise import Noise
from tests.plant_fmu.importers import installed

ALL_SHAPES = Path(__file__).parent / "all-shapes.toml"
STEP = 0.01


@pytest.fixture(scope="module", params=[2, pytest.param(3, marks=pytest.mark.slow)], ids=["fmi2", "fmi3"])
def fmi(request):
    return request.param


@pytest.fixture(scope="module")
def scenario():
    return load_scenario(ALL_SHAPES)


@pytest.fixture
def controller(scenario, fmi):
    with CoSimulationInstance(cached_fmu(controller_component(scenario), fmi)) as slave:
        yield slave


@pytest.fixture
def arbiter(scenario, fmi):
    with CoSimulationInstance(cached_fmu(arbiter_component(scenario), fmi)) as slave:
        yield slave


def send(slave, names, values):
    slave.inputs.values[[slave.inputs.names.index(name) for name in names]] = values


def read(slave, beginning):
    return np.array([x for x, name in zip(slave.outputs.values, slave.outputs.names, strict=True) if beginning in name])


def random_motion(rng):
    quaternion = rng.normal(size=4)
    return np.concatenate([
        rng.uniform(-5.0, 9.0, 3), quaternion / np.linalg.norm(quaternion), rng.normal(size=6) * 0.5,
    ])  # fmt: skip


def assert_step(slave, parts, k, motion, weights):
    slave.step(STEP)
    wrench, memberships, estimate, values, clearances = parts.control(k, motion, weights)
    np.testing.assert_allclose(read(slave, "wrench."), wrench, rtol=1e-12, atol=1e-12 * max(1.0, abs(wrench).max()))
    np.testing.assert_allclose(read(slave, "membership."), memberships, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(read(slave, "estimate."), estimate, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(read(slave, ".value"), values, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(read(slave, ".clearance"), clearances, rtol=1e-12, atol=1e-12)


@pytest.mark.medium
def test_controller_is_the_python_law_over_random_inputs(controller, scenario):
    """Every shape, regions on the move, a law at every third step, an estimate that is carried on."""
    rng, parts = np.random.default_rng(4), Parts(scenario)
    controller.initialize()
    assert not controller.outputs.values.any()  # before the first step there is nothing
    for k in range(600):
        motion, weights = random_motion(rng), rng.uniform(0.0, 1.0, 3)
        send(controller, MOTION, motion)
        send(controller, ["weight.obstacle", "weight.shape", "weight.depth"], weights)
        assert_step(controller, parts, k, motion, weights)
    assert abs(read(controller, "estimate.")).min() > 0.01


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("seed", [0, 7, 2**31 - 1, 2**31 + 7])
def test_noise_of_the_controller_is_philox(seed, fmi):
    """White from tick to tick of the law, which comes at every third step."""
    noisy = load_scenario(
        ALL_SHAPES, ["sensing.position_noise=0.02", "sensing.velocity_noise=0.01", f"sensing.seed={seed}"]
    )
    drawn, parts, rng = Noise(seed), Parts(noisy), np.random.default_rng(8)
    with CoSimulationInstance(cached_fmu(controller_component(noisy), fmi)) as slave:
        slave.initialize()
        for k in range(30):
            if k % noisy.control_every == 0:
                noise = np.repeat([0.02, 0.01], 3) * drawn.standard_normal(6)
            motion = random_motion(rng)
            send(slave, MOTION, motion)
            motion[[0, 1, 2, 7, 8, 9]] += noise
            assert_step(slave, parts, k, motion, np.zeros(3))


def test_controller_uses_the_initial_state_while_inputs_are_zero(controller, scenario):
    controller.initialize()
    initial = scenario.initial
    start = np.array([*initial.position, *initial.quaternion, *initial.velocity])
    assert_step(controller, Parts(scenario), 0, start, np.zeros(3))
    assert abs(read(controller, "wrench.")).max() > 1.0


def test_controller_reads_a_quaternion_of_zeros_as_identity(controller, scenario):
    controller.initialize()
    motion = np.zeros(13)
    motion[0] = 1.5
    send(controller, MOTION, motion)
    motion[3] = 1.0
    assert_step(controller, Parts(scenario), 0, motion, np.zeros(3))


def test_numbers_of_the_scenario_are_parameters(controller):
    """Those of another scenario, set one by one, make the controller that scenario's."""
    changes = [
        "law.gains.k_p1=30.0", "law.gains.gamma=1.0", "arbiter.ramp=0.3", "regions.ball.gain=77.0",
        "regions.ball.shape.radius=0.9", "regions.line.shape.radius=0.5", "initial.position=[1.0, 1.0, 2.0]",
        "goal.velocity=[0.4, 0.0, 0.0]", "regions.ball.velocity=[0.5, 0.0, -0.05]",
    ]  # fmt: skip
    other = load_scenario(ALL_SHAPES, changes)
    controller.set({
        "law.gains.k_p1": 30.0, "law.gains.gamma": 1.0, "arbiter.ramp": 0.3, "regions.ball.gain": 77.0,
        "regions.ball.shape.radius": 0.9, "regions.line.shape.radius": 0.5,
        "start.position.x": 1.0, "start.position.y": 1.0, "start.position.z": 2.0,
        "goal.velocity.x": 0.4, "regions.ball.velocity.x": 0.5,
    })  # fmt: skip
    controller.initialize()
    initial, parts = other.initial, Parts(other)
    start = np.array([*initial.position, *initial.quaternion, *initial.velocity])
    for k in range(4):  # regions move from the second step on
        assert_step(controller, parts, k, start, np.zeros(3))


class FixedAttitude(SlidingModeLaw):
    """A law whose attitude is not in its memory."""

    desired_quaternion = np.array([1.0, 0.0, 0.0, 0.0])


def with_law(monkeypatch, law):
    monkeypatch.setattr(law, "name", "own", raising=False)
    monkeypatch.setitem(LAWS, "own", law)
    return load_scenario(ALL_SHAPES, ["law.name='own'", "law.gains={}"])


class PlainMemory(NamedTuple):
    desired_quaternion: np.ndarray
    estimate: np.ndarray
    report: np.ndarray
    field: Field


class PlainLaw(SlidingModeLaw):
    """A law whose memory is a named tuple of arrays, without a period."""

    @classmethod
    def make_memory(cls, desired_quaternion, period, n_regions):
        assert period.shape == (1,)
        return PlainMemory(desired_quaternion, np.zeros(4), np.zeros(0), Field(n=n_regions))


@pytest.mark.medium
@pytest.mark.parametrize("law", [SlidingModeLaw, PlainLaw])
def test_law_of_ones_own_needs_no_state_and_no_period_in_its_memory(law, fmi, monkeypatch):
    own = with_law(monkeypatch, law)
    rng, parts = np.random.default_rng(5), Parts(own)
    with CoSimulationInstance(cached_fmu(controller_component(own), fmi)) as slave:
        slave.initialize()
        for k in range(9):
            motion = random_motion(rng)
            send(slave, MOTION, motion)
            assert_step(slave, parts, k, motion, np.zeros(3))


def test_law_without_an_attitude_in_its_memory_is_refused(monkeypatch):
    with pytest.raises(LawError, match="law own: desired_quaternion is not in its memory"):
        controller_component(with_law(monkeypatch, FixedAttitude))


@pytest.mark.parametrize("law", LAWS)
def test_no_array_is_both_a_variable_and_a_constant(law):
    memory = Loop(load_scenario("docking", [f"law.name={law}"])).memory
    variables = [array for pool in memory._pools.values() for array in pool]
    assert memory._constant_arrays and not [
        a for a in memory._constant_arrays for v in variables if np.shares_memory(a, v)
    ]


@pytest.mark.medium(fast=3)
@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"regions.drum.shape.axis.x": 0.9}, "regions.drum: axis is not of length 1"),
        ({"regions._3_box.shape.rotation[1,1]": 0.5}, "regions._3_box: rotation is no rotation matrix"),
        ({"regions.wreck.shape.top": 4.0}, "regions.wreck: bottom is not above top"),
        ({"regions.view.shape.sine": 0.9}, "regions.view: sine and cosine are of no angle"),
        ({"law.desired_quaternion.e0": 0.0}, "law.desired_quaternion is not of length 1"),
        ({"start.quaternion.e0": 0.0}, "start.quaternion is not of length 1"),
    ],
)
def test_invalid_shape_parameters_are_rejected(controller, values, said):
    controller.set(values)
    with pytest.raises(PlantError, match=re.escape(said)):
        controller.initialize()


def test_parameter_ranges_are_enforced(controller):
    for name, value in (("regions.ball.shape.radius", 0.0), ("law.gains.gamma", 0.0), ("law.gains.k_p2", -1.0)):
        with pytest.raises(PlantError, match=re.escape(f"{name} = {value:g} refused")):
            controller.set({name: value})


@pytest.mark.medium
def test_steps_longer_than_a_period_are_refused(controller, arbiter):
    controller.initialize()
    with pytest.raises(PlantError, match=re.escape("step of 0.04 s is longer than time.control = 0.03 s")):
        controller.step(0.04)
    arbiter.initialize()
    with pytest.raises(PlantError, match=re.escape("step of 0.04 s is longer than time.arbiter = 0.02 s")):
        arbiter.step(0.04)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    ("steps", "said"),
    [
        ([0.02] * 20, ["the law runs at t = 0.04 s, 0.01 s late: steps do not divide time.control = 0.03 s"]),  # once
        ([0.01] * 400, []),
        ([0.02, 0.01] * 200, []),  # no two alike, yet each period ends with one
        ([0.03 / 7] * 700, []),
    ],
)
def test_steps_that_do_not_divide_the_period_are_warned_about(controller, steps, said, caplog):
    controller.initialize()
    with caplog.at_level(logging.DEBUG, "plant_fmu"):
        for step in steps:
            controller.step(step)
    assert [r.message.removeprefix("FMU: ") for r in caplog.records if "late" in r.message] == said


@pytest.mark.medium
def test_steps_that_do_not_divide_the_arbiter_period_are_warned_about(arbiter, caplog):
    arbiter.initialize()
    with caplog.at_level(logging.DEBUG, "plant_fmu"):
        for _ in range(9):
            arbiter.step(0.015)
    said = "FMU: the arbiter runs at t = 0.03 s, 0.01 s late: steps do not divide time.arbiter = 0.02 s"
    assert [r.message for r in caplog.records if "late" in r.message] == [said]


def test_periods_are_counted_not_summed(arbiter):
    """Steps whose sum is no multiple of the period, to the last bit: still one tick at every second one."""
    closed, expected = Arbiter(engine="closed"), 0.0
    arbiter.initialize()
    for k in range(20_000):
        arbiter.inputs.values[0] = membership = k % 7 / 10.0
        arbiter.step(STEP)
        if k % 2 == 0:
            expected = closed([membership, 0.0, 0.0])[0]
        assert arbiter.outputs.values[0] == pytest.approx(expected, abs=1e-15)


@pytest.mark.medium
def test_arbiter_is_the_python_one_over_random_inputs(arbiter):
    closed, rng = Arbiter(engine="closed"), np.random.default_rng(5)
    arbiter.set({"time.arbiter": STEP})
    arbiter.initialize()
    assert not arbiter.outputs.values.any()
    corners = np.array(np.meshgrid(*[[0.0, 0.25, 0.5, 1.0]] * 3)).reshape(3, -1).T
    for memberships in np.concatenate([corners, rng.uniform(0.0, 1.0, (500, 3))]):
        arbiter.inputs.values[:] = memberships
        arbiter.step(STEP)
        np.testing.assert_allclose(arbiter.outputs.values, closed(memberships.tolist()), rtol=0.0, atol=1e-15)


@pytest.mark.medium
def test_restored_controller_continues_identically(scenario, fmi):
    """Memory and counts are part of the FMU's state, and pass through bytes."""
    from plant_fmu import Plant

    rng = np.random.default_rng(6)
    with Plant(cached_fmu(controller_component(scenario), fmi)) as unit:
        unit.initialize()

        def go(motions):
            rows = []
            for motion in motions:
                unit.inputs.values[:13] = motion
                unit.step(STEP)
                rows.append(unit.outputs.values.copy())
            return np.array(rows)

        go([random_motion(rng) for _ in range(10)])
        state, motions = unit.save(), [random_motion(rng) for _ in range(10)]
        once = go(motions)
        unit.restore(state)
        np.testing.assert_array_equal(go(motions), once)


@pytest.mark.medium
def test_fmpy_matches_own_stepping(scenario):
    """By name and one by one, as any importer does."""
    path = cached_fmu(controller_component(scenario), 2)
    description, folder = fmpy.read_model_description(str(path)), fmpy.extract(str(path))
    references = {v.name: v.valueReference for v in description.modelVariables}
    unit = FMU2Slave(
        guid=description.guid, unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier, instanceName="c",
    )  # fmt: skip
    unit.instantiate()
    unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    rng, parts, time = np.random.default_rng(7), Parts(scenario), 0.0
    for k in range(20):
        motion = random_motion(rng)
        unit.setReal([references[name] for name in MOTION], motion.tolist())
        unit.doStep(currentCommunicationPoint=time, communicationStepSize=STEP)
        time += STEP
        expected = parts.control(k, motion, np.zeros(3))[0]
        got = unit.getReal([references[name] for name in WRENCH])
        np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-9)
    unit.terminate()
    unit.freeInstance()


@pytest.mark.medium
def test_components_offer_co_simulation_only(scenario):
    path = cached_fmu(controller_component(scenario), 3)
    description = fmpy.read_model_description(str(path))
    assert description.modelExchange is None and description.coSimulation is not None
    assert description.numberOfContinuousStates == 0
    folder = fmpy.extract(str(path))
    (library,) = Path(folder, "binaries").glob("*/*")
    instantiate = ctypes.CDLL(str(library))["fmi3InstantiateModelExchange"]
    instantiate.restype = ctypes.c_void_p
    token = description.guid.encode()
    assert instantiate(b"c", token, None, False, False, None, None) is None


@pytest.mark.parametrize("make", [controller_component, arbiter_component])
def test_sources_are_complete_and_hold_no_python(scenario, fmi, make, tmp_path):
    fmpy.extract(str(cached_fmu(make(scenario), fmi)), str(tmp_path))
    files = [path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file()]
    assert not [path for path in files if path.suffix in (".py", ".pyc")]
    texts = {path.name: (tmp_path / path).read_text() for path in files if path.parts[0] == "sources"}
    included = {name for text in texts.values() for name in re.findall(r'#include "(.+)"', text)}
    assert included - set(texts) == {f"fmi{fmi}Functions.h"}
    page = (tmp_path / "documentation" / "index.html").read_text()
    assert "Variables" in page and "{{" not in page


@pytest.mark.slow
@pytest.mark.parametrize("make", [controller_component, arbiter_component])
def test_every_importer_accepts_the_components(scenario, fmi, make):
    results = check_fmu(cached_fmu(make(scenario), fmi), importers=installed())
    for result in results:
        assert result.status != "failed", (result.importer, result.note)
    assert sum(result.status == "ok" for result in results) >= 3


# Modelica 3.6, section 2.3.3
KEYWORDS = re.findall(
    r"\w+",
    """algorithm and annotation block break class connect connector constant constrainedby der discrete each else elseif
    elsewhen encapsulated end enumeration equation expandable extends external false final flow for function if import
    impure in initial inner input loop model not operator or outer output package parameter partial protected public
    pure record redeclare replaceable return stream then true type when while within""",
)


@pytest.mark.parametrize("name", ["paper", "docking", "depth-transit"])
def test_no_name_has_a_keyword_of_modelica(name):
    scenario, vehicle = load_scenario(name), load_vehicle("odin")
    plants = [make_vehicle_component(vehicle, coupled=True, arrays=arrays) for arrays in (False, True)]
    names = [
        v.name for c in (*plants, controller_component(scenario), arbiter_component(scenario)) for v in c.variables
    ]
    parts = {part for name in names for part in re.split(r"[^\w]+", name.removeprefix("der"))}
    assert not parts.intersection(KEYWORDS)


def test_former_names_of_the_start_are_read(controller):
    controller.set({"initial.position.x": 0.25})
    controller.initialize()
    assert controller["start.position.x"] == 0.25
