"""The compiled loop against the master, its score against formulas, and reuse of a plant."""

import ctypes
import math
import signal
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from controller import LAWS, IsmailDunniganLaw
from cosim.campaigns.scenes.as_scenario import scene_scenario
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import SceneFlyer
from cosim.campaigns.scenes.scene import Failure, Obstacle, SphereSpec
from cosim.campaigns.scenes.scene_file import read_scenes
from cosim.errors import RunError, ScenarioError
from cosim.scenario.tables import Outage
from cosim.step.plant_calls import Clock, fmi_do_step, seconds
from plant_fmu import PlantError
from plant_fmu.running.native import Native
from tests.cosim.batch.test_fused import assert_same_signals
from tests.cosim.simulation.keep import kept_rows

SCENES = Path(__file__).parents[2] / "data" / "scenes"
PLAIN, HARD = (list(read_scenes(SCENES / f"{kind}.jsonl")) for kind in ("plain", "hard"))
SHORT = Conditions(duration=8.0)


@pytest.fixture(scope="module")
def flyer():
    with SceneFlyer("ismail_dunnigan", SHORT) as flyer:
        yield flyer


def distances(scene, positions, step):
    """Clearance of each instant from formulas of its own: spheres that drift, and a band of depths."""
    time = np.arange(len(positions))[:, None] * step
    of = [
        np.linalg.norm(positions - (np.array(o.centre) + time * np.array(o.velocity)), axis=1) - o.radius
        for o in scene.obstacles
    ]
    shallow, deep = scene.depth_band
    return np.min([*of, positions[:, 2] - shallow, deep - positions[:, 2]], axis=0)


def stacked(kept, form, names):
    return np.column_stack([kept[form.format(name)] for name in names])


OTHERS = [pytest.param(law, {}, marks=pytest.mark.slow) for law in sorted(LAWS) if law != "ismail_dunnigan"]
REPORTED = {"report_failures": True}
ON_SENSORS = {"sensing": "sensors", "outages": (Outage("dvl", 2.0, 3.0),)}


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("scene", [PLAIN[0], HARD[1]], ids=["plain", "hard"])
@pytest.mark.parametrize(
    ("law", "changes"),
    [
        ("ismail_dunnigan", {}),
        *OTHERS,
        *(pytest.param("deployable", changes, marks=pytest.mark.slow) for changes in (REPORTED, ON_SENSORS)),
    ],
)
def test_compiled_loop_equals_the_master_and_its_score_follows_from_the_flight(law, changes, scene):
    if scene.failed_thruster:
        scene = replace(scene, failed_thruster=Failure(scene.failed_thruster.index, 3.01))
    conditions = replace(SHORT, **changes)
    with SceneFlyer(law, conditions) as flyer:
        score, trace = flyer.fly(scene, trace=True)
        kept = kept_rows(scene_scenario(scene, law, flyer.gains, conditions))
    path, commands = stacked(kept, "position.{}", "xyz"), stacked(kept, "thrust[{}]", range(1, 9))[:-1:2]
    assert_same_signals(trace, kept, scene_scenario(scene, law, flyer.gains, conditions))
    forces = stacked(kept, "thruster_force[{}]", range(1, 9))
    assert score.effort == pytest.approx(np.abs(forces[:-1]).sum() * 0.01, rel=1e-9)
    assert score.thrust_variation == pytest.approx(np.abs(np.diff(commands, axis=0, prepend=0.0)).sum(), rel=1e-9)
    assert score.min_clearance == pytest.approx(distances(scene, path, 0.01).min(), abs=1e-12)
    assert score.failed_step == -1 and score.worst_step > 0.0


def test_reused_plant_gives_the_same_run_as_a_new_one(flyer):
    flyer.fly(HARD[2])
    again, trace = flyer.fly(HARD[0], trace=True)
    with SceneFlyer("ismail_dunnigan", SHORT) as new:
        fresh, expected = new.fly(HARD[0], trace=True)
    np.testing.assert_array_equal(trace.to_array(), expected.to_array())
    assert again._replace(worst_step=0.0) == fresh._replace(worst_step=0.0)


def test_reached_requires_a_final_stay_and_reach_time_is_its_start(flyer):
    around = replace(PLAIN[0], goal=SphereSpec(PLAIN[0].start, 50.0))  # it starts inside and never leaves
    score, _ = flyer.fly(around)
    assert score.reach_time == 0.0 and not score.reached  # 8 s are less than 10
    with SceneFlyer("ismail_dunnigan", replace(SHORT, settled=8.0)) as patient:
        assert patient.fly(around)[0].reached
    with SceneFlyer("ismail_dunnigan", replace(SHORT, settled=8.001)) as impatient:
        assert not impatient.fly(around)[0].reached


def test_reach_time_is_the_first_instant_of_the_stay(flyer):
    scene = replace(PLAIN[0], goal=SphereSpec(PLAIN[0].goal.centre, 9.0), obstacles=PLAIN[0].obstacles[:1])
    score, _ = flyer.fly(scene)
    positions = stacked(kept_rows(scene_scenario(scene, "ismail_dunnigan", flyer.gains, SHORT)), "position.{}", "xyz")
    outside = np.linalg.norm(positions - np.array(scene.goal.centre), axis=1) > 9.0
    assert outside[0] and not outside[-1]
    assert score.reach_time == pytest.approx((np.flatnonzero(outside)[-1] + 1) * 0.01, abs=1e-9)


def test_initial_state_is_scored(flyer):
    x, y, z = PLAIN[0].start
    gone_at_once = Obstacle((x + 0.5, y, z), 0.4, velocity=(1000.0, 0.0, 0.0))
    scene = replace(PLAIN[0], depth_band=(-90.0, 90.0), obstacles=(gone_at_once,))
    assert flyer.fly(scene)[0].min_clearance == pytest.approx(0.1, abs=1e-12)


# ---- what fails ----


class _GivesUp:
    """A step that Python runs: what is no plain function is not translated."""

    def __call__(self, state, goal, regions, weights, gains, memory, forces):
        forces[:] = math.nan if _Loose.calls >= 50 else 0.0
        _Loose.calls += 1


class _Loose(IsmailDunniganLaw):
    """Gives up after 50 steps."""

    name = "loose"
    calls = 0
    function = _GivesUp()


@pytest.fixture
def loose(monkeypatch):
    monkeypatch.setitem(LAWS, "loose", _Loose)
    monkeypatch.setattr(_Loose, "calls", 0)
    with SceneFlyer("loose", SHORT) as flyer:
        yield flyer


def test_nan_command_stops_one_run_and_not_the_next(loose, monkeypatch):
    failed, trace = loose.fly(PLAIN[0], trace=True)
    assert failed.failed_step == 100 and not failed.reached and failed.reach_time == math.inf
    assert trace["time"][49] == pytest.approx(0.98) and not trace.to_array()[51:].any()
    monkeypatch.setattr(_Loose, "calls", -1000)
    assert loose.fly(PLAIN[1])[0].failed_step == -1
    monkeypatch.setattr(_Loose, "calls", 50)
    assert loose.fly(PLAIN[0])[0].failed_step == 0
    with pytest.raises(PlantError) as refused:
        loose.fly(replace(PLAIN[0], current=(1e300, 0.0, 0.0)))
    assert "current" in str(refused.value) and "thrust" not in str(refused.value)  # nothing of what was before


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"weight_minus_buoyancy": 1e5}, ScenarioError, "weight_minus_buoyancy is 100000.0, expected less than"),
        ({"failed_thruster": Failure(9, 5.0)}, ScenarioError, "failed_thruster.index is 9, expected one of the 8"),
        ({"current": (1e300, 0.0, 0.0)}, PlantError, "current"),
        ({"righting_moment": 1e300}, PlantError, "r_B"),
    ],
)
def test_invalid_plant_is_rejected_and_the_next_scene_runs(flyer, change, error, words):
    expected = flyer.fly(PLAIN[0])[0]
    with pytest.raises(error, match=words):
        flyer.fly(replace(PLAIN[0], **change))
    assert flyer.fly(PLAIN[0])[0]._replace(worst_step=0.0) == expected._replace(worst_step=0.0)


def test_failure_after_the_end_has_no_effect(flyer):
    late = replace(PLAIN[0], failed_thruster=Failure(1, 1e300))
    assert flyer.fly(late)[0]._replace(worst_step=0.0) == flyer.fly(PLAIN[0])[0]._replace(worst_step=0.0)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [({"duration": math.nan}, "duration"), ({"control": 0.0}, "control"), ({"plant_steps": 0}, "0 plant steps")],
)
def test_invalid_conditions_are_rejected(wrong, words):
    with pytest.raises(RunError, match=words):
        Conditions(**wrong)


@pytest.mark.medium
@pytest.mark.filterwarnings("ignore:Exception ignored")
@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs an alarm clock")
def test_signal_during_a_run_is_raised_after_it(flyer):
    class Alarmed(BaseException):  # as KeyboardInterrupt is, which nobody takes for an error of theirs
        pass

    def ring(*_):
        raise Alarmed

    flyer.fly(HARD[0])
    caught = 0
    before = signal.signal(signal.SIGVTALRM, ring)  # SIGALRM is that of the time limit of tests
    try:
        for _ in range(10):
            try:
                signal.setitimer(signal.ITIMER_VIRTUAL, 0.004)
                for _ in range(200):
                    flyer.fly(HARD[0])
            except Alarmed:
                caught += 1
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
    assert caught >= 8  # what is raised in a finaliser is lost, too
    assert flyer.fly(HARD[0])[0].failed_step == -1


# ---- C functions ----

DO_STEP = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_bool,
    *[ctypes.POINTER(ctypes.c_bool)] * 3, ctypes.POINTER(ctypes.c_double),
)  # fmt: skip


@pytest.mark.parametrize(
    ("status", "ends", "goes_on"), [(0, False, True), (1, False, True), (3, False, False), (0, True, False)]
)
def test_do_step_receives_arguments_and_returns_its_status(status, ends, goes_on):
    came = []

    @DO_STEP
    def do_step(instance, now, step, forgets, event, terminate, early, last):
        came.append((instance, now, step, forgets))
        event[0], terminate[0], early[0], last[0] = True, ends, True, now + step
        return status

    none = np.zeros(0)
    address = ctypes.cast(do_step, ctypes.c_void_p).value
    results = np.zeros(5, np.int64), np.full(1, np.nan)
    native = Native(1234, 0, 0, address, np.zeros(0, np.uint32), none, np.zeros(0, np.uint32), none, *results)
    assert fmi_do_step(native, 1.5, 0.25) == goes_on
    assert came == [(1234, 1.5, 0.25, True)]
    assert native.reached[0] == 1.75 and native.results[3] == status


def test_clock_agrees_with_python_monotonic():
    import time

    clock, room = Clock().numbers, np.zeros(2, np.int64)
    seconds(clock, room)
    before, mine, after = time.monotonic(), seconds(clock, room), time.monotonic()
    assert before - 1e-6 <= mine <= after + 1e-6
