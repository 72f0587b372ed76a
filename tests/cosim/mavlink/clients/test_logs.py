"""A .tlog of a running vehicle, read by pymavlink's tools and by an independent decoder."""

import json
import re
import shutil
import subprocess

import pytest

from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.options import PROFILES, MavlinkOptions
from tests.cosim.mavlink.clients.conftest import HERE
from tests.cosim.mavlink.running import GroundStation, running_vehicle
from tests.cosim.mavlink.stubs import read_log

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]  # the first of them builds and installs

READING = 120.0  # s
LISTENING = 8.0  # s
SENT = {"HEARTBEAT", "ATTITUDE", "NAMED_VALUE_FLOAT", "DEBUG_FLOAT_ARRAY", "STATUSTEXT", "PARAM_VALUE", "COMMAND_ACK",
        "AUTOPILOT_VERSION", "AVAILABLE_MODES", "MISSION_COUNT"}  # fmt: skip


@pytest.fixture(scope="module", params=PROFILES)
def met(request, tmp_path_factory):
    """Return the log of a vehicle that a ground station has connected to, and that of the station."""
    folder = tmp_path_factory.mktemp("log")
    log, received = folder / "run.tlog", folder / "received.tlog"
    with GroundStation() as station:
        ends = [station.endpoint, parse_endpoint(str(log))]
        with running_vehicle(ends, MavlinkOptions(profile=request.param, commands=True)):
            station.connect()
            station.parameters()
            station.wait(lambda message: False, LISTENING)
        received.write_bytes(station.log)
        assert station.retries == station.link.mav_loss == 0
    return {"vehicle": (log, SENT | {"COMMAND_LONG", "PARAM_REQUEST_LIST"}), "station": (received, SENT)}


@pytest.fixture(params=["vehicle", "station"])
def log(request, met):
    """Return a log, and the messages that are in it."""
    return met[request.param]


def run(*command, **options):
    done = subprocess.run(command, capture_output=True, text=True, timeout=READING, **options)
    assert done.returncode == 0, done.stderr
    assert "traceback" not in (done.stdout + done.stderr).lower()
    return done.stdout


def test_qgroundcontrol_connects_without_a_retry_by_mavlink_2(met):
    messages = read_log(met["station"][0])
    assert len(messages) > 500 and {message.get_msgbuf()[0] for message in messages} == {0xFD}


def test_mavlogdump_reads_every_frame_and_mavloss_reports_none_lost(log, ardupilots_tools):
    path, some = log
    dump, loss = (ardupilots_tools.parent / f"{name}.py" for name in ("mavlogdump", "mavloss"))
    text = run(ardupilots_tools, dump, "--dialect", "all", "--show-source", "--show-types", path)
    kinds = set(re.findall(r"^([A-Z][A-Z0-9_]+)$", text, re.MULTILINE))
    assert some <= kinds and not {kind for kind in kinds if kind.startswith(("UNKNOWN", "BAD_DATA"))}
    (row,) = re.findall(r"^ +1 +1 +(\d+) +(\d+)", run(ardupilots_tools, loss, "--dialect", "all", path), re.MULTILINE)
    assert int(row[0]) > 500 and int(row[1]) == 0


def test_independent_decoder_decodes_every_frame(log, node_mavlink):
    path, some = log
    read = json.loads(run(shutil.which("node"), HERE / "decode.mjs", path, cwd=node_mavlink))
    assert read["frames"] == read["valid"] == read["decoded"] > 500
    assert read["invalid"] == read["unknown"] == 0
    assert set(read["counts"]) >= some
