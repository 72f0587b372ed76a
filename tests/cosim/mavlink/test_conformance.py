"""The conformance checks: this vehicle passes all, and each check fails on a vehicle with its fault."""

import itertools

import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.wire.options import PROFILES
from tests.cosim.mavlink.conformance import connect, ftp, vehicle
from tests.cosim.mavlink.conformance.checking import CHECKS, check_vehicle
from tests.cosim.mavlink.conformance.client import Client
from tests.cosim.mavlink.conformance.outcome import Subject

pytestmark = pytest.mark.slow

LISTENING = {"heartbeat-rate": 6.0, "stream-rates": 3.0, "home-position": 3.0, "data-stream": 3.0}  # s
# what a busy machine may hold up, so that it has another chance
OF_RATES = {"heartbeat-rate", "stream-rates", "home-position", "message-interval", "data-stream", "qgc-connect"}
ATTEMPTS = 3
QUICKER = {
    connect: {
        "_LIST_TIMEOUT": 0.3,
        "_GAP_TIMEOUT": 0.2,
        "_MISSION_TIMEOUT": 0.2,
        "_ACK_TIMEOUT": 0.3,
        "_MESSAGE_TIMEOUT": 0.2,
    },
    ftp: {"_TIMEOUT": 0.2},
}


@pytest.mark.parametrize("profile", PROFILES)
def test_conforming_vehicle_passes_every_check(profile):
    for _ in range(ATTEMPTS):
        with vehicle.own_vehicle(profile) as link:
            results = list(check_vehicle(link))
        failed = [(result.check.name, result.outcome) for result in results if result.outcome.status == "fail"]
        if not failed or {name for name, _ in failed} - OF_RATES:
            break
    assert failed == []
    assert [result.check.name for result in results] == [check.name for check in CHECKS]
    skipped = {result.check.name for result in results if result.outcome.status == "skip"}
    assert skipped <= {"cached-hash", "ping"}


# ---- faults: each is called with every message that the vehicle sends, and with what sends it ----


def drop(kind):
    return lambda message, send: True if message.get_type() == kind else send(message)


def repeat(kind):
    def fault(message, send):
        if message.get_type() == kind:
            send(message)
        return send(message)

    return fault


def change(kind, **fields):
    def fault(message, send):
        if message.get_type() == kind:
            for name, value in fields.items():
                setattr(message, name, value(getattr(message, name)) if callable(value) else value)
        return send(message)

    return fault


def thin(kind, keep):
    """Send only one of so many."""
    count = itertools.count()
    return lambda message, send: True if message.get_type() == kind and next(count) % keep else send(message)


def drop_index(index):
    return lambda m, send: True if m.get_type() == "PARAM_VALUE" and m.param_index == index else send(m)


FAULTS = {
    "heartbeat-identity": change("HEARTBEAT", mavlink_version=1),
    "heartbeat-custom-mode": change("HEARTBEAT", base_mode=128),
    "heartbeat-rate": thin("HEARTBEAT", 3),
    "autopilot-version": drop("AUTOPILOT_VERSION"),
    "available-modes": change("AVAILABLE_MODES", custom_mode=1),
    "current-mode": change("CURRENT_MODE", custom_mode=77),
    "component-metadata": drop("COMMAND_ACK"),
    "stream-rates": drop("VFR_HUD"),
    "boot-clock": change("ATTITUDE", time_boot_ms=5),
    "sensors-healthy": change("SYS_STATUS", onboard_control_sensors_health=0x100000),
    "no-fence-breach": change("SYS_STATUS", onboard_control_sensors_health=lambda bits: bits & ~0x100000),
    "home-position": drop("HOME_POSITION"),
    "statustext": change("STATUSTEXT", _text_raw=b"\x1b[2J"),
    "message-interval": drop("MESSAGE_INTERVAL"),
    "greedy-interval": lambda m, send: [send(m) for _ in range(5 if m.get_type() == "ATTITUDE" else 1)][-1],
    "unknown-interval": drop("COMMAND_ACK"),
    "data-stream": thin("ATTITUDE", 2),
    "one-ack": repeat("COMMAND_ACK"),
    "command-int": repeat("COMMAND_ACK"),
    "unsupported-command": change("COMMAND_ACK", result=0),
    "wrong-target": lambda m, send: send(m) and send(mavlink.MAVLink_command_ack_message(512, 0)),
    "broadcast": drop("AUTOPILOT_VERSION"),
    "arm-disarm": change("HEARTBEAT", base_mode=lambda bits: bits & ~128),
    "set-modes": change("HEARTBEAT", custom_mode=1),
    "bad-mode": change("COMMAND_ACK", result=0),
    "timesync": drop("TIMESYNC"),
    "ping": drop("PING"),
    "parameter-list": drop_index(3),
    "parameter-read": change("PARAM_VALUE", param_type=6, _param_id_raw=b"OTHER"),
    "parameter-unknown": drop("PARAM_ERROR"),
    "parameter-set": drop("PARAM_VALUE"),
    "parameter-change": change("PARAM_VALUE", param_value=1.0),
    "parameter-nan": drop("PARAM_VALUE"),
    "parameter-file": drop("FILE_TRANSFER_PROTOCOL"),
    "missing-file": drop("FILE_TRANSFER_PROTOCOL"),
    "cached-hash": drop("PARAM_VALUE"),
    "mission-lists": drop("MISSION_COUNT"),
    "mission-current": drop("MISSION_CURRENT"),
    "mission-round-trip": change("MISSION_ITEM_INT", z=0.0),
    "mission-bad-item": change("MISSION_ACK", type=0),
    "qgc-connect": thin("AVAILABLE_MODES", 2),
}


@pytest.fixture(scope="module")
def faulty():
    """Return a link to a vehicle, and a list whose one entry is the fault that it has now."""
    fault = [None]
    honest = vehicle.open_links

    def open_faulty(*arguments):
        (link,) = honest(*arguments)
        send = link.send
        link.send = lambda message: fault[0](message, send) if fault[0] else send(message)
        return [link]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vehicle, "open_links", open_faulty)
        for module, constants in QUICKER.items():
            for name, seconds in constants.items():
                patch.setattr(module, name, seconds)
        with vehicle.own_vehicle("px4") as link:
            yield link, fault


def test_every_single_message_check_has_an_injected_fault():
    of_all = {"sequence-numbers", "mavlink-2"}
    assert {check.name for check in CHECKS} - of_all == set(FAULTS)


@pytest.mark.parametrize("name", FAULTS)
def test_a_vehicle_with_the_fault_fails_the_check(name, faulty):
    link, fault = faulty
    (check,) = [check for check in CHECKS if check.name == name]
    client = Client(link)
    if name != "heartbeat-rate":
        client.find(5.0)
        client.request(mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES, index=2)
    fault[0] = FAULTS[name]
    try:
        assert client.find(10.0) is not None
        for _ in range(5):  # on a busy machine the first messages are of the time before the fault
            client.discard_unread()
            seconds = LISTENING.get(name, 1.2)
            unasked = client.collect(seconds)
            outcome = check.run(Subject(client, tuple(unasked), seconds))
            if outcome.status == "fail":
                break
    finally:
        fault[0] = None
    assert outcome.status == "fail" and outcome.expected, outcome
