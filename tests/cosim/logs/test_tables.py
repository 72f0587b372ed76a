"""CSV and Parquet with column maps: units, frames, orders of Euler angles, clocks, and everything that can be wrong."""

import datetime
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

import cosim
from cosim.errors import ImportLogError
from cosim.results.log_facts import load_log_facts
from tests.cosim.logs.dive import Dive, errors

POSITION = [f"position.{a}" for a in "xyz"]
QUATERNION = [f"quaternion.e{i}" for i in range(4)]
MAP = """
time = { column = "t", unit = "ms" }
world = "ENU"
body = "FLU"

[position]
columns = ["x", "y", "z"]
unit = "cm"

[attitude]
columns = ["yaw", "pitch", "roll"]
euler = "ZYX"
unit = "deg"

[rates]
columns = ["wx", "wy", "wz"]
unit = "deg/s"

[depth]
columns = ["altitude above the sea"]
sign = -1

[thrust]
columns = ["f1", "f2", "f3", "f4", "f5", "f6", "f7", "f8"]
unit = "kgf"

[voltage]
columns = ["battery"]
unit = "mV"
"""


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
    """Write a table and its map, and import them."""

    def written(frame, text=MAP, suffix=".csv", sep=",", **options):
        path, columns = tmp_path / f"dive{suffix}", tmp_path / "map.toml"
        frame.to_parquet(path) if suffix == ".parquet" else frame.to_csv(path, index=False, sep=sep)
        columns.write_text(text)
        return cosim.import_log(
            path, "bluerov2_heavy", tmp_path / "run", columns=columns, report=False, overwrite=True, **options
        )

    return written


@pytest.mark.parametrize(("suffix", "sep"), [(".csv", ","), (".csv", ";"), (".parquet", ",")])
def test_imported_table_in_other_units_and_frames_matches_the_dive(write, suffix, sep):
    dive = Dive(np.arange(0.0, 60.0, 0.05))
    run = write(frame_of(dive), suffix=suffix, sep=sep)
    record = run.record
    assert len(record) == len(dive.times) and run.summary["status"] == "imported"
    for names, expected, bound in (
        (POSITION, dive.position, 1e-9),
        (["attitude.roll", "attitude.pitch", "attitude.yaw"], np.column_stack([dive.roll, dive.pitch, dive.yaw]), 1e-9),
        (["velocity.p", "velocity.q", "velocity.r"], dive.rates, 1e-9),
        (["measured.depth"], dive.position[:, 2:], 1e-9),
        ([f"thrust[{i}]" for i in range(1, 9)], dive.thrust, 1e-9),
    ):
        error, known = errors(record, dive, names, expected)
        assert error < bound and known == 1.0, names
    facts = load_log_facts(run.folder)
    assert {topic.quantity: round(topic.rate, 6) for topic in facts.topics}["depth"] == 20.0
    assert set(facts.unread) == {"junk, with a comma"}


@pytest.mark.medium(fast=5)
@pytest.mark.parametrize("order", ["ZYX", "zyx", "XZY", "YXZ", "ZXZ"])
@pytest.mark.parametrize("inverse", [False, True])
def test_euler_angles_of_any_order_are_imported(write, order, inverse):
    from scipy.spatial.transform import Rotation

    dive = Dive(np.arange(0.0, 20.0, 0.1))
    R = Rotation.from_quat(np.roll(dive.quaternion, -1, axis=1))
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        angles = (R.inv() if inverse else R).as_euler(order)
    frame = pd.DataFrame({"t": dive.times, **{f"a{i}": angles[:, i] for i in range(3)}})
    text = f"""time = {{ column = "t" }}
[attitude]
columns = ["a0", "a1", "a2"]
euler = "{order}"
inverse = {str(inverse).lower()}
"""
    record = write(frame, text).record
    found = record.stack(QUATERNION)
    np.testing.assert_allclose(np.abs((found * dive.quaternion).sum(axis=1)), 1.0, atol=1e-9)


def test_scalar_last_quaternions_and_ground_velocity_are_imported(write):
    dive = Dive(np.arange(0.0, 30.0, 0.1))
    w, x, y, z = dive.quaternion.T
    frame = pd.DataFrame({"t": dive.times, "x": x, "y": y, "z": z, "w": w})
    frame[["vn", "ve", "vd"]] = dive.velocity_world
    text = """time = { column = "t" }
[attitude]
columns = ["x", "y", "z", "w"]
quaternion = "xyzw"
[velocity_world]
columns = ["vn", "ve", "vd"]
"""
    record = write(frame, text).record
    from scipy.spatial.transform import Rotation

    expected = Rotation.from_quat(np.column_stack([x, y, z, w])).inv().apply(dive.velocity_world)
    np.testing.assert_allclose(record.stack([f"velocity.{a}" for a in "uvw"]), expected, atol=1e-9)


def test_iso_8601_times_and_per_topic_times_are_imported(write):
    dive = Dive(np.arange(0.0, 20.0, 0.1))
    start = datetime.datetime(2025, 3, 1, 12, 0, 0, tzinfo=datetime.UTC)
    stamps = [(start + datetime.timedelta(seconds=float(t))).isoformat() for t in dive.times]
    frame = pd.DataFrame({"when": stamps, "yaw": dive.yaw, "pitch": dive.pitch, "roll": dive.roll})
    frame["deep"], frame["deep at"] = dive.position[:, 2], 1e9 * start.timestamp() + 1e9 * dive.times + 2e7
    text = """time = { column = "when", unit = "iso8601" }
[attitude]
columns = ["yaw", "pitch", "roll"]
euler = "ZYX"
[depth]
columns = ["deep"]
time = { column = "deep at", unit = "ns" }
"""
    run = write(frame, text)
    assert load_log_facts(run.folder).start == pytest.approx(start.timestamp() + 0.02, abs=1e-3)
    stamps = run.record["measured.time.depth_sensor"]
    np.testing.assert_allclose(np.diff(np.unique(stamps[np.isfinite(stamps)])), 0.1, atol=1e-5)


def test_gaps_and_missing_cells_are_marked(write):
    dive = Dive(np.arange(0.0, 60.0, 0.05))
    frame = frame_of(dive)
    frame.loc[(dive.times > 20.01) & (dive.times < 23.99), ["yaw", "pitch", "roll"]] = np.nan
    frame = frame[~((dive.times > 40.01) & (dive.times < 41.99))]
    run = write(frame)
    topics = {topic.quantity: topic for topic in load_log_facts(run.folder).topics}
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
def test_clock_jump_becomes_a_marked_gap(write, by):
    dive = Dive(np.arange(0.0, 40.0, 0.05))
    frame = frame_of(dive)
    frame.loc[dive.times > 20.01, "t"] += 1e3 * by
    run = write(frame)
    assert run.summary["simulated_time"] == pytest.approx(40.9, abs=0.11)
    remarks = load_log_facts(run.folder).remarks
    assert any("Column 't' jumps by" in remark for remark in remarks)
    time = run.record["time"]
    assert np.isnan(run.record["attitude.yaw"][(time > 20.4) & (time < 20.9)]).all()


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('"roll"]', '"rol"]', r"dive\.csv: has no column 'rol', which the map names; did you mean 'roll'"),
        ('unit = "deg"', "", r"yaw, pitch, roll: attitude reaches 90 rad, expected at most .*unit = \"deg\""),
        ('unit = "kgf"', 'unit = "lbf"', r"thrust\.unit is 'lbf', expected one of 'N', 'kgf'"),
        ('euler = "ZYX"', 'euler = "ZZX"', r"attitude\.euler is 'ZZX', expected three axes"),
        ('euler = "ZYX"', "", r"attitude\.columns has 3 names, expected 4 \(or 3 with euler\)"),
        ("[rates]", "[rate]", r"map\.toml: .*rate.*rates"),
        ('world = "ENU"', 'world = "NUE"', r"world: expected one of 'NED', 'ENU', 'NWU'"),
        ('unit = "ms" }', 'unit = "ms" }\nnonsense = 1', r"map\.toml: .*nonsense"),
        ('time = { column = "t", unit = "ms" }', "", r"the map says no time for \[position\], expected \[time\]"),
        ('"f7", "f8"', '"f7"', "commands of 7 thrusters, expected 8 as vehicle 'bluerov2_heavy' has"),
        ('["battery"]', '["junk, with a comma"]', r"junk, with a comma|cannot be read"),
        ('["wx", "wy", "wz"]\nunit = "deg/s"', '["f1", "battery", "wz"]', r"rates reaches 1.58e\+04 rad/s"),
    ],
)  # fmt: skip
def test_invalid_column_map_is_rejected_by_name(write, tmp_path, old, new, what):
    assert old in MAP
    with pytest.raises(ImportLogError, match=what) as caught:
        write(frame_of(Dive(np.arange(0.0, 5.0, 0.1))), MAP.replace(old, new, 1))
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "run").exists()


def test_column_map_is_accepted_only_with_tables(tmp_path):
    (tmp_path / "it.csv").write_text("t,x\n0,1\n")
    with pytest.raises(ImportLogError, match="needs a column map, expected --map FILE"):
        cosim.import_log(tmp_path / "it.csv", "bluerov2_heavy", tmp_path / "run")
    (tmp_path / "it.tlog").write_bytes(b"x")
    with pytest.raises(ImportLogError, match="a column map is given, expected none"):
        cosim.import_log(tmp_path / "it.tlog", "bluerov2_heavy", tmp_path / "run", columns=tmp_path / "map.toml")


def test_log_without_motion_is_rejected_with_requirements(write):
    frame = pd.DataFrame({"t": np.arange(9.0), "battery": 15.0})
    text = 'time = { column = "t" }\n[voltage]\ncolumns = ["battery"]\n'
    with pytest.raises(
        ImportLogError, match=r"says nothing of the motion, expected one of attitude .*, position .*, depth"
    ):
        write(frame, text)


def test_log_without_commands_is_remarked(write):
    dive = Dive(np.arange(0.0, 5.0, 0.1))
    run = write(frame_of(dive), MAP[: MAP.index("[thrust]")])
    assert any("no commands of thrusters" in remark for remark in load_log_facts(run.folder).remarks)
    assert cosim.load_run(run.folder).summary["max_force"] != 0.0


def test_scenario_goal_is_evaluated_on_an_imported_dive(write, tmp_path):
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
""")
    dive = Dive(np.arange(0.0, 30.0, 0.05))
    run = write(frame_of(dive), scenario=tmp_path / "judge.toml")
    distance = np.linalg.norm(dive.position - [1.0, 0.0, 3.4], axis=1)
    np.testing.assert_allclose(run.record["goal.clearance"], 0.3 - distance, atol=1e-9)
    first = dive.times[np.argmax(distance <= 0.3)]
    assert run.summary["reached"] and run.summary["reach_time"] == pytest.approx(first, abs=0.051)


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


def test_few_samples_over_weeks_are_refused(tmp_path):
    (tmp_path / "map.toml").write_text('time = { column = "t" }\n[depth]\ncolumns = ["d"]\n')
    (tmp_path / "dive.csv").write_text("t,d\n" + "".join(f"{3599 * k},1\n" for k in range(500)))
    with pytest.raises(ImportLogError, match=r"with 500 samples: 8979505 rows at 5 Hz, expected at most 500000"):
        cosim.import_log(tmp_path / "dive.csv", "bluerov2_heavy", tmp_path / "run", columns=tmp_path / "map.toml")
    assert not (tmp_path / "run").exists()
