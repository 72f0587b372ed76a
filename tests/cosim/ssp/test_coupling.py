"""FMUs beside the plant, in our master and in independent ones: the example of a tethered vehicle in a current."""

import shutil

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from controller import FunctionLaw
from cosim import Master, load_scenario
from cosim.ssp.system import MOTION
from plant_fmu import load_vehicle
from plant_fmu.variables import variables
from tests.architecture.modules import ROOT
from tests.cosim.simulation.keep import Keep
from tests.cosim.ssp.coupled_system import write_coupled_system
from tests.cosim.ssp.masters import in_master
from tests.plant_fmu.transcription import evaluate, rotation

EXAMPLE = ROOT / "examples" / "coupling"
ANCHOR, POINT, LENGTH, STIFFNESS, DAMPING = np.array([0, 0, -1.0]), np.array([-0.25, 0, -0.2]), 6.0, 200.0, 100.0
WEIGHT, BUOYANCY = 1248.25, 1228.25
STEP = 0.02


@pytest.fixture(scope="module")
def hanging(tmp_path_factory):
    """Return a function that loads the example with a step and a duration, and without its law's thrusters."""
    builder = pytest.importorskip("pythonfmu.builder")
    folder = tmp_path_factory.mktemp("coupled")
    for name in ("current", "tether"):
        builder.FmuBuilder.build_FMU(EXAMPLE / f"{name}.py", folder)
    shutil.copy(EXAMPLE / "hanging.toml", folder)

    def load(steps, step=STEP):
        changes = [f"time.step={step}", f"time.duration={steps * step}", "initial.position=[0,0,0]"]
        changes += ["law.name=pd", "actuation.through=wrench", "master.order=jacobi"]
        return load_scenario(folder / "hanging.toml", changes)

    return load


def motion_of(scenario):
    """Return the motion after each step in our master, without a force of the law."""
    with Master(scenario, FunctionLaw(lambda *_: np.zeros(6))) as master:
        kept = Keep(master)
        master.run([kept])
    return np.column_stack([kept[name] for name in MOTION])[1:]


def current(time, depth):
    """Velocity in the world frame, and how it follows from time and depth: of a complex number, north and east."""
    share, growth = 1.0 - np.exp(-0.1 * time), 0.1 * np.exp(-0.1 * time)
    speed, turned = 0.1 + 0.04 * depth, np.exp(0.1j * depth)
    return share * speed * turned, growth * speed * turned, share * (0.04 + 0.1j * speed) * turned


def tether(motion):
    """Force on the body in the world frame."""
    R, velocity, omega = rotation(motion[3:7]), motion[7:10], motion[10:13]
    line = ANCHOR - motion[:3] - R @ POINT
    distance = np.linalg.norm(line)
    shortening = line @ (R @ (velocity + np.cross(omega, POINT))) / distance
    tension = STIFFNESS * (distance - LENGTH) - DAMPING * shortening
    return max(tension, 0.0) * line / distance if distance > LENGTH else np.zeros(3)


def continuous(end):
    """Return the motion at a time, from the plant's equations in matrix form, integrated by SciPy."""
    values = {v.name: v.start for v in variables(load_vehicle("odin"))} | {"weight": WEIGHT}

    def rates(time, motion):
        R, force = rotation(motion[3:7]), tether(motion)
        pull = np.r_[R.T @ force, np.cross(POINT, R.T @ force)]
        water, by_time, by_depth = current(time, motion[2])
        rate = by_time + by_depth * (R @ motion[7:10])[2]
        now = dict(zip(MOTION, motion, strict=True)) | {f"wrench.{n}": x for n, x in zip("XYZKMN", pull, strict=True)}
        drift, slope = (water.real, water.imag, 0.0), (rate.real, rate.imag, 0.0)
        got = evaluate(values | now, 8, drift, slope)
        return np.real([got[f"der({name})"] for name in MOTION])

    start = np.zeros(13)
    start[3] = 1.0
    return solve_ivp(rates, (0.0, end), start, rtol=1e-7, atol=1e-9).y[:, -1]


@pytest.mark.slow
@pytest.mark.parametrize("master", ["fmpy", "ecos", "libcosim"])
def test_our_master_equals_independent_ones(master, hanging, tmp_path):
    """The plant sinks for 20 s: the tether gets taut, and the current turns and grows."""
    scenario = hanging(1000)
    system = write_coupled_system(scenario, tmp_path / "hanging.ssp")
    expected, got = in_master(master, system, 1000, STEP, tmp_path / "rows.npy"), motion_of(scenario)
    assert any(tether(motion).any() for motion in expected)
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=1e-9)


@pytest.mark.slow
def test_coupling_error_converges_linearly_with_the_step(hanging):
    """Half the step, half the error: what is held within a step lags by that much."""
    exact = continuous(20.0)
    errors = []
    for step in (STEP, 0.5 * STEP):
        steps = round(20.0 / step)
        got = motion_of(hanging(steps, step))[-1]
        errors.append(np.abs(got - exact).max())
    assert errors[1] < 0.015
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.2)


@pytest.mark.slow
def test_static_tether_stretch_matches_net_weight_and_drag(hanging):
    """By hand, with the drag of each body axis; and the moments of tether and weight cancel."""
    end = motion_of(hanging(12500))[-1]
    assert np.abs(end[7:]).max() < 1e-3
    R = rotation(end[3:7])
    water, _, _ = current(250.0, end[2])
    through = R.T @ [water.real, water.imag, 0.0]
    load = R @ (48.0 * np.abs(through) * through) + [0.0, 0.0, WEIGHT - BUOYANCY]
    line = ANCHOR - end[:3] - R @ POINT
    stretch = np.linalg.norm(line) - LENGTH
    assert stretch == pytest.approx(np.linalg.norm(load) / STIFFNESS, rel=1e-3)
    np.testing.assert_allclose(line / np.linalg.norm(line), -load / np.linalg.norm(load), atol=1e-3)
    moment = np.cross(POINT, R.T @ -load) + np.cross([0.0, 0.0, 0.05], R.T @ [0.0, 0.0, WEIGHT])
    np.testing.assert_allclose(moment, 0.0, atol=0.02)
