"""A real ArduSub, if one is on the path: it arms, dives in MANUAL, and holds its depth in ALT_HOLD."""

import shutil
import subprocess
import time

import pytest

from benchmarks.autopilot.flights import PARAMETERS
from cosim.mavlink.wire.dialect import dialect, make_heartbeat
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.ground_end import GroundLink
from cosim.results.record import load_record

ARDUSUB = shutil.which("ardusub")
MANUAL, ALT_HOLD = 19, 2
DEPTH = 4.0  # m, the commanded depth
WALL = 240.0  # s, after which the test gives up

pytestmark = [pytest.mark.slow, pytest.mark.skipif(ARDUSUB is None, reason="no ardusub on the path")]


class Ground:
    """The least of a ground station, over the autopilot's TCP port."""

    def __init__(self, port, speedup):
        self.link, self.began = GroundLink(parse_endpoint(f"tcp:127.0.0.1:{port}")), time.monotonic()
        self.speedup, self.latest, self.stick, self.sent, self.acks = speedup, {}, 500, {}, []

    def every(self, seconds, message):
        """Send once so many simulated seconds, by the wall clock."""
        now, name = time.monotonic(), message.get_type()
        if now - self.sent.get(name, 0.0) > seconds / self.speedup:
            self.sent[name] = now
            self.link.send(message)

    def command(self, number, *parameters):
        filled = [*parameters, *[0.0] * (7 - len(parameters))]
        self.link.send(dialect().MAVLink_command_long_message(1, 1, number, 0, *filled))

    def until(self, done):
        """Keep in touch until something is so."""
        m = dialect()
        while not done(self):
            assert time.monotonic() - self.began < WALL, {k: str(v) for k, v in self.latest.items()}
            self.every(0.5, make_heartbeat(m, m.MAV_TYPE_GCS, m.MAV_STATE_ACTIVE))
            self.every(0.1, m.MAVLink_manual_control_message(1, 0, 0, self.stick, 0, 0))
            for received in self.link.receive(0.01):
                self.latest[received.name] = received.message
                if received.name == "COMMAND_ACK":
                    self.acks.append((received.message.command, received.message.result))

    def of(self, kind, field, default=0):
        return getattr(self.latest.get(kind), field, default)

    @property
    def now(self):
        """Simulated time [s]."""
        return self.of("ATTITUDE", "time_boot_ms") / 1e3


@pytest.mark.parametrize("speedup", [1, 5])
def test_arms_dives_and_holds_depth_within_5_cm(serve, tmp_path, speedup):
    served = serve(timeout=10.0, record_rate=100.0)
    home = tmp_path / "ardusub"
    home.mkdir()
    shutil.copy(PARAMETERS, home / "own.parm")
    command = [
        ARDUSUB, "--model", "JSON:127.0.0.1", "--home", "55.9097,-3.3203,0,0", "--speedup", str(speedup),
        "--sim-port-out", str(served.address[1]), "--defaults", "own.parm", "--serial0", "tcp:0",
    ]  # fmt: skip
    process = subprocess.Popen(command, cwd=home, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    ground = None
    try:
        ground = Ground(5760, speedup)
        ground.until(lambda g: g.now > 25.0)
        ground.command(176, 1, MANUAL)  # DO_SET_MODE
        ground.command(400, 1)  # COMPONENT_ARM_DISARM
        ground.until(lambda g: g.of("HEARTBEAT", "base_mode") & 128)
        ground.stick = 100
        ground.until(lambda g: g.of("GLOBAL_POSITION_INT", "relative_alt") < -1000 * DEPTH)
        ground.stick = 500
        ground.command(176, 1, ALT_HOLD)
        ground.until(lambda g: g.of("HEARTBEAT", "custom_mode") == ALT_HOLD)
        holding = ground.now
        ground.until(lambda g: g.now > holding + 25.0)
        assert (400, 0) in ground.acks and ground.acks.count((176, 0)) == 2
    finally:
        if ground:
            ground.link.close()
        process.terminate()
        process.wait(30.0)
    outcome = served.outcome()
    (run,) = outcome.runs
    record = load_record(run.folder)
    held = record["position.z"][(record["time"] > holding + 10.0) & (record["time"] < holding + 25.0)]
    assert len(held) >= 1499
    assert abs(held - held.mean()).max() < 0.05
    assert abs(held.mean() - DEPTH) < 1.0  # it coasts on after the stick is let go
    assert outcome.counts.lost == outcome.counts.malformed == 0
