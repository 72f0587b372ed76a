"""Peers for commands of the documents that wait for a connection."""

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.sitl_pilot import HEAD, MAGIC, PULSES, RATE
from cosim.errors import TelemetryError
from cosim.live.address import parse_live
from cosim.live.live_view import LiveView
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.ground_end import GroundLink
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

_ARM = 400  # MAV_CMD_COMPONENT_ARM_DISARM
_PAUSE = 0.05  # s


@contextlib.contextmanager
def _beside(work: Callable[[], object]) -> Iterator[None]:
    """Do something in a thread until the context ends; its failure is raised then."""
    failures: list[Exception] = []

    def guarded() -> None:
        try:
            work()
        except Exception as error:  # noqa: BLE001
            failures.append(error)

    thread = threading.Thread(target=guarded, daemon=True)
    thread.start()
    yield
    thread.join(60.0)
    if thread.is_alive():
        raise TimeoutError("who was to come beside the page's command is still there a minute after its end")
    if failures:
        raise failures[0]


@contextlib.contextmanager
def arming(endpoint: str) -> Iterator[None]:
    """Be a ground station that arms the vehicle at an endpoint as soon as there is one."""
    ended = threading.Event()

    def arm() -> None:
        while not ended.is_set():
            with contextlib.suppress(TelemetryError), GroundLink(parse_endpoint(endpoint, False), None) as link:
                link.send_heartbeat()
                if any(received.name == "HEARTBEAT" for received in link.receive(1.0)):
                    link.send(dialect().MAVLink_command_long_message(1, 1, _ARM, 0, 1.0, *[0.0] * 6))
                    if any(r.name == "COMMAND_ACK" and r.message.result == 0 for r in link.receive(1.0)):
                        return
            ended.wait(_PAUSE)

    with _beside(arm):
        yield
        ended.set()


@contextlib.contextmanager
def flying(port: int) -> Iterator[None]:
    """Act as an ArduPilot that controls the plant behind a port, until the context ends."""
    ended = threading.Event()

    def fly() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.connect(("127.0.0.1", port))
            link.settimeout(0.2)
            count = 0
            while not ended.is_set():
                try:
                    link.send(HEAD.pack(MAGIC, RATE, count) + PULSES)
                    link.recv(65000)
                    count += 1
                except (ConnectionRefusedError, TimeoutError):  # before it listens, and after it ends
                    time.sleep(_PAUSE)

    with _beside(fly):
        yield
        ended.set()


@contextlib.contextmanager
def shown(port: int, scenario: str, folder: str) -> Iterator[None]:
    """Run a second of a scenario that viewers can see at a port."""
    loaded = load_scenario(scenario, ["time.duration=1"])
    with LiveView(parse_live(str(port))) as view:
        with _beside(lambda: run_scenario(loaded, Path(folder), rate=1.0, report=False, live=view)):
            yield
