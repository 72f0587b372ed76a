"""Arming and modes, as each client numbers them."""

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.vehicle.profile import PROFILES
from cosim.simulation.commands.commands import MODES, Arm, Reset, SetMode, SetTarget
from tests.cosim.mavlink.station import NAN, Station, scenario
from tests.cosim.mavlink.test_mission import upload

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
ARM, SET_MODE, STANDARD_MODE, ONCE, GOTO, PAUSE, RESTART = 400, 176, 262, 512, 252, 193, 246
AT_HOME = SetTarget((0.0, 0.0, 0.5), 0.3)

# each command with its parameters and MAV_RESULT, and what the vehicle is commanded by all together
EXCHANGES = {
    "arm and disarm": ([(ARM, (1.0,), ACCEPTED), (ARM, (0.0, 21196.0), ACCEPTED), (ARM, (NAN,), DENIED),
                        (ARM, (2.0,), DENIED)], [Arm(True), Arm(False)]),
    "no bit of custom modes": ([(SET_MODE, (208, 0.0), FAILED), (SET_MODE, (NAN, 4.0), FAILED)], []),
    "no such command": ([(65000, (), UNSUPPORTED)], []),
    "no mission": ([(STANDARD_MODE, (6,), FAILED)], []),
    "no such standard mode": ([(STANDARD_MODE, (number,), FAILED) for number in (0, 2, 3, 8, NAN)], []),
    "pause and continue": (
        [(PAUSE, (0.0,), ACCEPTED), (PAUSE, (1.0,), ACCEPTED), *[(GOTO, (0.0, 2.0), ACCEPTED)] * 2,
         (GOTO, (1.0,), ACCEPTED), (GOTO, (0.0, 3.0), UNSUPPORTED)],
        [SetMode(mode) for mode in ("hold", "reach", "hold", "hold", "reach")]),
    "land, and return home": ([(21, (), ACCEPTED), (20, (), ACCEPTED)], [SetMode("surface"), AT_HOME]),
    "restart": ([(RESTART, (1.0,), DENIED), (RESTART, (1.0, 0, 0, 0, 0, 20190226.0), ACCEPTED),
                 (RESTART, (3.0,), UNSUPPORTED)], [Reset()]),
}  # fmt: skip


@pytest.fixture(params=["ardusub", "px4", "generic"])
def station(request):
    station = Station(request.param)
    station.look()
    return station


@pytest.mark.parametrize(("sent", "commands"), EXCHANGES.values(), ids=EXCHANGES)
def test_commands_are_answered_and_applied(station, sent, commands):
    assert [station.command(number, *numbers) for number, numbers, _ in sent] == [result for *_, result in sent]
    assert station.commanded() == commands
    if not commands and sent[0][0] == STANDARD_MODE:
        assert any(
            text.startswith(("Refused: there is no mission", "Refused: no such mode")) for text in station.wire.texts
        )


@pytest.mark.medium(fast=13)
@pytest.mark.parametrize(
    ("profile", "numbers", "mode"),
    [
        # as pymavlink's mode_mapping_sub and ArduSub's modes have them
        *(("ardusub", (number,), mode) for number, mode in (
            (19, "manual"), (16, "hold"), (4, "reach"), (3, "mission"), (9, "surface"), (0, "stabilize"),
            (2, "depth_hold"))),
        # as MAVSDK and QGC send them to PX4, and MAVSDK to any other autopilot that is not ArduPilot
        *((p, n, m) for p in ("px4", "generic") for n, m in [
            ((1, 0), "manual"), ((1, NAN), "manual"), ((4, 3), "hold"), ((6, 0), "reach"), ((4, 4), "mission"),
            ((4, 6), "surface"), ((7, 0), "stabilize"), ((2, 0), "depth_hold"),
        ]),
    ],
)  # fmt: skip
def test_mode_numbers_follow_the_profile(profile, numbers, mode):
    station = Station(profile)
    station.look()
    upload(station, {})
    for base in (1, 129):
        assert station.command(SET_MODE, base, *numbers) == ACCEPTED
    assert station.commanded()[-2:] == [SetMode(mode), SetMode(mode)]


@pytest.mark.medium(fast=11)
@pytest.mark.parametrize(
    ("profile", "number"),
    [*((profile, number) for profile in ("px4", "generic") for number in (0, 3, 4, 9, 16, 19, 20, 21)),
     *(("ardusub", number) for number in (1, 6, 7, 20, 21, 77))],
)  # fmt: skip
def test_modes_that_the_profile_lacks_are_rejected(profile, number):
    station = Station(profile)
    station.look()
    assert station.command(SET_MODE, 1, number, 0) == FAILED
    assert "no such mode" in "".join(station.wire.texts) and station.commanded() == []


@pytest.mark.parametrize(
    ("name", "number"), [("ardusub", 9), ("px4", 4 << 16 | 6 << 24), ("generic", 4 << 16 | 6 << 24)]
)
def test_set_mode_message_is_applied(name, number):
    station = Station(name)
    station.look()
    station.send(mavlink.MAVLink_set_mode_message(1, 1, number))
    station.send(mavlink.MAVLink_set_mode_message(1, 0, number))  # without the bit of custom modes
    assert station.commanded() == [SetMode("surface")]


@pytest.mark.parametrize("profile", ["px4", "generic"])
def test_px4_return_mode_surfaces_at_home(profile):
    station = Station(profile)
    station.look()
    assert station.command(SET_MODE, 129, 4, 5) == ACCEPTED
    station.send(mavlink.MAVLink_set_mode_message(1, 1, 4 << 16 | 5 << 24))
    assert station.commanded() == [AT_HOME] * 2
    assert station.command(SET_MODE, 129, -4, -5) == FAILED


def test_standard_modes_are_applied(station):
    upload(station, {})
    station.commanded()
    for number, mode in ((1, "hold"), (6, "mission"), (5, "surface"), (4, "depth_hold")):
        assert station.command(STANDARD_MODE, number) == ACCEPTED
        assert station.commanded() == [SetMode(mode)]


def test_available_modes_list_settable_modes(station):
    assert station.command(ONCE, 435, 0) == ACCEPTED
    modes = station.wire.of("AVAILABLE_MODES")
    assert [(m.number_modes, m.mode_index) for m in modes] == [(7, i) for i in range(1, 8)]
    upload(station, {})
    station.commanded()
    for message in modes:
        station.send(mavlink.MAVLink_set_mode_message(1, 1, message.custom_mode))
        (command,) = station.commanded()
        assert station.profile.custom_modes[command.mode] == message.custom_mode
    assert station.command(ONCE, 435, 8) == FAILED
    station.wire.clear()
    station.command(ONCE, 435, 3)
    (one,) = station.wire.of("AVAILABLE_MODES")
    assert (one.mode_index, one.mode_name) == (3, "Region reaching")


@pytest.mark.parametrize("armed", [0.0, 1.0])
def test_base_mode_equals_that_of_ardusub(armed):
    """ArduSub's base_mode(): stabilized and manual input in all modes, guided where it finds its own way."""
    station = Station("ardusub")
    for number, guided in ((0, 0), (2, 0), (3, 8), (4, 8), (9, 0), (16, 8), (19, 0)):
        mode = PROFILES["ardusub"].find_mode(number)
        station.look(1.0, **{"commands.mode": float(MODES.index(mode)), "commands.armed": armed})
        station.command(ONCE, 0)
        beat = station.wire.of("HEARTBEAT")[-1]
        assert (beat.custom_mode, beat.base_mode) == (number, 1 + 16 + 64 + guided + 128 * int(armed))
        assert beat.system_status == (mavlink.MAV_STATE_ACTIVE if armed else mavlink.MAV_STATE_STANDBY)


def test_the_mode_shown_is_that_of_the_snapshot(station):
    numbers = station.profile.custom_modes
    station.command(STANDARD_MODE, 1)  # hold
    station.command(ONCE, 436)
    mode = station.wire.of("CURRENT_MODE")[-1]
    assert (mode.custom_mode, mode.intended_custom_mode) == (numbers["reach"], numbers["hold"])
    station.wire.clear()
    station.look(1.01, **{"commands.mode": 1.0})
    for name in ("CURRENT_MODE", "HEARTBEAT"):
        assert station.wire.of(name)[-1].custom_mode == numbers["hold"]  # at once
    assert "Mode: Position hold" in station.wire.texts


def test_a_disarmed_vehicle_is_restarted(station):
    station.look(2.0, **{"commands.armed": 0.0})
    assert station.command(RESTART, 1.0) == ACCEPTED and station.commanded() == [Reset()]


def test_commanded_mode_is_reported_before_the_first_snapshot():
    station = Station(of=scenario("commands.await_arm=true"))
    station.command(STANDARD_MODE, 1)
    station.command(ONCE, 0)
    beat = station.wire.of("HEARTBEAT")[-1]
    assert (beat.custom_mode, beat.base_mode & 128) == (16, 0)


def test_full_command_queue_rejects_commands(station):
    results = [station.command(ARM, 1.0) for _ in range(300)]
    assert results == [ACCEPTED] * 256 + [REJECTED] * 44


def test_read_only_rejects_modes():
    station = Station(commands=False)
    station.look()
    assert [station.command(n, 1.0) for n in (ARM, 20, 21, RESTART, 179, 300)] == [DENIED] * 6
    assert station.command(SET_MODE, 1, 16) == DENIED
    assert [station.command(n, 30.0, 0.0) for n in (511, 510, ONCE, 520, 42428, 410)] == [ACCEPTED] * 6
    assert "Refused: commands are off: start with --commands" in "".join(station.wire.texts)
