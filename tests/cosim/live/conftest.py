"""Runs with a live view, and viewers."""

import contextlib
import json
import threading

import numpy as np
import pytest
from websockets.sync.client import connect

from cosim.live.address import parse_live
from cosim.live.live_view import LiveView
from cosim.results.record import load_record
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from tests.threads import ended

ARM = {"command": "arm", "armed": True}
WAIT = 120.0  # s, that nothing should take, however busy the machine


class Viewer:
    """A viewer without a browser that keeps the messages it receives."""

    def __init__(self, url):
        self._connecting = connect(url.replace("http", "ws") + "ws", max_size=None, open_timeout=60.0)
        self.texts, self.headers, self.rows = [], [], []

    def __enter__(self):
        self.socket = self._connecting.__enter__()
        return self

    def __exit__(self, *error):
        self._connecting.__exit__(*error)

    def command(self, **command):
        self.socket.send(json.dumps(command))

    def receive(self):
        """Receive one message and return its kind."""
        message = self.socket.recv(timeout=WAIT)
        if isinstance(message, bytes):
            self.rows += list(np.frombuffer(message, "<f8").reshape(-1, len(self.headers[-1]["signals"])))
            return "rows"
        message = json.loads(message)
        if message["type"] == "header":
            self.headers.append(message["run"])
            self.rows = []
        self.texts.append(message)
        return message["type"]

    def fly(self):
        """Arm the vehicle, and return the message at the end of the run."""
        self.command(**ARM)
        return self.until("end")

    def until(self, kind):
        while self.receive() != kind:
            pass
        return self.texts[-1] if self.texts else None

    def messages_of(self, kind):
        return [text for text in self.texts if text["type"] == kind]

    def texts_of(self, kind):
        return [text["text"] for text in self.messages_of("message") if text["kind"] == kind]

    def column(self, name):
        names = [signal["name"] for signal in self.headers[-1]["signals"]]
        return np.array(self.rows)[:, names.index(name)]


class Running:
    """A run in a thread of its own."""

    def __init__(self, view, folder):
        self.view, self.url, self.folder, self.done = view, view.url, folder, None
        self.socket_url = view.url.replace("http", "ws") + "ws"
        host, port = view.url.removeprefix("http://").strip("/").split(":")
        self.address = host, int(port)

    def start(self, scenario, **options):
        def go():
            with contextlib.suppress(SystemExit):  # of a run that is not wanted any more
                self.done = run_scenario(scenario, self.folder, report=False, live=self.view, **options)

        self.thread = threading.Thread(target=go, daemon=True)
        self.thread.start()

    def end(self):
        assert ended(self.thread, WAIT)
        return self.done

    def fly(self):
        """Arm the vehicle, and return the run."""
        with self.viewer() as viewer:
            viewer.fly()
        return self.end()

    def viewer(self):
        return Viewer(self.url)


@pytest.fixture
def live(tmp_path):
    """Return a function that starts a run; with commands it waits until it is armed."""
    with contextlib.ExitStack() as stack:

        def start(name="harbour", *overrides, commands=False, await_arm=True, **options):
            more = ["commands.enabled=true", f"commands.await_arm={str(await_arm).lower()}"] if commands else []
            view = stack.enter_context(LiveView(parse_live("0")))
            running = Running(view, tmp_path / "live")
            running.start(load_scenario(name, ["time.duration=2", *more, *overrides]), **options)
            stack.callback(ended, running.thread, 0.1)  # some tests have seen enough before the end
            return running

        yield start


def require_same_record(done, other):
    a, b = (load_record(run.folder) for run in (done, other))
    assert list(a.units) == list(b.units)
    assert all(np.array_equal(a[name], b[name], equal_nan=True) for name in a.units)


def replayed(done, folder):
    """Run the scenario and the commands of a run again."""
    scenario = load_scenario(done.folder / "scenario.toml")
    return run_scenario(scenario, folder, report=False, commands_log=done.folder / "commands.jsonl")
