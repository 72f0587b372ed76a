"""Arming and modes, as each client numbers them."""

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.vehicle.profile import PROFILES
from cosim.simulation.commands.commands import MODES, Arm, Reset, SetMode, SetTarget
from tests.cosim.mavlink.station import NAN, Station, scenario

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
SET_MODE = 176


@pytest.fixture(params=["ardusub", "px4", "generic"])
def station(request):
    station = Station(request.param)
    station.look()
    return station


def test_arm_and_disarm_commands_are_applied(station):
    assert station.command(400, 1.0) == ACCEPTED
    assert station.command(400, 0.0, 21196.0) == ACCEPTED
    assert station.command(400, NAN) == DENIED
    assert station.command(400, 2.0) == DENIED
    assert station.commanded() == [Arm(True), Arm(False)]


@pytest.mark.medium(fast=13)
@pytest.mark.parametrize(
    ("profile", "numbers", "mode"),
    [
        ("ardusub", (19,), "manual"),  # as pymavlink's mode_mapping_sub and ArduSub's modes have them
        ("ardusub", (16,), "hold"),
        ("ardusub", (4,), "reach"),
        ("ardusub", (3,), "mission"),
        ("ardusub", (9,), "surface"),
        ("ardusub", (0,), "stabilize"),
        ("ardusub", (2,), "depth_hold"),
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
    upload(station)
    for base in (1, 129):
        assert station.command(SET_MODE, base, *numbers) == ACCEPTED
    assert station.commanded()[-2:] == [SetMode(mode), SetMode(mode)]


@pytest.mark.medium(fast=11)
@pytest.mark.parametrize("profile", ["px4", "generic"])
@pytest.mark.parametrize("number", [0, 3, 4, 9, 16, 19, 20, 21])
def test_ardusub_mode_numbers_are_unknown_to_other_profiles(profile, number):
    station = Station(profile)
    station.look()
    assert station.command(SET_MODE, 1, number, 0) == FAILED
    assert "no such mode" in "".join(station.wire.texts)
    assert station.commanded() == []


@pytest.mark.parametrize("number", [1, 6, 7, 20, 21, 77])
def test_unknown_mode_is_rejected(number):
    station = Station("ardusub")
    station.look()
    assert station.command(SET_MODE, 1, number) == FAILED
    assert station.commanded() == []


def test_a_mode_needs_the_bit_of_custom_modes(station):
    assert station.command(SET_MODE, 208, 0.0) == FAILED
    assert station.command(SET_MODE, NAN, 4.0) == FAILED
    assert station.commanded() == []


def test_set_mode_message_is_applied():
    for name, number in (("ardusub", 9), ("px4", 4 << 16 | 6 << 24), ("generic", 4 << 16 | 6 << 24)):
        station = Station(name)
        station.look()
        station.send(mavlink.MAVLink_set_mode_message(1, 1, number))
        station.send(mavlink.MAVLink_set_mode_message(1, 0, number))  # without the bit of custom modes
        assert station.commanded() == [SetMode("surface")]


def test_standard_modes_are_applied(station):
    upload(station)
    station.commanded()
    for number, mode in ((1, "hold"), (6, "mission"), (5, "surface"), (4, "depth_hold")):
        assert station.command(262, number) == ACCEPTED
        assert station.commanded() == [SetMode(mode)]
    for number in (0, 2, 3, 8, NAN):
        assert station.command(262, number) == FAILED
    assert station.commanded() == []


def test_available_modes_list_settable_modes(station):
    assert station.command(512, 435, 0) == ACCEPTED
    modes = station.wire.of("AVAILABLE_MODES")
    assert [(m.number_modes, m.mode_index) for m in modes] == [(7, i) for i in range(1, 8)]
    profile = PROFILES[station.autopilot._context.options.profile]
    upload(station)
    station.commanded()
    for message in modes:
        if message.mode_name != "Mission of regions":
            station.send(mavlink.MAVLink_set_mode_message(1, 1, message.custom_mode))
            (command,) = station.commanded()
            assert profile.custom_modes[command.mode] == message.custom_mode
    assert station.command(512, 435, 8) == FAILED
    station.wire.clear()
    station.command(512, 435, 3)
    (one,) = station.wire.of("AVAILABLE_MODES")
    assert (one.mode_index, one.mode_name) == (3, "Region reaching")


@pytest.mark.parametrize("armed", [0.0, 1.0])
def test_base_mode_equals_that_of_ardusub(armed):
    """ArduSub's base_mode(): stabilised and manual input in all modes, guided where it finds its own way."""
    station = Station("ardusub")
    for number, guided in ((0, 0), (2, 0), (3, 8), (4, 8), (9, 0), (16, 8), (19, 0)):
        mode = PROFILES["ardusub"].find_mode(number)
        station.look(1.0, **{"commands.mode": float(MODES.index(mode)), "commands.armed": armed})
        station.command(512, 0)
        beat = station.wire.of("HEARTBEAT")[-1]
        assert (beat.custom_mode, beat.base_mode) == (number, 1 + 16 + 64 + guided + 128 * int(armed))


def test_the_mode_shown_is_that_of_the_snapshot(station):
    numbers = PROFILES[station.autopilot._context.options.profile].custom_modes
    station.command(262, 1)  # hold
    station.command(512, 436)
    mode = station.wire.of("CURRENT_MODE")[-1]
    assert (mode.custom_mode, mode.intended_custom_mode) == (numbers["reach"], numbers["hold"])
    station.wire.clear()
    station.look(1.01, **{"commands.mode": 1.0})
    assert station.wire.of("CURRENT_MODE")[-1].custom_mode == numbers["hold"]  # at once
    assert station.wire.of("HEARTBEAT")[-1].custom_mode == numbers["hold"]
    assert "Mode: Position hold" in station.wire.texts


def test_a_mission_is_needed_for_its_mode(station):
    assert station.command(262, 6) == FAILED
    assert "Refused: there is no mission" in station.wire.texts


def test_pause_and_continue_are_applied(station):
    assert station.command(193, 0.0) == ACCEPTED
    assert station.command(193, 1.0) == ACCEPTED
    assert station.command(252, 0.0, 2.0) == ACCEPTED
    assert station.command(252, 0.0, 2.0) == ACCEPTED
    assert station.command(252, 1.0) == ACCEPTED
    assert station.commanded() == [SetMode(mode) for mode in ("hold", "reach", "hold", "hold", "reach")]
    assert station.command(252, 0.0, 3.0) == UNSUPPORTED


def test_land_surfaces_and_home_is_at_the_surface(station):
    assert station.command(21) == ACCEPTED
    assert station.command(20) == ACCEPTED
    assert station.commanded() == [SetMode("surface"), SetTarget((0.0, 0.0, 0.5), 0.3)]


@pytest.mark.parametrize("profile", ["px4", "generic"])
def test_px4_return_mode_surfaces_at_home(profile):
    station = Station(profile)
    station.look()
    assert station.command(176, 129, 4, 5) == ACCEPTED
    station.send(mavlink.MAVLink_set_mode_message(1, 1, 4 << 16 | 5 << 24))
    assert station.commanded() == [SetTarget((0.0, 0.0, 0.5), 0.3)] * 2
    assert station.command(176, 129, -4, -5) == mavlink.MAV_RESULT_FAILED


def test_a_restart_is_refused_while_armed(station):
    assert station.command(246, 1.0) == DENIED
    assert station.command(246, 1.0, 0, 0, 0, 0, 20190226.0) == ACCEPTED
    station.look(2.0, **{"commands.armed": 0.0})
    assert station.command(246, 1.0) == ACCEPTED
    assert station.command(246, 3.0) == UNSUPPORTED
    assert station.commanded() == [Reset(), Reset()]


def test_commanded_mode_is_reported_before_the_first_snapshot():
    station = Station(of=scenario("commands.await_arm=true"))
    station.command(262, 1)
    station.command(512, 0)
    beat = station.wire.of("HEARTBEAT")[-1]
    assert (beat.custom_mode, beat.base_mode & 128) == (16, 0)


def test_full_command_queue_rejects_commands(station):
    results = [station.command(400, 1.0) for _ in range(300)]
    assert results == [ACCEPTED] * 256 + [REJECTED] * 44


def test_read_only_rejects_modes():
    station = Station(commands=False)
    station.look()
    assert [station.command(n, 1.0) for n in (400, 20, 21, 246, 179, 300)] == [DENIED] * 6
    assert station.command(176, 1, 16) == DENIED
    assert [station.command(n, 30.0, 0.0) for n in (511, 510, 512, 520, 42428, 410)] == [ACCEPTED] * 6
    assert "Refused: commands are off: start with --commands" in "".join(station.wire.texts)


def upload(station):
    home = int(station.autopilot._context.profile.has_home_item)
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 1 + home, 0))
    for seq in range(1 + home):
        station.send(mavlink.MAVLink_mission_item_int_message(1, 1, seq, 1, 16, 0, 1, 0, 0, 0, 0, 10_000, 0, 2.0, 0))
