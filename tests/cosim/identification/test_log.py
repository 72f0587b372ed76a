"""What a run recorded: samples without held rows and gaps, from the columns that hold them best."""

from pathlib import Path

import numpy as np
import pytest

from cosim.errors import IdentificationError
from cosim.identification.log import _with_mean, load_log, make_topic
from cosim.results.log_facts import TopicFacts
from cosim.results.recorder import Recorder
from cosim.simulation.signals import Column
from plant_fmu import load_vehicle

ROWS, STEP = 500, 0.02
VEHICLE = load_vehicle("bluerov2_heavy")


def signals():
    """Columns of a log: the DVL at 5 Hz, held; a gap of the attitude; the gyro in the state's own columns."""
    time = STEP * np.arange(ROWS)
    rng = np.random.default_rng(0)
    held = 10 * (np.arange(ROWS) // 10)
    found = {"time": time}
    for i in range(8):
        found[f"thrust[{i + 1}]"] = np.sin(time + i)
    found |= {f"wrench.{name}": 0.0 * time for name in "XYZKMN"}
    for i, name in enumerate("uvw"):
        found[f"measured.velocity.{name}"] = rng.standard_normal(ROWS)[held] + i
        found[f"velocity.{name}"] = np.full(ROWS, np.nan)
    found["measured.time.dvl"] = np.where(held > 0, time[held] - 0.05, -1e12)
    found |= {f"velocity.{name}": np.sin(2.0 * time) for name in "pqr"}
    found["position.z"] = 3.0 + np.sin(time)
    for i in range(4):
        found[f"quaternion.e{i}"] = np.where(
            (time > 4.0) & (time < 5.0), np.nan, np.cos(0.1 * time) if i == 0 else 0.01 * time
        )
    return found


def write(folder: Path, columns: dict[str, np.ndarray]) -> Path:
    recorder = Recorder(folder, [Column(name, "", "") for name in columns])
    for k, row in enumerate(np.column_stack(list(columns.values()))):
        recorder.observe(k, row)
    recorder.close()
    return folder


def test_held_values_and_gaps_are_excluded_from_samples(tmp_path):
    log = load_log(write(tmp_path, signals()), VEHICLE)
    dvl = log.topic("velocity")
    assert len(dvl.times) == ROWS // 10 - 1
    assert dvl.times == pytest.approx(0.2 * np.arange(1, ROWS // 10) - 0.05)
    assert dvl.values == pytest.approx(np.column_stack([signals()[f"measured.velocity.{n}"] for n in "uvw"])[10::10])
    attitude = log.topic("attitude")
    assert not ((attitude.times > 4.0) & (attitude.times < 5.0)).any()
    assert np.linalg.norm(attitude.values, axis=1) == pytest.approx(np.ones(len(attitude.times)))
    assert log.topic("position") is None and log.thrust.shape == (ROWS, 8)


@pytest.mark.parametrize(
    ("changes", "scenario", "message"),
    [
        ({"thrust[8]": None}, "", r"no column 'thrust\[8\]'"),
        ({"quaternion.e0": None}, "", "no attitude"),
        ({"measured.velocity.u": None, "velocity.u": None}, "", "no velocity or position"),
        ({f"thrust[{i}]": np.zeros(ROWS) for i in range(1, 9)}, "", "the thrusters are never driven"),
        ({"thrust[9]": np.ones(ROWS)}, "", "more thrusters than the 8"),
        ({}, "failures = [{ thruster = 1, time = 3.0 }]", "thrusters fail"),
        ({"wrench.X": np.ones(ROWS)}, "limit = { force = 50.0 }", "has a limit or a lag"),
    ],
)
def test_unusable_runs_are_rejected_with_the_reason(tmp_path, changes, scenario, message):
    columns = {name: x for name, x in (signals() | changes).items() if x is not None}
    folder = write(tmp_path, columns)
    (folder / "scenario.toml").write_text(scenario)
    with pytest.raises(IdentificationError, match=message):
        load_log(folder, VEHICLE)


def test_positions_replace_missing_velocities(tmp_path):
    columns = {name: x for name, x in signals().items() if "velocity.u" not in name}
    columns |= {f"position.{axis}": np.sin(columns["time"]) for axis in "xy"}
    log = load_log(write(tmp_path, columns), VEHICLE)
    assert log.topic("velocity") is None and len(log.topic("position").times) == ROWS


@pytest.mark.parametrize(("source", "is_mean"), [("VISO", True), ("VISION_POSITION_DELTA", True), ("dvl.csv", False)])
def test_displacements_of_a_dvl_are_means_of_their_interval(source, is_mean):
    """The mean of a cubic velocity over the interval is that of two moments."""
    times = 0.14 * np.arange(30)
    topic = make_topic("velocity", times, np.zeros((30, 3)), 0.01)
    fact = TopicFacts("dvl", source, 30, 7.0, 0.4, 0, (), 0, 0, 0, 0)
    spread = _with_mean(topic, (fact,)).spread
    cubic = np.polynomial.Polynomial([1.0, -2.0, 3.0, 4.0])
    mean = (cubic.integ()(0.57) - cubic.integ()(0.43)) / 0.14
    assert 0.5 * (cubic(0.5 - spread) + cubic(0.5 + spread)) == pytest.approx(mean if is_mean else cubic(0.5))
