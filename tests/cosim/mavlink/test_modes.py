"""Arming and modes, as each client numbers them."""

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.vehicle.profile import PROFILES
from cosim.simulation.commands.commands import MODES, Arm, Reset, SetMode, SetTarget
from tests.cosim.mavlink.station import ACCEPTED, DENIED, FAILED, NAN, REJECTED, UNSUPPORTED, Station, long, scenario
from tests.cosim.mavlink.stubs import message
from tests.cosim.mavlink.test_mission import upload

ARM, SET_MODE, STANDARD_MODE, ONCE, GOTO, PAUSE, RESTART, HOME, LAND = 400, 176, 262, 512, 252, 193, 246, 20, 21
AT_HOME = SetTarget((0.0, 0.0, 0.5), 0.3)
UP = {"ardusub": 9, "px4": 4 << 16 | 6 << 24, "generic": 4 << 16 | 6 << 24}  # custom mode to surface

EXCHANGES = {
    "arm and disarm": [(long(ARM, 1.0), ACCEPTED), (long(ARM, 0.0, 21196.0), ACCEPTED), (long(ARM, NAN), DENIED),
                       (long(ARM, 2.0), DENIED), [Arm(True), Arm(False)]],
    "no bit of custom modes": [(long(SET_MODE, 208, 0.0), FAILED), (long(SET_MODE, NAN, 4.0), FAILED), []],
    "no such command": [(long(65000), UNSUPPORTED), []],
    "no mission": [(long(STANDARD_MODE, 6), FAILED), "Refused: there is no mission", []],
    "no such standard mode": [*((long(STANDARD_MODE, number), FAILED) for number in (0, 2, 3, 8, NAN)),
                              "Refused: no such mode", []],
    "pause and continue": [
        *((long(PAUSE, value), ACCEPTED) for value in (0.0, 1.0)), *[(long(GOTO, 0.0, 2.0), ACCEPTED)] * 2,
        (long(GOTO, 1.0), ACCEPTED), (long(GOTO, 0.0, 3.0), UNSUPPORTED),
        [SetMode(mode) for mode in ("hold", "reach", "hold", "hold", "reach")]],
    "continue in the mode before": [{"commands.mode": 6.0}, *((long(PAUSE, value), ACCEPTED) for value in (0.0, 1.0)),
                                    [SetMode("hold"), SetMode("depth_hold")]],
    "land, and return home": [(long(LAND), ACCEPTED), (long(HOME), ACCEPTED), [SetMode("surface"), AT_HOME]],
    "restart": [(long(RESTART, 1.0), DENIED), (long(RESTART, 1.0, 0, 0, 0, 0, 20190226.0), ACCEPTED),
                (long(RESTART, 3.0), UNSUPPORTED), [Reset()]],
    "restart of a disarmed vehicle": [{"commands.armed": 0.0}, (long(RESTART, 1.0), ACCEPTED), [Reset()]],
    "more commands than the queue holds": [
        *[(long(ARM, 1.0), ACCEPTED)] * 256, *[(long(ARM, 1.0), REJECTED)] * 44, [Arm(True)] * 256],
}  # fmt: skip


@pytest.mark.parametrize("steps", EXCHANGES.values(), ids=EXCHANGES)
def test_commands_are_answered_and_applied(each_station, steps):
    each_station.play(*steps)


_PX4 = {"manual": [(1, 0), (1, NAN)], "hold": [(4, 3)], "reach": [(6, 0), (6 << 16, 0)], "mission": [(4, 4)],
        "surface": [(4, 6)], "stabilize": [(7, 0)], "depth_hold": [(2, 0)]}  # fmt: skip
_ARDUSUB = {"manual": [(19,)], "hold": [(16,)], "reach": [(4,)], "mission": [(3,)], "surface": [(9,)],
            "stabilize": [(0,)], "depth_hold": [(2,)]}  # fmt: skip
# the parameters of DO_SET_MODE for each mode, and what is none: as pymavlink's mode_mapping_sub and ArduSub's modes
# have them; as MAVSDK and QGC send them to PX4, and MAVSDK to any other autopilot that is not ArduPilot
NUMBERS = {"ardusub": (_ARDUSUB, (1, 6, 7, 20, 21, 77)),
           **dict.fromkeys(("px4", "generic"), (_PX4, (0, 3, 4, 9, 16, 19, 20, 21)))}  # fmt: skip


def test_mode_numbers_follow_the_profile(each_station):
    upload(each_station, {})
    each_station.commanded()
    modes, missing = NUMBERS[each_station.profile.name]
    assert modes.keys() == set(MODES)
    for mode, numbers in ((mode, numbers) for mode, several in modes.items() for numbers in several):
        each_station.play(*((long(SET_MODE, base, *numbers), ACCEPTED) for base in (1, 129)), [SetMode(mode)] * 2)
    each_station.play(*((long(SET_MODE, 1, number, 0), FAILED) for number in missing), [], "no such mode")


def test_set_mode_message_is_applied(each_station):
    number = UP[each_station.profile.name]
    each_station.play(message("SET_MODE", 1, custom_mode=number), [SetMode("surface")])
    each_station.play(message("SET_MODE", target_system=1, custom_mode=number), [])  # without the bit of custom modes


@pytest.mark.parametrize("profile", ["px4", "generic"])
def test_px4_return_mode_surfaces_at_home(profile):
    station = Station(profile)
    station.play({}, (long(SET_MODE, 129, 4, 5), ACCEPTED), message("SET_MODE", 1, custom_mode=4 << 16 | 5 << 24),
                 [AT_HOME] * 2, (long(SET_MODE, 129, -4, -5), FAILED), [])  # fmt: skip


def test_standard_modes_are_applied(each_station):
    upload(each_station, {})
    each_station.commanded()
    for number, mode in ((1, "hold"), (6, "mission"), (5, "surface"), (4, "depth_hold")):
        each_station.play((long(STANDARD_MODE, number), ACCEPTED), [SetMode(mode)])


def test_available_modes_list_settable_modes(each_station):
    station, modes = each_station, each_station.request(435, 0)
    assert [(m.number_modes, m.mode_index) for m in modes] == [(7, i) for i in range(1, 8)]
    upload(station, {})
    station.commanded()
    for entry in modes:
        station.send(message("SET_MODE", 1, custom_mode=entry.custom_mode))
        (command,) = station.commanded()
        assert station.profile.custom_modes[command.mode] == entry.custom_mode
    assert station.command(ONCE, 435, 8) == FAILED
    assert [(entry.mode_index, entry.mode_name) for entry in station.request(435, 3)] == [(3, "Region reaching")]


@pytest.mark.parametrize("armed", [0.0, 1.0])
def test_base_mode_equals_that_of_ardusub(station, armed):
    """ArduSub's base_mode(): stabilized and manual input in all modes, guided where it finds its own way."""
    for number, guided in ((0, 0), (2, 0), (3, 8), (4, 8), (9, 0), (16, 8), (19, 0)):
        mode = PROFILES["ardusub"].find_mode(number)
        station.play({"commands.mode": float(MODES.index(mode)), "commands.armed": armed})
        beat = station.request(0)[-1]
        assert (beat.custom_mode, beat.base_mode) == (number, 1 + 16 + 64 + guided + 128 * int(armed))
        assert beat.system_status == (mavlink.MAV_STATE_ACTIVE if armed else mavlink.MAV_STATE_STANDBY)


def test_the_mode_shown_is_that_of_the_snapshot(each_station):
    station, numbers = each_station, each_station.profile.custom_modes
    station.command(STANDARD_MODE, 1)  # hold
    (mode,) = station.request(436)
    assert (mode.custom_mode, mode.intended_custom_mode) == (numbers["reach"], numbers["hold"])
    station.wire.clear()
    station.look(0.01, **{"commands.mode": 1.0})
    for name in ("CURRENT_MODE", "HEARTBEAT"):
        assert station.wire.of(name)[-1].custom_mode == numbers["hold"]  # at once
    assert "Mode: Position hold" in station.wire.texts


def test_commanded_mode_is_reported_before_the_first_snapshot():
    station = Station(of=scenario("commands.await_arm=true"))
    station.command(STANDARD_MODE, 1)
    (beat,) = station.request(0)
    assert (beat.custom_mode, beat.base_mode & 128) == (16, 0)


def test_read_only_rejects_modes():
    station = Station(commands=False)
    station.play({}, *((long(n, 1.0), DENIED) for n in (ARM, HOME, LAND, RESTART, 179, 300)),
                 (long(SET_MODE, 1, 16), DENIED), "Refused: commands are off: start with --commands",
                 *((long(n, 30.0, 0.0), ACCEPTED) for n in (511, 510, ONCE, 520, 42428, 410)))  # fmt: skip
