"""CSV and Parquet with column maps: units, frames, orders of Euler angles, clocks, and everything that can be wrong."""

import datetime
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import tomli_w
from scipy.spatial.transform import Rotation

import cosim
from controller.quaternion import rotation_matrix
from cosim.results.log_facts import load_log_facts
from tests.cosim.logs.conftest import changed, facts_by_quantity, has_remark
from tests.cosim.logs.dive import Dive, assert_flown

QUATERNION = [f"quaternion.e{i}" for i in range(4)]
TABLE = {
    "time": {"column": "t", "unit": "ms"}, "world": "ENU", "body": "FLU",
    "position": {"columns": [*"xyz"], "unit": "cm"},
    "attitude": {"columns": ["yaw", "pitch", "roll"], "euler": "ZYX", "unit": "deg"},
    "rates": {"columns": ["wx", "wy", "wz"], "unit": "deg/s"},
    "depth": {"columns": ["altitude above the sea"], "sign": -1},
    "thrust": {"columns": [f"f{i}" for i in range(1, 9)], "unit": "kgf"},
    "voltage": {"columns": ["battery"], "unit": "mV"},
}  # fmt: skip
MAP = tomli_w.dumps(TABLE)


def frame_of(dive):
    """The dive as a ROS driver would have it: ENU and FLU, in odd units, with a junk column."""
    n, e, d = dive.position.T
    deg = np.degrees
    return pd.DataFrame({
        "t": 1e3 * dive.times, "x": 100 * e, "y": 100 * n, "z": -100 * d,
        "yaw": deg(np.pi / 2 - dive.yaw), "pitch": deg(-dive.pitch), "roll": deg(dive.roll),
        "wx": deg(dive.rates[:, 0]), "wy": -deg(dive.rates[:, 1]), "wz": -deg(dive.rates[:, 2]),
        "altitude above the sea": -d, "junk, with a comma": ["-"] * len(n), "battery": 15800.0,
        **{f"f{i + 1}": dive.thrust[:, i] / 9.80665 for i in range(8)},
    })  # fmt: skip


@pytest.fixture
def write(tmp_path):
    """Write a table and its map; return both as arguments of an import."""

    def written(frame, text=MAP, suffix=".csv", sep=","):
        path, columns = tmp_path / f"dive{suffix}", tmp_path / "map.toml"
        frame.to_parquet(path) if suffix == ".parquet" else frame.to_csv(path, index=False, sep=sep)
        columns.write_text(text)
        return {"path": path, "columns": columns}

    return written


@pytest.mark.parametrize(("suffix", "sep"), [(".csv", ","), (".csv", ";"), (".parquet", ",")])
def test_imported_table_in_other_units_and_frames_matches_the_dive(write, imported, suffix, sep):
    dive = Dive(np.arange(0.0, 60.0, 0.05))
    run = imported(**write(frame_of(dive), suffix=suffix, sep=sep))
    assert len(run.record) == len(dive.times) and run.summary["status"] == "imported"
    assert_flown(run.record, dive, 1e-9, known=1.0)
    np.testing.assert_allclose(run.record.stack([f"velocity.{a}" for a in "pqr"]), dive.rates, atol=1e-9)
    np.testing.assert_allclose(run.record["measured.depth"], dive.position[:, 2], atol=1e-9)
    assert facts_by_quantity(run)["depth"].rate == pytest.approx(20.0, abs=1e-6)
    assert set(load_log_facts(run.folder).unread) == {"junk, with a comma"}


def about(axis, angle):
    """The elementary rotation about an axis."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    R = np.eye(3)
    R[i, i] = R[j, j] = c
    R[i, j], R[j, i] = -s, s
    return R


@pytest.mark.medium(fast=5)
@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("order", ["ZYX", "zyx", "XZY", "YXZ", "ZXZ"])
def test_euler_angles_are_products_of_elementary_rotations(write, imported, order, inverse):
    """Capital letters: about the axes of the turned body; small ones: about those of the world."""
    angles = np.cumsum(np.random.default_rng(0).uniform(-0.1, 0.1, (50, 3)), axis=0)
    frame = pd.DataFrame({"t": 0.1 * np.arange(50), **{f"a{i}": angles[:, i] for i in range(3)}})
    table = {"time": {"column": "t"}, "attitude": {"columns": ["a0", "a1", "a2"], "euler": order, "inverse": inverse}}
    quaternions = imported(**write(frame, tomli_w.dumps(table))).record.stack(QUATERNION)
    for q, row in zip(quaternions, angles, strict=True):
        parts = [about(axis.lower(), angle) for axis, angle in zip(order, row, strict=True)]
        expected = np.linalg.multi_dot(parts if order.isupper() else parts[::-1])
        np.testing.assert_allclose(rotation_matrix(q), expected.T if inverse else expected, atol=1e-9)


def test_scalar_last_quaternions_and_ground_velocity_are_imported(write, imported):
    dive = Dive(np.arange(0.0, 30.0, 0.1))
    w, x, y, z = dive.quaternion.T
    frame = pd.DataFrame({"t": dive.times, "x": x, "y": y, "z": z, "w": w})
    frame[["vn", "ve", "vd"]] = dive.velocity_world
    table = {"time": {"column": "t"}, "attitude": {"columns": [*"xyzw"], "quaternion": "xyzw"},
             "velocity_world": {"columns": ["vn", "ve", "vd"]}}  # fmt: skip
    record = imported(**write(frame, tomli_w.dumps(table))).record
    expected = Rotation.from_quat(np.column_stack([x, y, z, w])).inv().apply(dive.velocity_world)
    np.testing.assert_allclose(record.stack([f"velocity.{a}" for a in "uvw"]), expected, atol=1e-9)


def test_iso_8601_times_and_per_topic_times_are_imported(write, imported):
    dive = Dive(np.arange(0.0, 20.0, 0.1))
    start = datetime.datetime(2025, 3, 1, 12, 0, 0, tzinfo=datetime.UTC)
    stamps = [(start + datetime.timedelta(seconds=float(t))).isoformat() for t in dive.times]
    frame = pd.DataFrame({"when": stamps, "yaw": dive.yaw, "pitch": dive.pitch, "roll": dive.roll})
    frame["deep"], frame["deep at"] = dive.position[:, 2], 1e9 * start.timestamp() + 1e9 * dive.times + 2e7
    table = {
        "time": {"column": "when", "unit": "iso8601"},
        "attitude": {"columns": ["yaw", "pitch", "roll"], "euler": "ZYX"},
        "depth": {"columns": ["deep"], "time": {"column": "deep at", "unit": "ns"}},
    }  # fmt: skip
    run = imported(**write(frame, tomli_w.dumps(table)))
    assert load_log_facts(run.folder).start == pytest.approx(start.timestamp() + 0.02, abs=1e-3)
    stamps = run.record["measured.time.depth_sensor"]
    np.testing.assert_allclose(np.diff(np.unique(stamps[np.isfinite(stamps)])), 0.1, atol=1e-5)


def test_gaps_and_missing_cells_are_marked(write, imported):
    dive = Dive(np.arange(0.0, 60.0, 0.05))
    frame = frame_of(dive)
    frame.loc[(dive.times > 20.01) & (dive.times < 23.99), ["yaw", "pitch", "roll"]] = np.nan
    frame = frame[~((dive.times > 40.01) & (dive.times < 41.99))]
    run = imported(**write(frame))
    topics = facts_by_quantity(run)
    assert topics["attitude"].gaps == 2 and topics["position"].gaps == 1
    np.testing.assert_allclose(topics["attitude"].longest_gaps, [(20.0, 24.0), (40.0, 42.0)], atol=1e-6)
    time, record = run.record["time"], run.record
    in_both = (time > 40.31) & (time < 41.99)
    for name in ("position.x", "attitude.yaw", "thrust[3]", "measured.depth", "velocity.p"):
        assert np.isnan(record[name][in_both]).all(), name
    assert np.isnan(record["attitude.yaw"][(time > 20.01) & (time < 23.99)]).all()
    assert np.isfinite(record["position.x"][(time > 20.01) & (time < 23.99)]).all()
    assert np.isfinite(record["attitude.yaw"][time < 19.99]).all()


@pytest.mark.parametrize("by", [-30.0, 1e6])
def test_clock_jump_becomes_a_marked_gap(write, imported, by):
    dive = Dive(np.arange(0.0, 40.0, 0.05))
    frame = frame_of(dive)
    frame.loc[dive.times > 20.01, "t"] += 1e3 * by
    run = imported(**write(frame))
    assert run.summary["simulated_time"] == pytest.approx(40.9, abs=0.11)
    assert has_remark(run, "Column 't' jumps by")
    time = run.record["time"]
    assert np.isnan(run.record["attitude.yaw"][(time > 20.4) & (time < 20.9)]).all()


@pytest.mark.parametrize(
    ("key", "value", "what"),
    [
        ("attitude.columns", ["yaw", "pitch", "rol"],
         r"dive\.csv: has no column 'rol', which the map names; did you mean 'roll'"),
        ("attitude.unit", None, r"yaw, pitch, roll: attitude reaches 90 rad, expected at most .*unit = \"deg\""),
        ("thrust.unit", "lbf", r"thrust\.unit is 'lbf', expected one of 'N', 'kgf'"),
        ("attitude.euler", "ZZX", r"attitude\.euler is 'ZZX', expected three axes"),
        ("attitude.euler", None, r"attitude\.columns has 3 names, expected 4 \(or 3 with euler\)"),
        ("rate", TABLE["rates"], r"map\.toml: .*rate.*rates"), ("nonsense", 1, r"map\.toml: .*nonsense"),
        ("world", "NUE", r"world: expected one of 'NED', 'ENU', 'NWU'"),
        ("thrust.columns", TABLE["thrust"]["columns"][:7], "commands of 7 thrusters, expected 8 as vehicle"),
        ("time", None, r"the map says no time for \[position\], expected \[time\]"),
        ("voltage.columns", ["junk, with a comma"], r"junk, with a comma|cannot be read"),
        ("rates", {"columns": ["f1", "battery", "wz"]}, r"rates reaches 1.58e\+04 rad/s"),
    ],
)  # fmt: skip
def test_invalid_column_map_is_rejected_by_name(write, refused, key, value, what):
    refused(what, **write(frame_of(Dive(np.arange(0.0, 5.0, 0.1))), changed(TABLE, key, value)))


def test_column_map_is_accepted_only_with_tables(tmp_path, refused):
    (tmp_path / "it.csv").write_text("t,x\n0,1\n")
    refused("needs a column map, expected --map FILE", tmp_path / "it.csv")
    (tmp_path / "it.tlog").write_bytes(b"x")
    refused("a column map is given, expected none", tmp_path / "it.tlog", columns=tmp_path / "map.toml")


@pytest.mark.parametrize(
    ("quantity", "times", "what"),
    [
        ("voltage", range(9), r"says nothing of the motion, expected one of attitude .*, position .*, depth"),
        ("depth", range(0, 500 * 3599, 3599), r"has 0.000278 samples of depth per second, expected 0.1 to 10000"),
        ("depth", np.cumsum(np.tile([1, 1, 3599], 300)), r"with 900 samples: 5401495 rows at 5 Hz, expected at most"),
    ],
)
def test_log_without_motion_or_of_weeks_is_rejected_with_requirements(write, refused, quantity, times, what):
    text = f'time = {{ column = "t" }}\n[{quantity}]\ncolumns = ["x"]\n'
    refused(what, **write(pd.DataFrame({"t": times, "x": 1.0}), text))


def test_log_without_commands_is_remarked(write, imported):
    run = imported(**write(frame_of(Dive(np.arange(0.0, 5.0, 0.1))), changed(TABLE, "thrust", None)))
    assert has_remark(run, "no commands of thrusters")
    assert cosim.load_run(run.folder).summary["max_force"] != 0.0


def test_goal_and_regions_of_a_scenario_are_evaluated_on_an_imported_dive(write, imported, tmp_path):
    """Regions judge a log as they judge a run."""
    (tmp_path / "judge.toml").write_text("""vehicle = "bluerov2_heavy"
title = "A ball"
time.duration = 1
[initial]
position = [0, 0, 3]
[goal]
type = "sphere"
center = [1.0, 0.0, 3.4]
radius = 0.3
[[regions]]
name = "band"
criterion = "depth"
keep = "in"
gain = 100.0
shape = { type = "depth_band", depth = 3.3, tolerance = 0.5 }
""")
    dive = Dive(np.arange(0.0, 30.0, 0.05))
    run = imported(**write(frame_of(dive)), scenario=tmp_path / "judge.toml")
    distance = np.linalg.norm(dive.position - [1.0, 0.0, 3.4], axis=1)
    np.testing.assert_allclose(run.record["goal.clearance"], 0.3 - distance, atol=1e-9)
    np.testing.assert_allclose(run.record["band.clearance"], 0.5 - np.abs(dive.position[:, 2] - 3.3), atol=1e-9)
    first = dive.times[np.argmax(distance <= 0.3)]
    assert run.summary["has_goal"] and run.summary["reached"]
    assert run.summary["reach_time"] == pytest.approx(first, abs=0.051)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_import_memory_does_not_grow_with_the_rows(tmp_path):
    """Five times the rows: the numbers grow by 100 MB, the peak of import, report and replay by a fifth of it."""
    columns = tmp_path / "map.toml"
    columns.write_text(MAP)
    code = """
import sys, cosim
run = cosim.import_log(sys.argv[1], "bluerov2_heavy", sys.argv[2], columns=sys.argv[3])
with open("/proc/self/status") as status:  # of this process alone
    print(next(line.split()[1] for line in status if line.startswith("VmHWM")), len(run.record.columns))
"""
    used, numbers = [], []
    for rows in (32_000, 160_000):
        log = tmp_path / f"{rows}.csv"
        frame_of(Dive(np.arange(rows) / 50.0)).to_csv(log, index=False, float_format="%.4f")
        done = subprocess.run(
            [sys.executable, "-c", code, log, tmp_path / f"run-{rows}", columns],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        kilobytes, signals = map(int, done.stdout.split())
        used.append(kilobytes / 1024.0)
        numbers.append(8e-6 * rows * signals)
    assert numbers[1] - numbers[0] > 100.0
    assert used[1] - used[0] < 20.0, used  # MB
