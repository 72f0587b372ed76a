"""Real logs of ArduSub, beside what pymavlink reads of them."""

import math
import shutil
import struct
from pathlib import Path

import numpy as np
import pytest
from pymavlink import DFReader, mavutil
from pymavlink.dialects.v20 import all as mavlink
from scipy import signal

import cosim
from cosim.errors import CosimError, ImportLogError
from cosim.io.strict_json import json_text
from cosim.logs.formats.dataflash import _Messages, parse_messages
from cosim.logs.selection import select_topics
from cosim.logs.vehicle_messages import VehicleMessages
from cosim.results.log_facts import load_log_facts
from tests.cosim.logs.conftest import LOGS

TLOG, DATAFLASH = LOGS / "small.tlog", LOGS / "small.BIN"

FILTERED = {"rates": 1.0, "gyro": 1.0, "acceleration": 2.0}  # times the delay of the gyro's filter


def messages_of(path, *kinds):
    """What pymavlink reads, by kind, of the vehicle."""
    found = {kind: [] for kind in kinds}
    link = mavutil.mavlink_connection(str(path))
    while (message := link.recv_match(type=list(kinds))) is not None:
        if path.suffix == ".BIN" or (message.get_srcSystem(), message.get_srcComponent()) == (1, 1):
            found[message.get_type()].append(message)
    close(link)
    return found


def close(log):
    """Close what pymavlink leaves open."""
    for name in ("data_map", "filehandle", "f"):
        if hasattr(log, name):
            getattr(log, name).close()


@pytest.fixture(scope="module")
def tlog(tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / "tlog"
    return cosim.import_log(TLOG, "bluerov2_heavy", out, curve="t200", report=False)


@pytest.fixture(scope="module")
def dataflash(tmp_path_factory, six_thrusters):
    return cosim.import_log(DATAFLASH, six_thrusters, tmp_path_factory.mktemp("runs") / "bin", report=False)


def facts_by_quantity(run):
    return {topic.quantity: topic for topic in load_log_facts(run.folder).topics}


@pytest.mark.medium
def test_every_tlog_sample_is_imported(tlog):
    read = messages_of(TLOG, "ATTITUDE", "LOCAL_POSITION_NED", "SERVO_OUTPUT_RAW", "SCALED_PRESSURE2")
    topics = facts_by_quantity(tlog)
    for quantity, kind, rate in (
        ("attitude", "ATTITUDE", 20.0), ("position", "LOCAL_POSITION_NED", 3.0), ("pulses", "SERVO_OUTPUT_RAW", 2.0),
        ("depth", "SCALED_PRESSURE2", 2.0),
    ):  # fmt: skip
        assert topics[quantity].samples == len(read[kind])
        assert topics[quantity].rate == pytest.approx(rate, rel=0.01)


@pytest.mark.medium
def test_attitudes_and_positions_follow_the_vehicle_clock(tlog):
    """At the stamps of the vehicle, the rows are what it said; a constant offset of its clock is all that is free."""
    read = messages_of(TLOG, "ATTITUDE", "LOCAL_POSITION_NED")
    record, facts = tlog.record, load_log_facts(tlog.folder)
    time = record["time"]
    stamps = np.array([m.time_boot_ms * 1e-3 for m in read["ATTITUDE"]])
    came = np.array([m._timestamp for m in read["ATTITUDE"]])
    offset = np.min(came - stamps) - facts.start
    for kind, names, fields in (
        ("ATTITUDE", ["attitude.roll", "attitude.pitch", "attitude.yaw"], ["roll", "pitch", "yaw"]),
        ("ATTITUDE", ["velocity.p", "velocity.q", "velocity.r"], ["rollspeed", "pitchspeed", "yawspeed"]),
        ("LOCAL_POSITION_NED", ["position.x", "position.y", "position.z"], ["x", "y", "z"]),
    ):
        at = np.array([m.time_boot_ms * 1e-3 for m in read[kind]]) + offset
        for name, field in zip(names, fields, strict=True):
            said = np.array([getattr(m, field) for m in read[kind]])
            rows = np.interp(time, at, said)
            known = np.isfinite(record[name]) & (time > 2.0) & (time < 260.0)
            error = np.abs(record[name] - rows)[known]
            assert np.median(error) < 0.02 * np.std(said) + 1e-4, name
            assert np.isfinite(record[name]).mean() > 0.99


def test_depth_is_derived_from_pressure_as_in_the_autopilot(tlog):
    parameters = {m.param_id: m.param_value for m in messages_of(TLOG, "PARAM_VALUE")["PARAM_VALUE"]}
    pressures = [100.0 * m.press_abs for m in messages_of(TLOG, "SCALED_PRESSURE2")["SCALED_PRESSURE2"]]
    deep = (np.array(pressures) - parameters["BARO2_GND_PRESS"]) / (9800.0 * parameters["BARO_SPEC_GRAV"])
    found = tlog.record["measured.depth"]
    found = found[np.isfinite(found)]
    assert np.isclose(found[:, None], deep[None], atol=1e-9).any(axis=1).all()


def test_sensor_sampling_times_are_recorded(tlog):
    record = tlog.record
    stamps = record["measured.time.depth_sensor"]
    known = np.isfinite(stamps)
    age = (record["time"] - stamps)[known]
    assert age.min() >= -1e-9 and age.max() < 1.6
    assert len(np.unique(stamps[known])) >= 520  # of 635, of which some come twice within a row


def test_unread_messages_are_listed(tlog):
    unread = load_log_facts(tlog.folder).unread
    assert unread["AHRS2"] == 5245 and unread["GPS_INPUT"] == 1011
    assert unread["MANUAL_CONTROL (sticks)"] > 1400  # servo outputs are there, so they are not needed


def test_imported_tlog_has_the_columns_of_a_run(tlog):
    assert tlog.summary["status"] == "imported" and not tlog.summary["has_goal"]
    again = cosim.load_run(tlog.folder)
    assert json_text(again.summary) == json_text(tlog.summary)
    assert again.scenario.log == "small.tlog" and again.scenario.law.name == "ardupilot"
    thrust = again.record.stack([f"thrust[{i}]" for i in range(1, 9)])
    wrench = again.record.stack([f"command.{a}" for a in "XYZKMN"])
    known = np.isfinite(thrust).all(axis=1)
    np.testing.assert_allclose(wrench[known], thrust[known] @ again.scenario.vehicle.thruster_matrix.T, atol=1e-9)
    assert 60.0 < np.abs(wrench[known, :3]).max() < 70.0


def test_dataflash_import_matches_pymavlink(dataflash):
    """Every message is on the one clock of the autopilot, so rows are exact; rates are behind the gyro's filter."""
    read = messages_of(DATAFLASH, "XKF1", "XKQ", "RATE", "RCOU", "BARO", "BAT", "PARM")
    cutoff = next(m.Value for m in read["PARM"] if m.Name == "INS_GYRO_FILTER")
    topics, facts, record = facts_by_quantity(dataflash), load_log_facts(dataflash.folder), dataflash.record
    assert topics["position"].samples == len([m for m in read["XKF1"] if m.C == 0])
    assert topics["pulses"].samples == len(read["RCOU"])
    for name, kind, field in (
        ("position.z", "XKF1", "PD"), ("velocity.r", "RATE", "Y"), ("quaternion.e3", "XKQ", "Q4"),
    ):  # fmt: skip
        at = np.array([m.TimeUS * 1e-6 for m in read[kind]]) - facts.start
        said = np.array([getattr(m, field) for m in read[kind]])
        if kind == "RATE":
            said, at = np.radians(said), at - np.sqrt(0.5) / (np.pi * cutoff)
        expected = np.interp(record["time"], at, said)
        known = np.isfinite(record[name])
        assert known.mean() > 0.98
        np.testing.assert_allclose(np.abs(record[name])[known], np.abs(expected)[known], atol=2e-5)


@pytest.mark.medium
def test_vehicle_of_another_frame_is_rejected_without_files(tmp_path):
    with pytest.raises(ImportLogError, match=r"small\.BIN: the autopilot's frame is vectored, expected vectored_6dof"):
        cosim.import_log(DATAFLASH, "bluerov2_heavy", tmp_path / "run")
    with pytest.raises(ImportLogError, match=r"vehicle 'odin' has no table \[autopilot\]"):
        cosim.import_log(TLOG, "odin", tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def heartbeat(kind, autopilot=3):
    sender = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    return sender.heartbeat_encode(kind, autopilot, 0, 0, 4).pack(sender)


@pytest.mark.parametrize(("kind", "words"), [(2, "quadrotor"), (1, "fixed wing"), (10, "ground rover")])
def test_logs_of_non_underwater_vehicles_are_rejected(tmp_path, kind, words):
    path = tmp_path / "it.tlog"
    path.write_bytes(struct.pack(">Q", 1_700_000_000_000_000) + heartbeat(kind))
    with pytest.raises(ImportLogError, match=f"is of a {words}, expected the log of an underwater vehicle"):
        cosim.import_log(path, "bluerov2_heavy", tmp_path / "run")


def test_sticks_replace_missing_servo_outputs(tmp_path):
    sender = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    pilot = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    with (tmp_path / "it.tlog").open("wb") as file:
        for k in range(400):
            stamp = struct.pack(">Q", 1_700_000_000_000_000 + k * 50_000)
            file.write(stamp + heartbeat(12)) if k % 20 == 0 else None
            attitude = sender.attitude_encode(k * 50, 0.0, 0.0, math.radians(30.0), 0.0, 0.0, 0.0)
            file.write(stamp + attitude.pack(sender))
            sticks = pilot.manual_control_encode(1, 500, 0, 500, 0, 0)  # half ahead; the vertical stick rests at 500
            file.write(stamp + sticks.pack(pilot))
    run = cosim.import_log(tmp_path / "it.tlog", "bluerov2_heavy", tmp_path / "run", report=False)
    record = run.record
    assert run.scenario.actuation.through == "wrench"
    assert load_log_facts(run.folder).commands.startswith("sticks of MANUAL_CONTROL")
    np.testing.assert_allclose(record["wrench.X"][20:-20], 0.5 * 0.5 * 4.0 * 40.0 * math.sqrt(0.5), rtol=1e-9)
    np.testing.assert_allclose(record["wrench.Z"][20:-20], 0.0)
    np.testing.assert_allclose(record["attitude.yaw"][20:-20], math.radians(30.0), rtol=1e-6)


def test_progress_is_reported_by_its_former_name_too(tmp_path, six_thrusters):
    arguments, options = (DATAFLASH, six_thrusters, tmp_path / "run"), {"report": False}
    fractions, again = [], []
    cosim.import_log(*arguments, on_progress=fractions.append, **options)
    with pytest.warns(DeprecationWarning, match="moved is now on_progress"):
        cosim.import_log(*arguments, moved=again.append, overwrite=True, **options)
    assert again == fractions == sorted(fractions) and fractions[-1] == 1.0
    with pytest.raises(ImportLogError, match="moved is the former name of on_progress, expected one of them"):
        cosim.import_log(*arguments, on_progress=again.append, moved=again.append, overwrite=True, **options)


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize(("path", "cut"), [(TLOG, 0.3), (DATAFLASH, 0.61803), (DATAFLASH, 0.9)])
def test_truncated_log_is_read_to_its_end(tmp_path, path, cut, six_thrusters):
    data = path.read_bytes()
    (tmp_path / path.name).write_bytes(data[: int(cut * len(data))])
    vehicle = "bluerov2_heavy" if path is TLOG else six_thrusters
    run = cosim.import_log(tmp_path / path.name, vehicle, tmp_path / "run", report=False)
    assert np.isfinite(run.record["attitude.yaw"]).mean() > 0.9
    assert run.summary["simulated_time"] > (60.0 if path is TLOG else 5.0)


@pytest.mark.medium
def test_junk_in_a_log_loses_only_overwritten_frames(tmp_path):
    data = bytearray(TLOG.read_bytes())
    rng = np.random.default_rng(3)
    for start in (100_000, 700_000, 1_200_000):
        data[start : start + 3000] = rng.bytes(3000)
    (tmp_path / "it.tlog").write_bytes(bytes(data))
    run = cosim.import_log(tmp_path / "it.tlog", "bluerov2_heavy", tmp_path / "run", report=False)
    assert facts_by_quantity(run)["attitude"].samples > 5150  # of 5245
    assert any("bytes of the log are no MAVLink frames" in remark for remark in load_log_facts(run.folder).remarks)


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("it.tlog", b"", "is empty"),
        ("it.tlog", b"no log at all, but some text that is long enough for a frame", "no heartbeat of an autopilot"),
        ("it.BIN", b"no log at all", "no message, expected a dataflash log"),
        ("it.bin", b"\xa3\x95\x80" + bytes(86), "format"),
        ("it.txt", b"x", "ends in '.txt', expected one of .bag, .bin, .csv"),
        ("it.ulg", b"ULog but not really", "cannot be read as a ULog file"),
    ],
)
def test_invalid_log_gives_one_line_error(tmp_path, name, content, what):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(CosimError) as caught:
        cosim.import_log(tmp_path / name, "bluerov2_heavy", tmp_path / "run")
    assert what in str(caught.value) and name in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "run").exists()


def test_log_of_another_firmware_is_rejected(tmp_path, six_thrusters):
    data = DATAFLASH.read_bytes().replace(b"ArduSub V4.1.0", b"ArduCopter V4 ")
    (tmp_path / "it.bin").write_bytes(data)
    with pytest.raises(ImportLogError, match="is of a vehicle of ArduCopter"):
        cosim.import_log(tmp_path / "it.bin", six_thrusters, tmp_path / "run")


def test_dataflash_parser_matches_pymavlink():
    """Every message that the readers take comes to the same numbers."""
    wanted = frozenset({"ATT", "XKF1", "IMU", "PARM", "BAT", "RCOU", "BARO"})
    ours = [
        (name, fields)
        for name, fields in parse_messages(DATAFLASH, wanted, lambda fraction: None)
        if fields is not None
    ]
    log = DFReader.DFReader_binary(str(DATAFLASH))
    for name, fields in ours:
        theirs = log.recv_match(type=list(wanted))
        assert theirs.get_type() == name
        for field, value in fields.items():
            other = getattr(theirs, field)
            same = value == other if isinstance(value, str) else math.isclose(value, other, rel_tol=1e-12)
            assert same or (math.isnan(value) and math.isnan(other)), (name, field)
    assert log.recv_match(type=list(wanted)) is None
    close(log)


USED = {  # message: fields that are read
    "ATT": "TimeUS Roll Pitch Yaw", "XKF1": "TimeUS PN PE PD VN VE VD", "XKQ": "TimeUS Q1 Q2 Q3 Q4",
    "BARO": "TimeUS Alt", "IMU": "TimeUS GyrX GyrY GyrZ AccX AccY AccZ", "RATE": "TimeUS R P Y",
    "VISO": "TimeUS dt PosDX PosDY PosDZ",
    "PARM": "TimeUS Value", "RCOU": "TimeUS " + " ".join(f"C{i}" for i in range(1, 15)),
}  # fmt: skip
FORMATS = {m["Name"]: m for _, m in parse_messages(DATAFLASH, frozenset({"FMT"}), lambda fraction: None) if m}


def message_of(name, letters, *values):
    """Return a dataflash message; letters are the types of its fields."""
    layout = "<" + "".join(DFReader.FORMAT_TO_STRUCT[letter][0] for letter in letters)
    return b"\xa3\x95" + bytes([FORMATS[name]["Type"]]) + struct.pack(layout, *values)


@pytest.mark.medium
@pytest.mark.parametrize("name", USED)
def test_dataflash_text_where_a_number_belongs_is_refused(tmp_path, name):
    """Each field in turn is a text by the log's own format of the message."""
    columns, refused = FORMATS[name]["Columns"], []
    for i, column in enumerate(columns.split(",")):
        letters = FORMATS[name]["Format"][:i] + "n" + FORMATS[name]["Format"][i + 1 :]
        message = message_of(name, letters, *(b"text" if letter in "nN" else 1 for letter in letters))
        texts = (text.encode() for text in (name, letters, columns))
        form = message_of("FMT", FORMATS["FMT"]["Format"], FORMATS[name]["Type"], len(message), *texts)
        (tmp_path / "it.bin").write_bytes(form + 9 * message)
        try:
            cosim.import_log(tmp_path / "it.bin", "bluerov2_heavy", tmp_path / "run", report=False, overwrite=True)
        except ImportLogError as error:
            refused += [column] if f"message {name} has a text" in str(error) else []
    assert sorted(refused) == sorted(USED[name].split())


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize(
    "name", ["BARO_PRIMARY", "INS_GYRO_FILTER", "SERVO1_FUNCTION", "FRAME_CONFIG", "MOT_1_DIRECTION"]
)
def test_parameters_that_are_not_finite_are_omitted(tmp_path, six_thrusters, dataflash, name, value):
    parameter = message_of("PARM", FORMATS["PARM"]["Format"], 0, name.encode(), value)
    (tmp_path / "it.bin").write_bytes(DATAFLASH.read_bytes() + parameter)
    run = cosim.import_log(tmp_path / "it.bin", six_thrusters, tmp_path / "run", report=False)
    for column in dataflash.record.units:
        np.testing.assert_array_equal(run.record[column], dataflash.record[column])


@pytest.mark.medium
def test_rates_of_a_controller_that_rests_are_no_samples(contents):
    """In MANUAL an ArduSub writes RATE on and on with the stamp of its last control step; other clocks go on."""
    handlers = _Messages(contents)
    for k in range(100):
        at = 10_000_000 + 40_000 * k
        handlers.add("ATT", {"TimeUS": at, "Roll": 1.0, "Pitch": 0.0, "Yaw": 0.0})
        handlers.add("RATE", {"TimeUS": min(at, 11_000_000), "R": 1.0, "P": 0.0, "Y": 0.0})
    assert not handlers.clock.jumps
    assert contents.sources["rates", "RATE"].count == 26 and contents.sources["attitude", "ATT"].count == 100


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_rates_are_stamped_where_the_gyro_filter_had_them(contents, tmp_path, autopilot):
    """A slow rotation through the Butterworth filter of SciPy comes as late as the stamps are moved back.

    Of a dataflash log as of telemetry, where the parameters may come after the samples.
    """
    cutoff, rate = 20.0, 2000.0
    numerator, denominator = signal.butter(2, cutoff, fs=rate)
    _, late = signal.group_delay((numerator, denominator), w=[0.5], fs=rate)
    contents.autopilot = autopilot
    for k in range(50):
        for quantity, values in (("attitude", (1.0, 0.0, 0.0, 0.0)), *((q, (k, 0.0, 0.0)) for q in FILTERED)):
            contents.put(quantity, "IMU", math.nan, 2.0 + 0.1 * k, [1e-2 * x for x in values])
    contents.parameters |= {"INS_GYRO_FILTER": cutoff, "INS_ACCEL_FILTER": 0.5 * cutoff}
    topics, _ = select_topics(contents, tmp_path)
    is_filtered = autopilot == "ardupilot"
    for quantity, size in FILTERED.items():
        expected = 2.0 - (size * late[0] / rate if is_filtered else 0.0)
        assert topics[quantity].start == pytest.approx(expected, abs=1e-4)
    assert topics["attitude"].start == 2.0
    assert not any("INS_GYRO_FILTER" in remark for remark in contents.remarks)
    contents.parameters.clear()
    select_topics(contents, tmp_path)
    assert any("INS_GYRO_FILTER" in remark for remark in contents.remarks) == is_filtered


def test_visual_odometry_is_the_mean_velocity_of_its_interval(contents):
    """Fields as ArduPilot's structure VISO has them; the interval ends at the stamp."""
    handlers = _Messages(contents)
    turned = {"AngDX": 0.0, "AngDY": 0.0, "AngDZ": 0.1}
    handlers.add("VISO", {"TimeUS": 2e6, "dt": 0.2, "PosDX": 0.1, "PosDY": -0.02, "PosDZ": 0.0, "conf": 90.0} | turned)
    source = contents.sources["dvl", "VISO"]
    assert source.count == 1
    assert next(source.blocks())[0, 1:] == pytest.approx([1.9, 0.5, -0.1, 0.0])
    message = mavlink.MAVLink_vision_position_delta_message(2_000_000, 200_000, [0.0] * 3, [0.1, -0.02, 0.0], 90.0)
    VehicleMessages(contents, 1, 3, 12).add(255, 197, message, 2.0)
    source = contents.sources["dvl", "VISION_POSITION_DELTA"]
    assert next(source.blocks())[0, 1:] == pytest.approx([1.9, 0.5, -0.1, 0.0])


@pytest.mark.medium
def test_report_replay_and_export_work_on_an_imported_log(tlog, tmp_path):
    folder = tmp_path / "small"
    shutil.copytree(tlog.folder, folder)
    from cosim.run.run_folder import report_again

    _, files = report_again(folder)
    page = (folder / "report.html").read_text()
    assert {file.name for file in files} >= {"report.html", "replay.html", "velocity.svg", "thrusters.svg"}
    assert "no goal and no regions" in page and "SERVO_OUTPUT_RAW" in page and "LOCAL_POSITION_NED" in page
    for figure in ("position-error", "weights", "clearance", "estimates"):
        assert f'id="{figure}"' not in page
    assert '"imported":"small.tlog"' in (folder / "replay.html").read_text().replace(": ", ":")
    for form in ("csv", "mcap", "tlog"):
        assert Path(cosim.export_run(folder, form, tmp_path / f"out.{form}")[0]).stat().st_size > 10_000


@pytest.mark.medium
def test_scenario_regions_are_evaluated_on_a_log(tmp_path):
    run = cosim.import_log(TLOG, "bluerov2_heavy", tmp_path / "run", scenario="depth-transit", report=False)
    record = run.record
    assert run.summary["has_goal"] and not run.summary["reached"]
    place = record.stack([f"position.{a}" for a in "xyz"])
    known = np.isfinite(record["goal.clearance"])
    assert known.mean() > 0.99
    band = next(r.region for r in run.scenario.regions if r.region.name == "band")
    expected = band.shape.tolerance - np.abs(place[:, 2] - band.shape.depth)
    np.testing.assert_allclose(record["band.clearance"][known], expected[known], atol=1e-9)


def test_imported_run_cannot_be_rerun(tlog):
    with pytest.raises(CosimError, match=r"log is 'small\.tlog', expected none: a run that was imported cannot be run"):
        cosim.load_scenario(tlog.folder / "scenario.toml")


@pytest.mark.slow
def test_run_round_trips_through_telemetry(tmp_path):
    """Through our own MAVLink and back: what was flown, at the rates of the link."""
    over = {"time.duration": 10.0, "vehicle": "bluerov2_heavy", "actuation.through": "thrusters"}
    flown = cosim.run_scenario(cosim.load_scenario("depth-transit").replace(over), tmp_path / "flown", report=False)
    (log,) = cosim.export_run(flown.folder, "tlog", tmp_path / "it.tlog")
    back = cosim.import_log(log, "bluerov2_heavy", tmp_path / "back", report=False).record
    for name, bound in (("position.x", 1e-5), ("velocity.u", 1e-6), ("attitude.yaw", 1e-7), ("velocity.r", 1e-7)):
        expected = np.interp(back["time"], flown.record["time"], flown.record[name])
        np.testing.assert_allclose(back[name], expected, atol=bound, err_msg=name)
    thrust, said = flown.record["thrust[1]"], back["thrust[1]"]
    every = np.interp(np.round(back["time"] / 0.2) * 0.2, flown.record["time"], thrust)
    known = np.isfinite(said) & np.isclose(back["time"] % 0.2, 0.0, atol=1e-3)
    assert np.median(np.abs(said - every)[known]) < 0.5  # N: pulses are whole microseconds
