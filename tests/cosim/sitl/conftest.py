"""A server in a thread, for stand-in autopilots to connect to."""

import threading
from functools import partial

import pytest

from cosim.sitl.hil_server import HilServer
from cosim.sitl.json_server import JsonServer
from cosim.sitl.law import make_control_law, make_pwm_law
from cosim.sitl.sitl_session import FlightOptions, SitlSession


class Served(threading.Thread):
    """Serves until it ends by itself; `outcome` waits for that."""

    def __init__(self, server):
        super().__init__(daemon=True)
        self.server, self.address = server, server.address
        self._outcome = self._error = None

    def run(self):
        try:
            self._outcome = self.server.serve()
        except BaseException as error:  # noqa: BLE001
            self._error = error

    def outcome(self):
        self.join(240.0)
        assert not self.is_alive()
        if self._error:
            raise self._error
        return self._outcome


@pytest.fixture
def serve(tmp_path):
    """Return a function that begins to serve; each server has a folder of its own."""
    begun = []

    def begin(*overrides, kind=JsonServer, of=("ardupilot", make_pwm_law), vehicle="bluerov2_heavy", timeout=30.0,
              record_rate=2000.0, **more):  # fmt: skip
        out = tmp_path / f"run{len(begun)}"
        options = FlightOptions("sitl", overrides, vehicle, out, record_rate, report=False, **more)
        served = Served(kind(SitlSession(options, *of), ("127.0.0.1", 0), timeout))
        begun.append(served)
        served.start()
        return served

    yield begin
    for served in begun:
        served.join(60.0)


@pytest.fixture
def serve_px4(serve):
    return partial(serve, kind=HilServer, of=("px4", make_control_law), record_rate=1000.0)
