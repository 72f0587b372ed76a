"""Commands of viewers: applied, logged, broadcast, and replayed; or rejected with a reason."""

import json

import numpy as np
import pytest

from cosim.results.record import load_record
from tests.cosim.live.conftest import replayed, require_same_record


def commanded(viewer, *commands):
    """Give commands while the run waits for arming; return how each was refused, after all were answered."""
    viewer.until("header")
    for command in commands:
        viewer.command(**command)
    viewer.command(command="set_heading", heading="north")  # its rejection shows that all before were processed
    while not viewer.texts_of("refused") or "heading: " not in viewer.texts_of("refused")[-1]:
        viewer.receive()
    return viewer.texts_of("refused")[:-1]


@pytest.mark.medium
def test_commands_are_applied_broadcast_and_reproducible(live, tmp_path):
    running = live("harbour", commands=True)
    with running.viewer() as viewer, running.viewer() as other:
        refused = commanded(
            viewer,
            {"command": "set_target", "position": [3.0, -2.0, 2.0], "radius": 0.4},
            {"command": "shift_region", "region": "ship", "by": [1.0, 2.0, 0.5]},
            {"command": "add_obstacle", "number": 9, "position": [5.0, -3.0, 2.0], "radius": 0.3},
            {"command": "change_setting", "key": "regions.pile 1.shape.radius", "value": 0.9},
        )
        assert not refused
        viewer.fly()
        other.until("end")
    done = running.end()
    record = load_record(done.folder)
    assert record.stack([f"target.{a}" for a in "xyz"])[-1].tolist() == [3.0, -2.0, 2.0]
    assert record.stack([f"ship.shift.{a}" for a in "xyz"])[-1].tolist() == [1.0, 2.0, 0.5]
    log = [json.loads(line)["command"]["command"] for line in (done.folder / "commands.jsonl").read_text().splitlines()]
    assert log == ["set_target", "shift_region", "add_obstacle", "change_setting", "arm"]
    assert "ship moved by (1, 2, 0.5) m" in other.texts_of("command")
    assert other.texts_of("command") == viewer.texts_of("command")
    names = [region["name"] for region in other.headers[0]["regions"]]
    received = [change for text in other.messages_of("changes") for change in text["changes"]]
    changes = received or other.headers[0]["changes"]
    shapes = {names[change["region"]]: change["shape"] for change in changes}
    assert shapes["pile 1"]["radius"] == 0.9 and shapes["seen 1"]["radius"] == 0.3
    drawing = {"center": [12.0, 2.0, 3.0], "half_axes": (0.4 * np.eye(3)).tolist()}
    assert shapes["goal"] == {"kind": "sphere", "center": [12.0, 2.0, 3.0], "radius": 0.4, "drawing": drawing}
    require_same_record(done, replayed(done, tmp_path / "again"))


def test_invalid_commands_are_rejected_with_a_reason(live):
    running = live("harbour", commands=True)
    wrong = {
        "expected one of ship": {"command": "shift_region", "region": "shop", "by": [1, 0, 0]},
        "expected one of ship, quay": {"command": "shift_region", "region": "goal", "by": [1, 0, 0]},
        "no such obstacle has been added": {"command": "shift_region", "region": "seen 3", "by": [1, 0, 0]},
        "no command: position[0] is 1000000000.0, expected -100000 to 100000 m": {
            "command": "set_target",
            "position": [1e9, 0, 0],
        },
        "is no setting": {"command": "change_setting", "key": "time.duration", "value": 1.0},
        "commands.pilot_gain is 7": {"command": "change_setting", "key": "commands.pilot_gain", "value": 7.0},
        "command is 'sail', unknown; expected one of add_obstacle, arm, ": {"command": "sail", "to": "Ithaca"},
        "really: unknown key; expected one of armed": {"command": "arm", "armed": True, "really": True},
        "armed is missing": {"command": "arm"},
        "mode: expected one of 'manual', 'hold'": {"command": "set_mode", "mode": "dive"},
    }
    with running.viewer() as viewer:
        refused = commanded(viewer, *wrong.values())
        viewer.fly()
    for reason, text in zip(wrong, refused, strict=True):
        assert reason in text
    assert running.end().summary["commands"] == 1


@pytest.mark.medium
def test_without_commands_flag_every_command_is_rejected(live):
    running = live(rate=4.0)
    with running.viewer() as viewer:
        assert viewer.until("header")["run"]["commands"] is False
        viewer.fly()
    assert viewer.texts_of("refused") == ["commands are off: start with --commands"]
    assert not (running.end().folder / "commands.jsonl").exists()


@pytest.mark.slow
def test_replayed_run_accepts_no_other_commands(live, tmp_path):
    (tmp_path / "commands.jsonl").write_text(
        '{"step":20,"command":{"command":"shift_region","region":"ship","by":[0.0,3.0,0.0]}}\n'
    )
    running = live(commands=True, await_arm=False, commands_log=tmp_path / "commands.jsonl", rate=4.0)
    with running.viewer() as viewer:
        viewer.until("header")
        viewer.command(command="set_mode", mode="hold")
        viewer.until("end")
    assert viewer.texts_of("refused") == ["this run repeats the commands of a log and takes no others"]
    assert "ship moved by (0, 3, 0) m" in viewer.texts_of("command")
    time, shift = viewer.column("time"), viewer.column("ship.shift.y")
    assert np.array_equal(shift, np.where(time < 0.2, 0.0, 3.0))


@pytest.mark.slow
def test_ground_station_and_viewer_command_the_same_run(live):
    from tests.cosim.run.test_run_on_a_link import Station, command, on

    with Station(command(400, 1.0), command(192, -1.0, 1.0, 0.0, 0.7)) as station:
        running = live(commands=True, rate=1.0, mavlink=on(station, commands=True))
        with running.viewer() as viewer:
            viewer.until("header")
            viewer.command(command="shift_region", region="ship", by=[0.0, 1.0, 0.0])
            viewer.until("end")
    log = (running.end().folder / "commands.jsonl").read_text()
    assert '"arm"' in log and '"shift_region"' in log
    assert "Armed" in viewer.texts_of("command") and "ship moved by (0, 1, 0) m" in viewer.texts_of("command")
