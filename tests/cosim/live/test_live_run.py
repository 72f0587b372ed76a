"""A run with a live view: viewers receive the record, and do not change it."""

import logging
import socket

import numpy as np
import pytest

from cosim.live.hub import Hub
from cosim.results.record import load_record
from cosim.results.wording import verdict
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from tests.cosim.live.conftest import require_same_record


@pytest.mark.medium
@pytest.mark.parametrize("rate", [2.0, None])
def test_viewers_see_rows_of_the_record_to_the_last_bit(live, rate):
    running = live(rate=rate)
    with running.viewer() as viewer:
        end = viewer.until("end")
    done = running.end()
    record = load_record(done.folder)
    steps = np.round(viewer.column("time") / 0.01).astype(int)
    assert steps[-1] == len(record["time"]) - 1 and (np.diff(steps) > 0).all()
    assert rate is None or len(steps) > 3
    for signal in viewer.headers[0]["signals"]:
        if signal["name"] in record.units:
            assert np.array_equal(viewer.column(signal["name"]), record[signal["name"]][steps]), signal["name"]
    assert end == {"type": "end", "status": "completed", "verdict": verdict(done.summary)}


@pytest.mark.medium
def test_viewers_do_not_change_the_record(live, tmp_path):
    alone = run_scenario(load_scenario("harbour", ["time.duration=2"]), tmp_path / "alone", report=False)
    running = live(rate=4.0)
    with running.viewer() as one, running.viewer() as other:
        one.until("end")
        other.until("end")
    require_same_record(alone, running.end())
    assert np.array_equal(one.column("time")[-5:], other.column("time")[-5:])


@pytest.mark.slow
def test_late_viewer_receives_the_history(live):
    running = live(rate=2.0)
    with running.viewer() as early:
        while not early.rows or early.column("time")[-1] < 0.5:
            early.receive()
        with running.viewer() as late:
            late.until("rows")
            assert late.column("time")[0] == 0.0
            late.until("end")
        early.until("end")
    assert np.array_equal(early.column("time"), late.column("time"))


@pytest.mark.slow
def test_stalled_viewer_does_not_block_others(live, tmp_path):
    running = live(rate=2.0)
    host, port = running.address
    with socket.create_connection(running.address) as lazy:
        lazy.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        ask = [f"GET /ws HTTP/1.1\r\nHost: {host}:{port}", "Upgrade: websocket", "Connection: Upgrade",
               "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==", "Sec-WebSocket-Version: 13", "\r\n"]  # fmt: skip
        lazy.sendall("\r\n".join(ask).encode())
        with running.viewer() as viewer:
            viewer.until("end")
        assert running.end().summary["status"] == "completed"
        assert viewer.column("time")[-1] == 2.0


@pytest.mark.slow
def test_reset_starts_a_new_run_for_the_viewers(live):
    running = live(commands=True, await_arm=False, rate=2.0)
    with running.viewer() as viewer:
        while not viewer.rows or viewer.column("time")[-1] < 0.2:
            viewer.receive()
        viewer.command(command="reset")
        assert viewer.until("end")["status"] == "reset"
        viewer.until("header")
        viewer.until("rows")
        assert viewer.column("time")[0] == 0.0
        viewer.command(command="set_mode", mode="hold")
        assert viewer.until("end")["status"] == "completed"
    assert "Holds its place" in viewer.texts_of("command")
    assert running.end().folder.name == "live-2"


@pytest.mark.slow
def test_view_error_is_logged_and_the_run_continues(live, monkeypatch, caplog):
    def broken(*_):
        raise ZeroDivisionError("made up")

    monkeypatch.setattr(Hub, "show", broken)
    running = live(rate=4.0)
    assert running.end().summary["status"] == "completed"
    assert "the run goes on" in caplog.text and "made up" in caplog.text


def test_late_command_rejection_reaches_the_viewer(live, caplog):
    running = live("harbour", "commands.obstacles=1", commands=True)
    with running.viewer() as viewer, caplog.at_level(logging.WARNING):
        viewer.until("header")
        for number in (1, 2):
            viewer.command(command="add_obstacle", number=number, position=[1.0, 50.0, 3.0], radius=0.5)
        viewer.fly()
    assert any("no room for obstacle 2" in text for text in viewer.texts_of("warning"))
