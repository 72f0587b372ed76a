"""External FMUs on a coupled plant in independent masters: the example of a tethered vehicle in a current."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cosim.ssp.system import MOTION
from plant_fmu import Plant, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.variables import variables
from plant_fmu.vehicle_component import make_vehicle_component
from tests.cosim.ssp.masters import in_master
from tests.plant_fmu.transcription import evaluate, rotation

EXAMPLE = Path(__file__).parents[3] / "examples" / "coupling" / "system.py"
ANCHOR, POINT, LENGTH, STIFFNESS, DAMPING = np.array([0, 0, -1.0]), np.array([-0.25, 0, -0.2]), 6.0, 200.0, 100.0
WEIGHT, BUOYANCY = 1248.25, 1228.25
STEP = 0.02


@pytest.fixture(scope="module")
def packed(tmp_path_factory):
    pytest.importorskip("pythonfmu")
    write = runpy.run_path(str(EXAMPLE))["write_system"]
    folder = tmp_path_factory.mktemp("coupled")
    return lambda step: write(folder / f"{step}.ssp", 250.0, step)


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


def in_turn(steps, step):
    """Return the motion with the outputs exchanged after each step (Jacobi's order)."""
    vehicle = make_vehicle_component(load_vehicle("odin"), {"weight": WEIGHT}, coupled=True)
    rows, force, water, rate, before = [], np.zeros(3), 0j, 0j, 0.0
    with Plant(cached_fmu(vehicle, 2)) as plant:
        plant.initialize()
        motion = np.array([plant[name] for name in MOTION])
        for k in range(steps):
            for i, axis in enumerate("xyz"):
                plant[f"external.world.force.{axis}"] = force[i]
                plant[f"external.world.point.{axis}"] = POINT[i] if k else 0.0
            for axis, part in (("x", np.real), ("y", np.imag)):
                plant[f"current_input.{axis}"] = part(water)
                plant[f"current_input_rate.{axis}"] = part(rate)
            plant.step(step)
            water, by_time, by_depth = current((k + 1) * step, motion[2])
            force, rate = tether(motion), by_time + by_depth * (motion[2] - before) / step
            before = motion[2]
            motion = np.array([plant[name] for name in MOTION])
            rows.append(motion)
    return np.array(rows)


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
def test_masters_connect_a_current_and_a_tether(master, packed, tmp_path):
    """The plant sinks for 20 s: the tether gets taut, and the current turns and grows."""
    expected = in_turn(1000, STEP)
    got = in_master(master, packed(STEP), 1000, STEP, tmp_path / "rows.npy")
    assert any(tether(motion).any() for motion in expected)
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=1e-9)


@pytest.mark.slow
def test_coupling_error_converges_linearly_with_the_step(packed, tmp_path):
    """Half the step, half the error: what is held within a step lags by that much."""
    exact = continuous(20.0)
    errors = []
    for step in (STEP, 0.5 * STEP):
        steps = round(20.0 / step)
        got = in_master("fmpy", packed(step), steps, step, tmp_path / "rows.npy")[-1]
        errors.append(np.abs(got - exact).max())
    assert errors[1] < 0.015
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.2)


@pytest.mark.slow
def test_static_tether_stretch_matches_net_weight_and_drag(packed, tmp_path):
    """By hand, with the drag of each body axis; and the moments of tether and weight cancel."""
    end = in_master("fmpy", packed(STEP), 12500, STEP, tmp_path / "rows.npy")[-1]
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
