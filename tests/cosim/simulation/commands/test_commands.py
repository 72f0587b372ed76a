"""Commands, their queue and their log."""

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.errors import CommandError, RunError
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands import commands as cmd
from cosim.simulation.commands import sources
from cosim.simulation.commands.settings import LiveSettings
from cosim.simulation.commands.sources import QUEUED, CommandQueue, LoggedCommands, ReplayedCommands

number = st.floats(-1e4, 1e4)
place = st.tuples(number, number, number)
radius = st.floats(1e-3, 1e3)
ITEMS = st.builds(
    cmd.MissionItem,
    st.none() | place,
    st.none() | radius,
    st.none() | st.floats(0, 99),
    st.lists(
        st.builds(cmd.SetHeading, number) | st.builds(cmd.ChangeSetting, st.text(max_size=9), number), max_size=2
    ).map(tuple),
    st.none() | st.just(0),
    st.none() | st.integers(0, 9),
)
COMMANDS_LOG = st.one_of(
    st.builds(cmd.Arm, st.booleans()),
    st.builds(cmd.SetMode, st.sampled_from(cmd.MODES)),
    st.builds(cmd.SetTarget, place, st.none() | radius, st.tuples(*[st.floats(-9, 9)] * 3)),
    st.builds(cmd.SetHeading, number),
    st.builds(cmd.SetDepth, number),
    st.builds(cmd.ManualControl, st.tuples(*[st.floats(-1, 1)] * 6)),
    st.builds(cmd.AddObstacle, st.integers(0, 1 << 16), place, radius),
    st.builds(cmd.RemoveObstacle, st.integers(0, 1 << 16)),
    st.builds(cmd.ShiftRegion, st.text(max_size=30), place),
    st.builds(cmd.ChangeSetting, st.text(max_size=30), number),
    st.builds(cmd.SetMission, st.lists(ITEMS).map(tuple)),
    st.builds(cmd.SetCurrentItem, st.integers(0, 99)),
    st.just(cmd.Reset()),
)


@given(st.lists(st.tuples(st.integers(0, 9), COMMANDS_LOG), max_size=20))
def test_log_replays_every_command_at_its_step(tmp_path_factory, given_commands):
    file = tmp_path_factory.mktemp("log") / "commands.jsonl"
    queue, by_step = CommandQueue(), {}
    for k, command in given_commands:
        by_step.setdefault(k, []).append(command)
    logged = LoggedCommands(queue, file)
    for k in range(10):
        for command in by_step.get(k, []):
            assert queue.submit(command)
        assert list(logged.take(k)) == by_step.get(k, [])
    if not given_commands:
        assert not file.exists()
        return
    recorded = ReplayedCommands(file)
    for k in range(10):
        assert list(recorded.take(k)) == by_step.get(k, [])
    assert recorded.exhausted


def test_log_line_is_readable_json(tmp_path):
    logged = LoggedCommands(queue := CommandQueue(), tmp_path / "log")
    queue.submit(cmd.SetTarget((1.0, 2.0, 3.0), 0.5))
    logged.take(7)
    target = '{"command":"set_target","position":[1.0,2.0,3.0],"radius":0.5,"velocity":[0.0,0.0,0.0]}'
    assert (tmp_path / "log").read_text() == f'{{"step":7,"command":{target}}}\n'


def test_full_queue_rejects_commands():
    queue = CommandQueue()
    assert all(queue.submit(cmd.Arm(True)) for _ in range(QUEUED))
    assert not queue.submit(cmd.Arm(False))
    assert len(queue.take(0)) == QUEUED


def test_resets_of_a_session_are_bounded(monkeypatch):
    monkeypatch.setattr(sources, "RUNS", 3)
    queue = CommandQueue()
    for run in range(3):
        assert queue.submit(cmd.Reset(), run) == (run < 2)
        assert queue.submit(cmd.Arm(True), run)
        if run == 2:
            assert queue.refusal(cmd.Reset(), run) == "no further reset: a session has 3 runs at most"
            break
        queue.end_run()
    assert queue.take(0) == [cmd.Arm(True)]


@given(st.lists(COMMANDS_LOG, max_size=30), st.integers(1, 400))
def test_log_of_a_run_is_bounded(tmp_path_factory, commands, bound):
    file, queue = tmp_path_factory.mktemp("log") / "commands.jsonl", CommandQueue()
    logged = LoggedCommands(queue, file)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sources, "LOG_BYTES", bound)
        accepted = [command for command in commands if queue.submit(command)]
        refused = bool(commands) and "log has" in queue.refusal(commands[-1])
    assert list(logged.take(0)) == accepted
    sizes = [len(msgspec.json.encode(command)) for command in accepted]
    assert sum(sizes[:-1]) < bound and (refused or sum(sizes) < bound)
    assert refused or accepted == commands
    queue.end_run()
    assert queue.submit(cmd.Arm(True))


def test_commands_for_a_finished_run_are_rejected():
    queue = CommandQueue()
    assert queue.submit(cmd.Arm(True), run=0)
    queue.end_run()
    assert not queue.submit(cmd.Arm(True), run=0)
    assert queue.run == 1 and not queue.take(0)
    assert queue.submit(cmd.Arm(False), run=1) and queue.submit(cmd.Arm(True))
    assert queue.take(0) == [cmd.Arm(False), cmd.Arm(True)]
    assert queue.submit(cmd.Arm(False))


@pytest.mark.parametrize(
    "command",
    [
        cmd.SetTarget((math.nan, 0.0, 0.0)),
        cmd.SetTarget((0.0, math.inf, 0.0)),
        cmd.SetTarget((0.0, 0.0, 0.0), radius=0.0),
        cmd.SetTarget((0.0, 0.0, 0.0), velocity=(1e3, 0.0, 0.0)),
        cmd.AddObstacle(1, (0.0, 0.0, 1e9), 1.0),
        cmd.AddObstacle(1, (0.0, 0.0, 0.0), math.nan),
        cmd.ManualControl((1.1, 0.0, 0.0, 0.0, 0.0, 0.0)),
        cmd.ManualControl((math.nan,) * 6),
        cmd.SetHeading(math.inf),
        cmd.SetAttitude((1.0, 1.0, 0.0, 0.0)),
        cmd.SetAttitude((1.0, 0.0, 0.0, 0.0), (0.0, 1.5, 0.0)),
        cmd.SetAttitude((1.0, 0.0, 0.0, 0.0), (0.0, math.nan, 0.0)),
        cmd.SetAttitude((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), math.nan),
        cmd.ShiftRegion("SR1", (0.0, math.nan, 0.0)),
        cmd.ShiftRegion("SR1", (0.0, 0.0, 2e5)),
        cmd.ChangeSetting("goal.radius", math.nan),
        cmd.SetMission((cmd.MissionItem((0.0, 0.0, 0.0), stay=-1.0),)),
        cmd.SetMission((cmd.MissionItem((0.0, 0.0, math.nan)),)),
        cmd.SetMission((cmd.MissionItem(None, jump=1),)),
        cmd.SetMission((cmd.MissionItem(None, commands=(cmd.SetHeading(math.nan),)),)),
        cmd.SetMission((cmd.MissionItem(None, jump=0, times=-1),)),
    ],
)
def test_non_finite_or_out_of_range_numbers_are_rejected(command):
    with pytest.raises(CommandError, match=r"is .*, expected"):
        cmd.validate_command(command)
    with pytest.raises(CommandError):
        CommandQueue().submit(command)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (cmd.ChangeSetting("goal.radius", math.inf), "goal.radius: value is inf, expected a finite number"),
        (cmd.SetHeading(np.float64(np.nan)), "heading is nan, expected a finite number"),
        (cmd.SetTarget(np.zeros(2)), "position: expected a list of length 3, got 2 (got [0.0, 0.0])"),
        (cmd.SetHeading(1j), "heading: expected a number, got a text (got '1j')"),
    ],
)
def test_message_names_setting_key_and_type(command, message):
    with pytest.raises(CommandError) as caught:
        CommandQueue().submit(command)
    assert str(caught.value) == message


def test_former_key_is_that_of_a_coordinate_and_no_regions_name():
    shape = "{type = 'sphere', center = [3.0, 0.0, 2.0], radius = 1.0}"
    region = f"{{name = 'centre', criterion = 'obstacle', keep = 'out', gain = 1.0, shape = {shape}}}"
    settings = LiveSettings(load_scenario("paper", [f"regions = [{region}]", "intersection = []"]))
    for key, field in (("center.0", "center"), ("centre.1", "center"), ("radius", "radius")):
        settings.change(f"regions.centre.shape.{key}", 7.0)
        assert settings.region_of(f"regions.centre.shape.{key}") == "centre"
        assert 7.0 in np.ravel(getattr(settings.shapes["centre"], field))
    assert settings.shapes["centre"].center == (7.0, 7.0, 2.0)


def test_numbers_may_be_those_of_numpy(tmp_path):
    (queue := CommandQueue()).submit(cmd.SetTarget(np.arange(3.0), radius=np.float64(1.5)))
    queue.submit(cmd.AddObstacle(np.int64(4), (0.0, 0.0, np.float32(2.0)), 1.0))
    taken = [cmd.SetTarget((0.0, 1.0, 2.0), radius=1.5), cmd.AddObstacle(4, (0.0, 0.0, 2.0), 1.0)]
    assert LoggedCommands(queue, tmp_path / "log").take(0) == taken
    assert ReplayedCommands(tmp_path / "log").take(0) == taken


ARMED = b'{"step":0,"command":{"command":"arm","armed":true}}\n'
BROKEN = {
    "no JSON": b"no JSON",
    "no command": b'{"step":1}',
    "another command": b'{"step":1,"command":{"command":"fly"}}',
    "no argument": b'{"step":1,"command":{"command":"arm"}}',
    "one argument more": b'{"step":1,"command":{"command":"set_heading","heading":1,"and":2}}',
    "null": b'{"step":1,"command":{"command":"set_heading","heading":null}}',
    "out of range": b'{"step":1,"command":{"command":"set_target","position":[1e9,0,0]}}',
    "bad UTF-8": b'{"step":1,"command":{"command":"shift_region","region":"\xff","by":[0,0,0]}}',
    "bad UTF-8 in a key": b'{"step":1,"ord\xffer":{"command":"reset"}}',
    "5,000 nested braces": b'{"step":1,"command":' + b'{"a":' * 5000,
    "5,000 nested brackets": b'{"step":1,"command":{"items":' + b"[" * 5000,
    "a step below 0": b'{"step":-1,"command":{"command":"reset"}}',
    "a step of 5,000 digits": b'{"step":' + b"9" * 5000 + b',"command":{"command":"reset"}}',
    "a step that no run has": b'{"step":100000001,"command":{"command":"reset"}}',
}


@pytest.mark.parametrize("line", BROKEN.values(), ids=BROKEN)
def test_broken_log_is_rejected_with_its_line(tmp_path, line):
    file = tmp_path / "commands.jsonl"
    file.write_bytes(ARMED + line + b"\n" + ARMED)
    with pytest.raises(RunError) as caught:
        ReplayedCommands(file)
    message = str(caught.value)
    assert message.startswith(f"{file}, line 2: ") and message.isprintable() and len(message) < 300 + len(str(file))


def test_missing_log_and_one_of_an_older_version_give_one_line_errors(tmp_path):
    (log := tmp_path / "orders.jsonl").write_bytes(b'{"step":0,"order":{"order":"arm","armed":true}}\n')
    with pytest.raises(RunError, match=r"orders\.jsonl: is a log of an older version \('order'\), expected"):
        ReplayedCommands(log)
    with pytest.raises(RunError, match="No such file"):
        ReplayedCommands(tmp_path / "none.jsonl")


LAST = '{"step":1,"command":{"command":"shift_region","region":"ΩΩΩ","by":[1.25,0.0,0.0]}}'.encode()


@pytest.mark.parametrize("size", [1, 30, *range(len(LAST) - 34, len(LAST) - 26), len(LAST) - 1, len(LAST)])
def test_truncated_last_line_is_ignored(tmp_path, size):
    (file := tmp_path / "commands.jsonl").write_bytes(ARMED + LAST[:size])
    assert len(ReplayedCommands(file).take(1)) == 1 + (size == len(LAST))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (BROKEN["out of range"], r"command\.position\[0\] is 1000000000\.0, expected -100000 to"),
        (
            ARMED[:9] + b',"command":{"command":"set_heading","heading":1e999}}',
            "command.heading is inf, expected a finite",
        ),
        (LAST[:30] + b"\n", "Input"),
    ],
    ids=["whole", "infinite", "cut, with its end"],
)
def test_last_line_that_is_whole_or_has_its_end_is_checked(tmp_path, line, message):
    (file := tmp_path / "commands.jsonl").write_bytes(ARMED + line)
    with pytest.raises(RunError, match=f"line 2: {message}"):
        ReplayedCommands(file)


@pytest.mark.parametrize("index", ["9" * 5000, "٣", "-1", "01", "", "0.0"])
def test_d4_invalid_index_is_rejected(index):
    with pytest.raises(CommandError, match="no setting"):
        LiveSettings(load_scenario("paper")).change(f"goal.center.{index}", 1.0)
