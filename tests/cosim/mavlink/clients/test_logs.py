"""A .tlog of a running vehicle, read by pymavlink's tools and by an independent decoder."""

import json
import re
import shutil
import struct
import subprocess
import time

import pytest

from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.ground_end import GroundLink
from cosim.mavlink.wire.options import PROFILES, MavlinkOptions
from tests.cosim.mavlink.clients.conftest import HERE
from tests.cosim.mavlink.conformance.client import Client
from tests.cosim.mavlink.conformance.connect import fetch_parameters, qgc_connect
from tests.cosim.mavlink.conformance.vehicle import running_vehicle

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]  # the first of them builds and installs

READING = 120.0  # s
LISTENING = 8.0  # s
SENT = {"HEARTBEAT", "ATTITUDE", "NAMED_VALUE_FLOAT", "DEBUG_FLOAT_ARRAY", "STATUSTEXT", "PARAM_VALUE", "COMMAND_ACK",
        "AUTOPILOT_VERSION", "AVAILABLE_MODES", "MISSION_COUNT"}  # fmt: skip
LOGS = [
    pytest.param(0, SENT | {"COMMAND_LONG", "PARAM_REQUEST_LIST"}, id="log of the vehicle"),
    pytest.param(1, SENT, id="log of the station"),
]


class RecordingLink(GroundLink):
    """Write all received frames into a log, as ground stations do."""

    def __init__(self, endpoint, log):
        super().__init__(endpoint)
        self.log = log

    def receive(self, timeout):
        found = super().receive(timeout)
        with self.log.open("ab") as file:
            for heard in found:
                file.write(struct.pack(">Q", time.time_ns() // 1000) + bytes(heard.message.get_msgbuf()))
        return found


@pytest.fixture(scope="module", params=PROFILES)
def met(request, tmp_path_factory, udp_port):
    """Return the log of a vehicle that a ground station has connected to, that of the station, and how that went."""
    folder = tmp_path_factory.mktemp("log")
    log, heard = folder / "run.tlog", folder / "heard.tlog"
    endpoint = f"127.0.0.1:{udp_port()}"
    ends = [parse_endpoint(f"udpout:{endpoint}"), parse_endpoint(str(log))]
    with RecordingLink(parse_endpoint(f"udpin:{endpoint}"), heard) as link:
        with running_vehicle(ends, MavlinkOptions(profile=request.param, commands=True)):
            client = Client(link)
            connection = qgc_connect(client)
            fetch_parameters(client)
            client.collect(LISTENING)
    return log, heard, connection


def test_qgroundcontrol_connects_without_a_retry(met):
    connection = met[2]
    assert connection.good and connection.retries == 0
    names = [step.name for step in connection.steps]
    assert names[:6] == ["version", "modes", "metadata", "streams", "parameters", "mission"]


@pytest.mark.parametrize(("which", "some"), LOGS)
def test_mavlogdump_reads_every_frame(met, which, some, ardupilots_tools):
    python = ardupilots_tools
    done = subprocess.run(
        [python, python.parent / "mavlogdump.py", "--dialect", "all", "--show-source", "--show-types", met[which]],
        capture_output=True, text=True, timeout=READING,
    )  # fmt: skip
    kinds = set(re.findall(r"^([A-Z][A-Z0-9_]+)$", done.stdout, re.MULTILINE))
    assert done.returncode == 0, done.stderr
    assert some <= kinds
    assert not {kind for kind in kinds if kind.startswith(("UNKNOWN", "BAD_DATA"))}
    assert "traceback" not in (done.stdout + done.stderr).lower()


@pytest.mark.parametrize(("which", "some"), LOGS)
def test_mavloss_reports_no_lost_frames(met, which, some, ardupilots_tools):
    python = ardupilots_tools
    done = subprocess.run(
        [python, python.parent / "mavloss.py", "--dialect", "all", met[which]], capture_output=True, text=True,
        timeout=READING,
    )  # fmt: skip
    (row,) = re.findall(r"^ +1 +1 +(\d+) +(\d+)", done.stdout, re.MULTILINE)
    assert int(row[0]) > 500 and int(row[1]) == 0, done.stdout


@pytest.mark.parametrize(("which", "some"), LOGS)
def test_independent_decoder_decodes_every_frame(met, which, some, node_mavlink):
    done = subprocess.run(
        [shutil.which("node"), HERE / "decode.mjs", met[which]], capture_output=True, text=True, timeout=READING,
        cwd=node_mavlink,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    read = json.loads(done.stdout)
    assert read["frames"] == read["valid"] == read["decoded"] > 500
    assert read["invalid"] == read["unknown"] == 0
    assert set(read["counts"]) >= some
