"""Foreign origins, floods and malformed requests neither command nor disturb the run."""

import contextlib
import json
import socket
import urllib.error
import urllib.request

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from cosim.live.command_desk import MAX_LENGTH
from cosim.live.hub import Cursor, Hub
from cosim.live.view_server import MAX_CONNECTIONS
from cosim.scenario.scenario import load_scenario
from cosim.simulation.columns import columns_without_plant
from cosim.simulation.commands import sources
from cosim.simulation.commands.commands import ChangeSetting
from cosim.simulation.commands.sources import CommandQueue
from tests.cosim.live.conftest import WAIT, replayed, require_same_record


def request(url, **headers):
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    return opener.open(urllib.request.Request(url, headers=headers), timeout=WAIT)


def refused(url, status, **headers):
    with pytest.raises(urllib.error.HTTPError) as caught:
        request(url, **headers)
    caught.value.close()
    assert caught.value.code == status


def closed_with(client):
    try:
        while True:
            client.recv(timeout=WAIT)
    except ConnectionClosed as error:
        return error.rcvd.code


def test_only_the_page_is_served_and_only_to_own_origin(live):
    running = live(commands=True)
    with request(running.url) as page:
        text = page.read().decode()
        assert page.headers["Content-Type"] == "text/html; charset=utf-8"
        assert "frame-ancestors 'none'" in page.headers["Content-Security-Policy"]
    assert '<script type="application/json" id="runs">[]</script>' in text
    refused(running.url + "etc/passwd", 404)
    refused(running.url, 403, Host="evil.example")
    refused(running.url, 403, Origin="http://evil.example")
    for headers in ({"Origin": "http://evil.example"}, {"Origin": "null"}):
        with pytest.raises(InvalidStatus) as caught:
            connect(running.socket_url, additional_headers=headers)
        assert caught.value.response.status_code == 403
    running.fly()


@pytest.mark.medium
def test_malformed_requests_do_not_affect_the_run(live, tmp_path, caplog):
    running = live(commands=True)
    url = running.socket_url
    requests = b"GET / HTTP/1.1\r\n\r\n", b"POST /ws HTTP/1.1\r\nHost: a\r\n\r\n"
    for garbage in (b"\x00\xff" * 5000, *requests, b"\r\n" * 999):
        with socket.create_connection(running.address, timeout=WAIT) as foreign, contextlib.suppress(OSError):
            foreign.sendall(garbage)
            foreign.recv(100)
    with connect(url) as client:  # more than a message may have
        with contextlib.suppress(ConnectionClosed):
            client.send("x" * (MAX_LENGTH + 1))
        assert closed_with(client) == 1009
    with connect(url) as client:  # frames that are no frames
        client.socket.sendall(b"\xff" * 1000)
        assert closed_with(client) == 1002
    with running.viewer() as viewer:
        viewer.until("header")
        deep = "[" * 5000, '{"a":' * 3000  # deeper than a parser goes
        number = '{"command":"change_setting","key":"goal.center.' + "9" * 5000 + '","value":1}'
        brief = "", "null", "[]", "{", '{"command":1}', '"arm"', '{"command":"arm","armed":1e999}'
        for bad in (b"\x00" * 100, *brief, *deep, number):
            viewer.socket.send(bad)
            viewer.until("message")
        assert len(viewer.texts_of("refused")) == 11
        assert all(said.isprintable() and len(said) < 300 for said in viewer.texts_of("refused"))
    with connect(url) as client:  # D4: a text that is no UTF-8, by which WebSocket has a connection fail
        client.socket.sendall(b'\x81\x8f\0\0\0\0{"command":"\xff"}')
        assert closed_with(client) == 1007
    with connect(url) as left:  # who goes without a word
        left.socket.shutdown(socket.SHUT_RDWR)
    done = running.fly()
    assert "Traceback" not in caplog.text
    assert done.summary["commands"] == 1
    require_same_record(done, replayed(done, tmp_path / "alone"))


@pytest.mark.slow
def test_flooding_viewer_is_throttled_and_disconnected(live):
    running = live(commands=True)
    with connect(running.socket_url) as flood:
        with contextlib.suppress(ConnectionClosed):
            for _ in range(5000):
                flood.send('{"command":"set_mode","mode":"reach"}')
        assert closed_with(flood) == 1008
    assert running.fly().summary["commands"] < 500


def test_excess_viewers_are_rejected(live):
    running = live(commands=True)
    with contextlib.ExitStack() as stack:
        viewers = [stack.enter_context(running.viewer()) for _ in range(16)]
        for viewer in viewers:
            viewer.until("header")
        with pytest.raises(InvalidStatus) as caught, running.viewer():
            pass
        assert caught.value.response.status_code == 503
        viewers[0].fly()


def test_excess_connections_are_closed_to_preserve_file_descriptors(live):
    running = live(commands=True)
    with contextlib.ExitStack() as stack:
        idle = [
            stack.enter_context(socket.create_connection(running.address, timeout=WAIT))
            for _ in range(2 * MAX_CONNECTIONS)
        ]
        for late in idle[MAX_CONNECTIONS:]:
            with contextlib.suppress(ConnectionResetError):
                assert late.recv(1) == b""
        for early in idle[:MAX_CONNECTIONS]:
            early.setblocking(False)
            with pytest.raises(BlockingIOError):
                early.recv(1)
    assert running.fly().summary["status"] == "completed"


@pytest.mark.medium
def test_resets_by_a_viewer_end_at_a_bound_and_the_last_run_goes_on(live, monkeypatch, tmp_path):
    monkeypatch.setattr(sources, "RUNS", 3)
    running = live(commands=True, await_arm=False, rate=1.0)
    with running.viewer() as viewer:
        while "no further reset: a session has 3 runs at most" not in viewer.texts_of("refused"):
            if viewer.receive() == "header":
                viewer.command(command="reset")
        viewer.until("end")
    assert running.end().summary["status"] == "completed"
    statuses = {
        file.parent.name: json.loads(file.read_text())["status"] for file in tmp_path.glob("live*/summary.json")
    }
    assert statuses == {"live": "reset", "live-2": "reset", "live-3": "completed"}


@given(st.lists(st.tuples(st.integers(0, 3), st.booleans()), max_size=60))
def test_changes_of_regions_for_late_viewers_are_bounded_and_end_in_the_present_state(changes):
    """Against a list of everything: an early viewer gets all, a late one as many as are kept, the newest of each."""
    scenario = load_scenario("harbour", ["commands.enabled=true"])
    names = [secondary.region.name for secondary in scenario.regions][:4]
    hub, early, everything, received = Hub(), Cursor(), [], []
    hub.begin(0, scenario, columns_without_plant(scenario), CommandQueue())

    def read(cursor):
        texts = []
        while (message := hub.next_for(cursor)) is not None:
            texts += [json.loads(message)]
        return texts

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("cosim.live.hub._MAX_CHANGES", 8)
        read(early)
        for k, (region, looks) in enumerate(changes):
            everything.append((names[region], k + 1.0))
            hub.show_commands(k, [ChangeSetting(f"regions.{names[region]}.gain", k + 1.0)])
            received += read(early) if looks else []
    late = read(Cursor())[0]["run"]["changes"]
    kept = [(hub._regions[change["region"]], change["gain"]) for change in late]
    assert len(kept) <= max(8, len(hub._regions)) and kept == [change for change in everything if change in kept]
    assert dict(kept) == dict(everything)
    received += read(early)
    got = [change["gain"] for text in received if text["type"] == "changes" for change in text["changes"]]
    assert got == sorted(set(got)) and set(got) >= {gain for _, gain in kept}
