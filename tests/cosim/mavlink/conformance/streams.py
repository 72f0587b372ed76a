"""Checks of the streams that the vehicle sends unasked, and of changing their rates."""

from __future__ import annotations

from itertools import pairwise

from tests.cosim.mavlink.conformance.outcome import Check, Outcome, Subject, failed, judged, passed, skipped, speed_of

# message: least rate by the vehicle's clock [Hz]
_NEEDED = {
    "SYS_STATUS": 1.0, "SYSTEM_TIME": 1.0, "ATTITUDE": 10.0, "ATTITUDE_QUATERNION": 10.0, "LOCAL_POSITION_NED": 10.0,
    "GLOBAL_POSITION_INT": 5.0, "VFR_HUD": 5.0, "NAV_CONTROLLER_OUTPUT": 2.0, "SERVO_OUTPUT_RAW": 5.0,
    "SCALED_PRESSURE": 5.0, "SCALED_PRESSURE2": 5.0, "BATTERY_STATUS": 1.0, "HOME_POSITION": 1.0, "GPS_RAW_INT": 1.0,
    "EXTENDED_SYS_STATE": 1.0, "GPS_GLOBAL_ORIGIN": 0.2, "CURRENT_MODE": 0.5, "AVAILABLE_MODES_MONITOR": 0.2,
}  # fmt: skip
_TOLERANCE = 0.75  # part of the rate that is enough
_ASKED, _FASTEST = 25.0, 210.0  # Hz
_WINDOW = 2.0  # s
_QGC_SILENCE = 0.1  # Hz, below which QGroundControl asks again
_PRINTABLE = range(32, 127)
_GREATEST_SEVERITY = 7


def stream_rates(subject: Subject) -> Outcome:
    """Check that every message that ground stations need comes at its rate."""
    rates = subject.rates()
    enough = {kind: max(_TOLERANCE * rate - 1.0 / (subject.seconds * subject.speed), 0.01) for kind, rate in
              _NEEDED.items()}  # fmt: skip
    lacking = [kind for kind in _NEEDED if rates.get(kind, 0.0) < enough[kind]]
    received = f"{len(rates)} kinds, {sum(rates.values()):.0f} messages a second, clock at {subject.speed:.2f}"
    too_few = ", ".join(f"{kind} {rates.get(kind, 0.0):.1f} of {_NEEDED[kind]:g} Hz" for kind in lacking)
    return failed(f"{received}; {too_few}", "each at its rate") if lacking else passed(received)


def boot_clock(subject: Subject) -> Outcome:
    """Check that the vehicle's clock never goes back."""
    stamps = [h.message.time_boot_ms for h in subject.unasked if h.name == "ATTITUDE"]
    if len(stamps) < 2:
        return failed(f"{len(stamps)} ATTITUDE", "a clock in them")
    return judged(all(b > a for a, b in pairwise(stamps)), f"{stamps[0]} to {stamps[-1]} ms", "growing boot times")


def sensors_healthy(subject: Subject) -> Outcome:
    """Check that SYS_STATUS has the sensors that MAVSDK and QGroundControl need present and healthy."""
    m, status = subject.mavlink, subject.client.last("SYS_STATUS")
    if status is None:
        return failed("no SYS_STATUS", "one a second")
    sensors = (
        m.MAV_SYS_STATUS_SENSOR_3D_GYRO | m.MAV_SYS_STATUS_SENSOR_3D_ACCEL | m.MAV_SYS_STATUS_SENSOR_3D_MAG
        | m.MAV_SYS_STATUS_SENSOR_GPS
    )  # fmt: skip
    ready = m.MAV_SYS_STATUS_PREARM_CHECK
    good = (
        status.onboard_control_sensors_present & sensors == sensors
        and status.onboard_control_sensors_health & (sensors | ready) == sensors | ready
        and status.onboard_control_sensors_enabled & ready == ready
    )
    received = (
        f"present {status.onboard_control_sensors_present:#x}, enabled {status.onboard_control_sensors_enabled:#x}, "
        f"healthy {status.onboard_control_sensors_health:#x}"
    )
    return judged(good, received, f"present {sensors:#x}, enabled {ready:#x}, healthy {sensors | ready:#x} at least")


def no_fence_breach(subject: Subject) -> Outcome:
    """Check that the geofence bit is healthy, or MAVProxy reports "fence breach"."""
    m, status = subject.mavlink, subject.client.last("SYS_STATUS")
    if status is None:
        return failed("no SYS_STATUS", "one a second")
    bit = m.MAV_SYS_STATUS_GEOFENCE
    received = f"healthy {status.onboard_control_sensors_health:#x}"
    return judged(bool(status.onboard_control_sensors_health & bit), received, f"bit {bit:#x} among them")


def home_position(subject: Subject) -> Outcome:
    """Check that HOME_POSITION is streamed and comes on request; without it MAVSDK's health is never all ok."""
    m, rate = subject.mavlink, subject.rates().get("HOME_POSITION", 0.0)
    home = subject.client.request(m.MAVLINK_MSG_ID_HOME_POSITION)
    ack = subject.client.command(m.MAV_CMD_GET_HOME_POSITION)
    received = f"{rate:.1f} Hz, {'' if home else 'not '}on request, ack of command 410 {ack and ack.result}"
    good = rate >= _QGC_SILENCE and home is not None and ack is not None
    return judged(good, received, "at least 0.1 Hz, on request, and an ack")


def statustext(subject: Subject) -> Outcome:
    """Check that texts are printable and have a severity, and that Mission Planner's banner request is answered."""
    m, client = subject.mavlink, subject.client
    ack = client.command(m.MAV_CMD_DO_SEND_BANNER)
    client.collect(0.5)
    texts = [heard.message for heard in client.recent("STATUSTEXT")]
    bad = [t.text for t in texts if not all(ord(c) in _PRINTABLE for c in t.text) or t.severity > _GREATEST_SEVERITY]
    if ack is None or not texts or bad:
        return failed(f"ack {ack and ack.result}, {len(texts)} texts, {bad[:1]}", "an ack, and printable texts")
    return passed(f"{len(texts)} texts, such as {texts[-1].text!r}")


def message_interval(subject: Subject) -> Outcome:
    """Check that SET_MESSAGE_INTERVAL changes the rate and can be undone, and GET_MESSAGE_INTERVAL reports it."""
    m, client = subject.mavlink, subject.client
    number, asked = m.MAVLINK_MSG_ID_ATTITUDE, 1e6 / _ASKED
    ack = client.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, [number, asked, 0, 0, 0, 0, 0])
    rate = _attitude_rate(subject)
    client.discard_unread()
    client.send_command(m.MAV_CMD_GET_MESSAGE_INTERVAL, [number])
    interval = client.wait(lambda x: x.get_type() == "MESSAGE_INTERVAL" and x.message_id == number, 1.0)
    client.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, [number, 0, 0, 0, 0, 0, 0])
    again = _attitude_rate(subject)
    received = (
        f"ack {ack and ack.result}, {rate:.1f} Hz, reported {interval and interval.interval_us} us, then {again:.1f} Hz"
    )
    good = (
        ack is not None and ack.result == m.MAV_RESULT_ACCEPTED and interval is not None
        and abs(interval.interval_us - asked) <= 0.2 * asked and _TOLERANCE * _ASKED <= rate <= 1.3 * _ASKED
        and again < _TOLERANCE * _ASKED
    )  # fmt: skip
    return judged(good, received, f"ack 0, about {_ASKED:g} Hz, reported {asked:g} us, then less")


def greedy_interval(subject: Subject) -> Outcome:
    """Check that an interval of a microsecond is refused, or limited."""
    m, client = subject.mavlink, subject.client
    number = m.MAVLINK_MSG_ID_ATTITUDE
    ack = client.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, [number, 1, 0, 0, 0, 0, 0])
    rate = _attitude_rate(subject)
    client.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, [number, 0, 0, 0, 0, 0, 0])
    received = f"ack {ack and ack.result}, {rate:.0f} Hz"
    return judged(ack is not None and rate <= _FASTEST, received, f"an ack, and at most {_FASTEST:g} Hz")


def unknown_interval(subject: Subject) -> Outcome:
    """Check that an interval for an unknown message is acknowledged, as Cockpit requests many."""
    m, client = subject.mavlink, subject.client
    number = m.MAVLINK_MSG_ID_HIGH_LATENCY
    ack = client.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, [number, 1e6, 0, 0, 0, 0, 0])
    return judged(ack is not None, f"ack {ack and ack.result}", "an ack, whatever it says")


def data_stream(subject: Subject) -> Outcome:
    """Check that REQUEST_DATA_STREAM changes the rate of its group."""
    m, client = subject.mavlink, subject.client
    group, usual = m.MAV_DATA_STREAM_EXTRA1, subject.rates().get("ATTITUDE", 0.0)
    if not usual:
        return skipped("no ATTITUDE comes")
    client.send(m.MAVLink_request_data_stream_message(*client.target, group, int(_ASKED), 1))
    rate = _attitude_rate(subject)
    client.send(m.MAVLink_request_data_stream_message(*client.target, group, round(usual), 1))
    client.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, [m.MAVLINK_MSG_ID_ATTITUDE, 0, 0, 0, 0, 0, 0])
    good = _TOLERANCE * _ASKED <= rate <= 1.3 * _ASKED
    return judged(good, f"{usual:.1f} Hz, then {rate:.1f} Hz", f"about {_ASKED:g} Hz once asked for")


def _attitude_rate(subject: Subject) -> float:
    """Return the present rate of ATTITUDE by the vehicle's clock [Hz]."""
    subject.client.collect(0.2)  # messages under way
    heard = tuple(subject.client.collect(_WINDOW))
    return sum(h.name == "ATTITUDE" for h in heard) / (_WINDOW * speed_of(heard))


CHECKS = (
    Check("stream-rates", ("QGC", "MAVSDK", "Cockpit"), stream_rates),
    Check("boot-clock", ("QGC", "MAVSDK"), boot_clock),
    Check("sensors-healthy", ("QGC", "MAVSDK"), sensors_healthy),
    Check("no-fence-breach", ("MAVProxy",), no_fence_breach),
    Check("home-position", ("QGC", "MAVSDK", "Cockpit"), home_position),
    Check("statustext", ("QGC", "Mission Planner"), statustext),
    Check("message-interval", ("Cockpit", "MAVSDK"), message_interval),
    Check("greedy-interval", ("all",), greedy_interval),
    Check("unknown-interval", ("Cockpit",), unknown_interval),
    Check("data-stream", ("QGC", "MAVProxy"), data_stream),
)
