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
from cosim.logs.formats.dataflash import Messages, _Samples
from cosim.logs.selection import select_topics
from cosim.logs.vehicle_messages import VehicleMessages
from cosim.results.log_facts import load_log_facts
from cosim.run.run_folder import report_again
from tests.cosim.logs.conftest import LOGS, facts_by_quantity, has_remark

TLOG, DATAFLASH = LOGS / "small.tlog", LOGS / "small.BIN"
START = 1_700_000_000_000_000  # us
SUB = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
PILOT = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)


def messages_of(path, *kinds):
    """What pymavlink reads, by kind, of the vehicle."""
    found = {kind: [] for kind in kinds}
    link = mavutil.mavlink_connection(str(path))
    while (message := link.recv_match(type=list(kinds))) is not None:
        if path.suffix == ".BIN" or (message.get_srcSystem(), message.get_srcComponent()) == (1, 1):
            found[message.get_type()].append(message)
    close(link)
    return found


def fields_of(messages, *fields):
    return np.array([[getattr(m, field) for field in fields] for m in messages]).T


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
def sent():
    """What pymavlink reads of the telemetry log."""
    return messages_of(TLOG, "ATTITUDE", "LOCAL_POSITION_NED", "SERVO_OUTPUT_RAW", "SCALED_PRESSURE2", "PARAM_VALUE")


@pytest.fixture(scope="module")
def dataflash(tmp_path_factory, six_thrusters):
    return cosim.import_log(DATAFLASH, six_thrusters, tmp_path_factory.mktemp("runs") / "bin", report=False)


@pytest.mark.medium
def test_every_tlog_sample_is_imported(tlog, sent):
    topics, unread = facts_by_quantity(tlog), load_log_facts(tlog.folder).unread
    for quantity, kind, rate in (
        ("attitude", "ATTITUDE", 20.0), ("position", "LOCAL_POSITION_NED", 3.0), ("pulses", "SERVO_OUTPUT_RAW", 2.0),
        ("depth", "SCALED_PRESSURE2", 2.0),
    ):  # fmt: skip
        assert topics[quantity].samples == len(sent[kind])
        assert topics[quantity].rate == pytest.approx(rate, rel=0.01)
    assert unread["AHRS2"] == 5245 and unread["GPS_INPUT"] == 1011
    assert unread["MANUAL_CONTROL (sticks)"] > 1400  # servo outputs are there, so they are not needed


@pytest.mark.medium
def test_attitudes_and_positions_follow_the_vehicle_clock(tlog, sent):
    """At the stamps of the vehicle, the rows are what it said; a constant offset of its clock is all that is free."""
    record, time = tlog.record, tlog.record["time"]
    (came,) = fields_of(sent["ATTITUDE"], "_timestamp")
    offset = np.min(came - 1e-3 * fields_of(sent["ATTITUDE"], "time_boot_ms")) - load_log_facts(tlog.folder).start
    for kind, names, fields in (
        ("ATTITUDE", "attitude.roll attitude.pitch attitude.yaw", "roll pitch yaw"),
        ("ATTITUDE", "velocity.p velocity.q velocity.r", "rollspeed pitchspeed yawspeed"),
        ("LOCAL_POSITION_NED", "position.x position.y position.z", "x y z"),
    ):
        stamps, *values = fields_of(sent[kind], "time_boot_ms", *fields.split())
        for name, said in zip(names.split(), values, strict=True):
            rows = np.interp(time, 1e-3 * stamps + offset, said)
            known = np.isfinite(record[name]) & (time > 2.0) & (time < 260.0)
            assert np.median(np.abs(record[name] - rows)[known]) < 0.02 * np.std(said) + 1e-4, name
            assert np.isfinite(record[name]).mean() > 0.99


def test_depth_and_its_times_are_those_of_the_pressure_as_in_the_autopilot(tlog, sent):
    parameters = {m.param_id: m.param_value for m in sent["PARAM_VALUE"]}
    (pressures,) = 100.0 * fields_of(sent["SCALED_PRESSURE2"], "press_abs")
    deep = (pressures - parameters["BARO2_GND_PRESS"]) / (9800.0 * parameters["BARO_SPEC_GRAV"])
    depths, stamps = (tlog.record[name] for name in ("measured.depth", "measured.time.depth_sensor"))
    known = np.isfinite(stamps)
    assert np.isclose(depths[known][:, None], deep[None], atol=1e-9).any(axis=1).all()
    age = (tlog.record["time"] - stamps)[known]
    assert age.min() >= -1e-9 and age.max() < 1.6
    assert len(np.unique(stamps[known])) >= 520  # of 635, of which some come twice within a row


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
    with pytest.raises(CosimError, match=r"log is 'small\.tlog', expected none: a run that was imported cannot be run"):
        cosim.load_scenario(tlog.folder / "scenario.toml")


def test_dataflash_import_matches_pymavlink(dataflash):
    """Every message is on the one clock of the autopilot, so rows are exact; rates are behind the gyro's filter."""
    read = messages_of(DATAFLASH, "XKF1", "XKQ", "RATE", "RCOU", "PARM")
    cutoff = next(m.Value for m in read["PARM"] if m.Name == "INS_GYRO_FILTER")
    topics, facts, record = facts_by_quantity(dataflash), load_log_facts(dataflash.folder), dataflash.record
    assert topics["position"].samples == len([m for m in read["XKF1"] if m.C == 0])
    assert topics["pulses"].samples == len(read["RCOU"])
    for name, kind, field in (
        ("position.z", "XKF1", "PD"), ("velocity.r", "RATE", "Y"), ("quaternion.e3", "XKQ", "Q4"),
    ):  # fmt: skip
        times, values = fields_of(read[kind], "TimeUS", field)
        times = 1e-6 * times - facts.start
        if kind == "RATE":
            values, times = np.radians(values), times - np.sqrt(0.5) / (np.pi * cutoff)
        expected = np.interp(record["time"], times, values)
        known = np.isfinite(record[name])
        assert known.mean() > 0.98
        np.testing.assert_allclose(np.abs(record[name])[known], np.abs(expected)[known], atol=2e-5)


def heartbeat(kind):
    return struct.pack(">Q", START) + SUB.heartbeat_encode(kind, 3, 0, 0, 4).pack(SUB)


OTHER_VEHICLE = "is of a {}, expected the log of an underwater vehicle"
REFUSED = [  # name and content of a log, or the log, with the vehicle and the reason
    (DATAFLASH, None, "bluerov2_heavy", r"small\.BIN: the autopilot's frame is vectored, expected vectored_6dof"),
    (TLOG, None, "odin", r"vehicle 'odin' has no table \[autopilot\]"),
    ("it.tlog", heartbeat(2), "bluerov2_heavy", OTHER_VEHICLE.format("quadrotor")),
    ("it.tlog", heartbeat(1), "bluerov2_heavy", OTHER_VEHICLE.format("fixed wing")),
    ("it.tlog", heartbeat(10), "bluerov2_heavy", OTHER_VEHICLE.format("ground rover")),
    ("it.bin", DATAFLASH.read_bytes().replace(b"ArduSub V4.1.0", b"ArduCopter V4 "), "bluerov2_heavy",
     OTHER_VEHICLE.format("vehicle of ArduCopter")),
    ("it.tlog", b"", "odin", "is empty"),
    ("it.tlog", b"no log at all, but some text that is long enough", "odin", "no heartbeat of an autopilot"),
    ("it.BIN", b"no log at all", "odin", "no message, expected a dataflash log"),
    ("it.bin", b"\xa3\x95\x80" + bytes(86), "odin", "format"),
    ("it.BIN", DATAFLASH.read_bytes().replace(b"\xa3\x95\x80", b"\xa3\x95\xfe"), "odin", "no message FMT"),
    ("it.txt", b"x", "odin", "ends in '.txt', expected one of .bag, .bin, .csv"),
    ("it.ulg", b"ULog but not really", "odin", "cannot be read as a ULog file"),
]  # fmt: skip


@pytest.mark.parametrize(("log", "content", "vehicle", "what"), REFUSED)
def test_invalid_log_or_one_of_another_vehicle_is_refused(tmp_path, refused, log, content, vehicle, what):
    path = log if content is None else tmp_path / log
    if content is not None:
        path.write_bytes(content)
    refused(what, path, vehicle)


def frames_of(stamps, seconds, copies=1):
    """Telemetry at 10 Hz of attitude and servo outputs, each frame written at stamps [us] over several links."""
    with_links = []
    for k in range(round(10 * seconds)):
        boot = 4_290_000 + 100 * k  # ms: the clock of microseconds wraps after 5 s
        pulses = [1500 + int(100 * math.sin(0.1 * k + i)) for i in range(16)]
        for link in range(copies):
            stamp = struct.pack(">Q", stamps(k) + 45_000 * link)
            with_links.append(stamp + SUB.attitude_encode(boot, 0.0, 0.0, 0.01 * k, 0.0, 0.0, 0.1).pack(SUB))
            servos = SUB.servo_output_raw_encode((1000 * boot) % 2**32, 0, *pulses)
            with_links.append(stamp + servos.pack(SUB))
    return heartbeat(12) + b"".join(with_links)


def test_messages_over_two_links_count_once_and_at_their_own_time(tmp_path, imported):
    """Without their stamps, commands would be half a period late or early."""
    runs = []
    for copies in (1, 2):
        (tmp_path / "it.tlog").write_bytes(frames_of(lambda k: START + 100_000 * k, 40.0, copies))
        runs.append(imported(tmp_path / "it.tlog").record)
        facts = facts_by_quantity(imported(tmp_path / "it.tlog"))["pulses"]
        assert (facts.samples, facts.duplicates) == (400, 400 * (copies - 1))
    for name in ("thrust[1]", "attitude.yaw", "measured.time.commands"):
        np.testing.assert_allclose(runs[1][name], runs[0][name], atol=1e-6)


def test_stamps_of_1970_are_read_with_a_remark(tmp_path, imported):
    """A station whose clock was set after ten seconds."""
    (tmp_path / "it.tlog").write_bytes(frames_of(lambda k: (START if k > 100 else 0) + 100_000 * k, 40.0))
    run = imported(tmp_path / "it.tlog")
    assert has_remark(run, "jumps by +1.7e+09 s: it is taken as a pause of 1 s")
    assert facts_by_quantity(run)["attitude"].samples == 398


def test_damaged_dataflash_log_gives_what_is_before_and_after(tmp_path, imported, six_thrusters):
    rng, content = np.random.default_rng(0), bytearray(DATAFLASH.read_bytes())
    first = facts_by_quantity(imported(DATAFLASH, six_thrusters))["attitude"].samples
    middle = len(content) // 2
    content[middle : middle + 3000] = rng.bytes(3000)
    content[middle + 3000 : middle + 3000] = b"\xa3\x95\x80" + rng.bytes(86)  # a format that is none
    (tmp_path / "it.bin").write_bytes(content)
    run = imported(tmp_path / "it.bin", six_thrusters)
    assert has_remark(run, "bytes of it.bin are damaged and were passed over")
    assert 0.9 * first < facts_by_quantity(run)["attitude"].samples < first


def test_sticks_replace_missing_servo_outputs(tmp_path, imported):
    with (tmp_path / "it.tlog").open("wb") as file:
        file.write(heartbeat(12))
        for k in range(400):
            stamp = struct.pack(">Q", START + k * 50_000)
            file.write(stamp + SUB.attitude_encode(k * 50, 0.0, 0.0, math.radians(30.0), 0.0, 0.0, 0.0).pack(SUB))
            # half ahead; the vertical stick rests at 500; half a pitch, as 400 is a full one
            file.write(stamp + PILOT.manual_control_encode(1, 500, 0, 500, 0, 0, 0, 1, 200).pack(PILOT))
    run = imported(tmp_path / "it.tlog")
    assert run.scenario.actuation.through == "wrench"
    assert load_log_facts(run.folder).commands.startswith("sticks of MANUAL_CONTROL")
    wrench = {"wrench.X": 0.5 * 0.5 * 4.0 * 40.0 * math.sqrt(0.5), "wrench.Z": 0.0, "attitude.yaw": math.radians(30.0)}
    wrench["wrench.M"] = 0.5 * 0.5 * 4.0 * 40.0 * np.abs(run.scenario.vehicle.thruster_matrix[4, 4:]).mean()
    for name, expected in wrench.items():
        np.testing.assert_allclose(run.record[name][20:-20], expected, rtol=1e-6)


def test_progress_is_reported_by_its_former_name_too(imported, six_thrusters):
    fractions, again = [], []
    imported(DATAFLASH, six_thrusters, on_progress=fractions.append)
    with pytest.warns(DeprecationWarning, match="moved is now on_progress"):
        imported(DATAFLASH, six_thrusters, moved=again.append)
    assert again == fractions == sorted(fractions) and fractions[-1] == 1.0
    with pytest.raises(ImportLogError, match="moved is the former name of on_progress, expected one of them"):
        imported(DATAFLASH, six_thrusters, on_progress=again.append, moved=again.append)


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize(("path", "cut"), [(TLOG, 0.3), (DATAFLASH, 0.61803), (DATAFLASH, 0.9)])
def test_truncated_log_is_read_to_its_end(tmp_path, imported, path, cut, six_thrusters):
    data = path.read_bytes()
    (tmp_path / path.name).write_bytes(data[: int(cut * len(data))])
    run = imported(tmp_path / path.name, "bluerov2_heavy" if path is TLOG else six_thrusters)
    assert np.isfinite(run.record["attitude.yaw"]).mean() > 0.9
    assert run.summary["simulated_time"] > (60.0 if path is TLOG else 5.0)


@pytest.mark.medium
def test_junk_in_a_log_loses_only_overwritten_frames(tmp_path, imported):
    data, rng = bytearray(TLOG.read_bytes()), np.random.default_rng(3)
    for start in (100_000, 700_000, 1_200_000):
        data[start : start + 3000] = rng.bytes(3000)
    (tmp_path / "it.tlog").write_bytes(data)
    run = imported(tmp_path / "it.tlog")
    assert facts_by_quantity(run)["attitude"].samples > 5150  # of 5245
    assert has_remark(run, "bytes of it.tlog are damaged")


def test_dataflash_parser_matches_pymavlink():
    """Every message that the readers take comes to the same numbers."""
    wanted = frozenset({"ATT", "XKF1", "IMU", "PARM", "BAT", "RCOU", "BARO"})
    log = DFReader.DFReader_binary(str(DATAFLASH))
    for name, fields in Messages(DATAFLASH, wanted):
        if fields is None:
            continue
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
FORMATS = {m["Name"]: m for _, m in Messages(DATAFLASH, frozenset({"FMT"})) if m}


def message_of(name, letters, *values):
    """Return a dataflash message; letters are the types of its fields."""
    layout = "<" + "".join(DFReader.FORMAT_TO_STRUCT[letter][0] for letter in letters)
    return b"\xa3\x95" + bytes([FORMATS[name]["Type"]]) + struct.pack(layout, *values)


@pytest.mark.medium
@pytest.mark.parametrize("name", USED)
def test_dataflash_text_where_a_number_belongs_is_refused(tmp_path, imported, name):
    """Each field in turn is a text by the log's own format of the message."""
    columns, refused = FORMATS[name]["Columns"], []
    for i, column in enumerate(columns.split(",")):
        letters = FORMATS[name]["Format"][:i] + "n" + FORMATS[name]["Format"][i + 1 :]
        message = message_of(name, letters, *(b"text" if letter in "nN" else 1 for letter in letters))
        texts = (text.encode() for text in (name, letters, columns))
        form = message_of("FMT", FORMATS["FMT"]["Format"], FORMATS[name]["Type"], len(message), *texts)
        (tmp_path / "it.bin").write_bytes(form + 9 * message)
        try:
            imported(tmp_path / "it.bin")
        except ImportLogError as error:
            refused += [column] if f"message {name} has a text" in str(error) else []
    assert sorted(refused) == sorted(USED[name].split())


def test_parameters_that_are_not_finite_are_omitted(tmp_path, imported, six_thrusters, dataflash):
    names = ("BARO_PRIMARY", "INS_GYRO_FILTER", "SERVO1_FUNCTION", "FRAME_CONFIG", "MOT_1_DIRECTION")
    for value in (math.nan, math.inf):
        form = FORMATS["PARM"]["Format"]
        parameters = b"".join(message_of("PARM", form, 0, name.encode(), value) for name in names)
        (tmp_path / "it.bin").write_bytes(DATAFLASH.read_bytes() + parameters)
        run = imported(tmp_path / "it.bin", six_thrusters)
        for column in dataflash.record.units:
            np.testing.assert_array_equal(run.record[column], dataflash.record[column])


def test_rates_of_a_controller_that_rests_are_no_samples(contents):
    """In MANUAL an ArduSub writes RATE on and on with the stamp of its last control step; other clocks go on."""
    handlers = _Samples(contents)
    for k in range(100):
        at = 10_000_000 + 40_000 * k
        handlers.add("ATT", {"TimeUS": at, "Roll": 1.0, "Pitch": 0.0, "Yaw": 0.0})
        handlers.add("RATE", {"TimeUS": min(at, 11_000_000), "R": 1.0, "P": 0.0, "Y": 0.0})
    assert not handlers.clock.jumps
    assert contents.sources["rates", "RATE"].count == 26 and contents.sources["attitude", "ATT"].count == 100
    half = math.radians(0.5)
    expected = {("attitude", "ATT"): [math.cos(half), math.sin(half), 0, 0], ("rates", "RATE"): [2.0 * half, 0, 0]}
    for source, values in expected.items():
        assert next(contents.sources[source].blocks())[0, 2:] == pytest.approx(values)


@pytest.mark.parametrize(
    ("name", "fields", "samples"),
    [
        ("IMU", {"I": 1, "GyrX": 1, "GyrY": 2, "GyrZ": 3, "AccX": 4, "AccY": 5, "AccZ": 6},
         {("gyro", "IMU[1]"): [1, 2, 3], ("acceleration", "IMU[1]"): [4, 5, 6]}),
        ("BARO", {"I": 0, "Alt": -2.5}, {("depth", "BARO[0]"): [2.5]}),
        ("RFND", {"Dist": 1.5, "Orient": 25}, {("altitude", "RFND"): [1.5]}),
        ("BAT", {"Inst": 0, "Volt": 15.8}, {("voltage", "BAT"): [15.8]}),
        ("XKF1", {"C": 0, "PN": 1, "PE": 2, "PD": 3, "VN": 4, "VE": 5, "VD": 6},
         {("position", "XKF1[0]"): [1, 2, 3], ("velocity_world", "XKF1[0]"): [4, 5, 6]}),
        ("ATT", {"Roll": math.inf, "Pitch": 0.0, "Yaw": 0.0}, {("attitude", "ATT"): []}),  # omitted
    ],
)  # fmt: skip
def test_dataflash_messages_are_samples_in_si_units(contents, name, fields, samples):
    _Samples(contents).add(name, {"TimeUS": 10_000_000} | fields)
    assert contents.sources.keys() == samples.keys()
    for source, values in samples.items():
        assert [row[2:].tolist() for block in contents.sources[source].blocks() for row in block] == [values][
            : len(values)
        ]


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_rates_are_stamped_where_the_gyro_filter_had_them(contents, tmp_path, autopilot):
    """A slow rotation through the Butterworth filter of SciPy comes as late as the stamps are moved back.

    Of a dataflash log as of telemetry, where the parameters may come after the samples.
    """
    cutoff, rate, filtered = 20.0, 2000.0, {"rates": 1.0, "gyro": 1.0, "acceleration": 2.0}
    _, late = signal.group_delay(signal.butter(2, cutoff, fs=rate), w=[0.5], fs=rate)
    contents.autopilot, is_filtered = autopilot, autopilot == "ardupilot"
    for k in range(50):
        for quantity, values in (("attitude", (1.0, 0.0, 0.0, 0.0)), *((q, (k, 0.0, 0.0)) for q in filtered)):
            contents.put(quantity, "IMU", math.nan, 2.0 + 0.1 * k, [1e-2 * x for x in values])
    contents.parameters |= {"INS_GYRO_FILTER": cutoff, "INS_ACCEL_FILTER": 0.5 * cutoff}
    topics, _ = select_topics(contents, tmp_path)
    for quantity, size in ({"attitude": 0.0} | filtered).items():
        expected = 2.0 - (size * late[0] / rate if is_filtered else 0.0)
        assert topics[quantity].start == pytest.approx(expected, abs=1e-4)
    assert not any("INS_GYRO_FILTER" in remark for remark in contents.remarks)
    contents.parameters.clear()
    select_topics(contents, tmp_path)
    assert any("INS_GYRO_FILTER" in remark for remark in contents.remarks) == is_filtered


def test_visual_odometry_is_the_mean_velocity_of_its_interval(contents):
    """Fields as ArduPilot's structure VISO has them; the interval ends at the stamp."""
    fields = {"dt": 0.2, "PosDX": 0.1, "PosDY": -0.02, "PosDZ": 0.0, "conf": 90.0, "AngDX": 0.0, "AngDY": 0.0}
    _Samples(contents).add("VISO", {"TimeUS": 2e6, "AngDZ": 0.1} | fields)
    message = mavlink.MAVLink_vision_position_delta_message(2_000_000, 200_000, [0.0] * 3, [0.1, -0.02, 0.0], 90.0)
    VehicleMessages(contents, 1, 3, 12).add(255, 197, message, 2.0)
    for name in ("VISO", "VISION_POSITION_DELTA"):
        (row,) = next(contents.sources["dvl", name].blocks())
        assert row[1:] == pytest.approx([1.9, 0.5, -0.1, 0.0])


@pytest.mark.medium
def test_report_replay_and_export_work_on_an_imported_log(tlog, tmp_path):
    folder = tmp_path / "small"
    shutil.copytree(tlog.folder, folder)
    _, files = report_again(folder)
    page = (folder / "report.html").read_text()
    assert {file.name for file in files} >= {"report.html", "replay.html", "velocity.svg", "thrusters.svg"}
    assert "no goal and no regions" in page and "SERVO_OUTPUT_RAW" in page and "LOCAL_POSITION_NED" in page
    assert not any(f'id="{figure}"' in page for figure in ("position-error", "weights", "clearance", "estimates"))
    assert '"imported":"small.tlog"' in (folder / "replay.html").read_text().replace(": ", ":")
    for form in ("csv", "mcap", "tlog"):
        assert Path(cosim.export_run(folder, form, tmp_path / f"out.{form}")[0]).stat().st_size > 10_000


@pytest.mark.slow
def test_run_round_trips_through_telemetry(tmp_path, imported):
    """Through our own MAVLink and back: what was flown, at the rates of the link."""
    over = {"time.duration": 10.0, "vehicle": "bluerov2_heavy", "actuation.through": "thrusters"}
    flown = cosim.run_scenario(cosim.load_scenario("depth-transit").replace(over), tmp_path / "flown", report=False)
    (log,) = cosim.export_run(flown.folder, "tlog", tmp_path / "it.tlog")
    back, before = imported(log).record, flown.record
    for name, bound in (("position.x", 1e-5), ("velocity.u", 1e-6), ("attitude.yaw", 1e-7), ("velocity.r", 1e-7)):
        expected = np.interp(back["time"], before["time"], before[name])
        np.testing.assert_allclose(back[name], expected, atol=bound, err_msg=name)
    force = back["thrust[1]"]
    every = np.interp(np.round(back["time"] / 0.2) * 0.2, before["time"], before["thrust[1]"])
    known = np.isfinite(force) & np.isclose(back["time"] % 0.2, 0.0, atol=1e-3)
    assert np.median(np.abs(force - every)[known]) < 0.5  # N: pulses are whole microseconds
