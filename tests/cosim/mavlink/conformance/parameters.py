"""Checks of parameters: the list, single ones, their file, and refusals."""

from __future__ import annotations

import math
import struct
import time
from typing import Any

from tests.cosim.mavlink.conformance.connect import fetch_parameters
from tests.cosim.mavlink.conformance.ftp import download
from tests.cosim.mavlink.conformance.outcome import Check, Outcome, Subject, failed, judged, passed, skipped

_FILE = "@PARAM/param.pck"
_MAGICS = (0x671B, 0x671C)  # without and with default values
_HEAD = struct.Struct("<HHH")  # magic, parameters in the file, parameters of the vehicle
_CLEAN_REFUSALS = ("FileNotFound", "Fail", "UnknownCommand")
_UNKNOWN = "NO_SUCH_PARAM"
_QUICK, _TIMEOUT = 0.5, 2.0  # s
_ROUNDING = 1e-6  # relative rounding of a float32


def parameter_list(subject: Subject) -> Outcome:
    """Check that the list is complete, with a unique name and index for each parameter."""
    started = time.monotonic()
    values, count, retries = fetch_parameters(subject.client)
    received = f"{len(values)} of {count} in {time.monotonic() - started:.2f} s, {retries} retries"
    names = {value.param_id for value in values.values()}
    counts = {value.param_count for value in values.values()}
    good = count is not None and sorted(values) == list(range(count)) and len(names) == count and counts == {count}
    return judged(good and retries == 0, received, "all, at the first asking, with different names and one count")


def parameter_read(subject: Subject) -> Outcome:
    """Check that reading a parameter by name and by index gives the same value."""
    first = _read(subject, index=0)
    if first is None:
        return failed("index 0: nothing", "PARAM_VALUE")
    by_name = _read(subject, first.param_id)
    if by_name is None:
        return failed(f"{first.param_id}: nothing", "PARAM_VALUE")
    received = f"{first.param_id} {first.param_value:g}, by name {by_name.param_value:g} (index {by_name.param_index})"
    good = by_name.param_id == first.param_id and by_name.param_type == first.param_type
    return judged(good and _same(first.param_value, by_name.param_value), received, "the same twice")


def parameter_unknown(subject: Subject) -> Outcome:
    """Check that an unknown parameter is refused at once, or MAVSDK waits for 3 s."""
    m, client = subject.mavlink, subject.client
    client.discard_unread()
    client.send(m.MAVLink_param_request_read_message(*client.target, _UNKNOWN.encode(), -1))
    reply = client.wait(lambda x: x.get_type() in ("PARAM_ERROR", "PARAM_VALUE"), _QUICK)
    if reply is None:
        return failed(f"nothing in {_QUICK:g} s", "PARAM_ERROR (345)")
    return judged(reply.get_type() == "PARAM_ERROR", f"{reply.get_type()}", "PARAM_ERROR (345)")


def parameter_set(subject: Subject) -> Outcome:
    """Check that PARAM_SET is answered with the effective value; it sets the present value."""
    value = _read(subject, index=0)
    if value is None:
        return failed("index 0: nothing", "PARAM_VALUE")
    echo, error = _set(subject, value, value.param_value)
    if echo is None:
        return failed("error alone" if error else "nothing", "PARAM_VALUE with the value that counts")
    received = f"{value.param_id} {value.param_value:g}, echo {echo.param_value:g}{', refused: read-only' * error}"
    return judged(_same(echo.param_value, value.param_value), received, "the same value")


def parameter_change(subject: Subject) -> Outcome:
    """Check that one parameter can be changed and changed back, and that reading it shows both."""
    listed, _, _ = fetch_parameters(subject.client)
    refusals = 0
    for value in listed.values():
        if value.param_type != subject.mavlink.MAV_PARAM_TYPE_REAL32 or not math.isfinite(value.param_value):
            continue
        other = value.param_value * 1.001 + (0.001 if value.param_value == 0.0 else 0.0)
        echo, refused = _set(subject, value, other)
        refusals += refused
        if echo is None or refused:
            continue
        read = _read(subject, value.param_id)
        _set(subject, value, value.param_value)
        again = _read(subject, value.param_id)
        received = f"{value.param_id} {value.param_value:g} to {other:g}: echo {echo.param_value:g}, read "
        received += f"{read and read.param_value:g}, then {again and again.param_value:g}"
        good = read is not None and again is not None and _same(read.param_value, other)
        return judged(good and _same(again.param_value, value.param_value), received, "what was set, each time")
    if refusals:
        return skipped("the vehicle refuses to change any")
    return failed(f"none of {len(listed)} can be changed", "one that can")


def parameter_nan(subject: Subject) -> Outcome:
    """Check that NaN is refused, and the old value stays."""
    value = _read(subject, index=0)
    if value is None:
        return failed("index 0: nothing", "PARAM_VALUE")
    echo, error = _set(subject, value, math.nan)
    after = _read(subject, value.param_id)
    if after is None:
        return failed("nothing afterwards", "the old value")
    received = f"{'an error, ' * error}echo {echo and echo.param_value}, read {after.param_value:g}"
    if not _same(after.param_value, value.param_value):
        _set(subject, value, value.param_value)
    answered = error or echo is not None
    return judged(
        answered and _same(after.param_value, value.param_value), received, f"an answer, {value.param_value:g}"
    )


def parameter_file(subject: Subject) -> Outcome:
    """Check that MAV-FTP serves the parameter file with as many as the list has, or refuses it at once."""
    started = time.monotonic()
    file = download(subject.client, _FILE)
    took = time.monotonic() - started
    if file.data is None:
        clean = file.said in _CLEAN_REFUSALS and took < _QUICK
        return judged(clean, f"{file.said} after {took:.2f} s", f"a file, or a refusal within {_QUICK:g} s")
    if len(file.data) < _HEAD.size:
        return failed(f"{len(file.data)} bytes", "a header")
    magic, stored, total = _HEAD.unpack_from(file.data)
    value = _read(subject, index=0)
    count = value and value.param_count
    received = f"{len(file.data)} bytes, {stored} of {total} parameters, list {count}, {file.retries} retries"
    good = magic in _MAGICS and stored == total == count and file.retries == 0
    return judged(good, received, f"magic {_MAGICS[0]:#x} (came {magic:#x}), all parameters of the list")


def missing_file(subject: Subject) -> Outcome:
    """Check that a missing file is refused at once."""
    started = time.monotonic()
    file = download(subject.client, "no/such/file")
    took = time.monotonic() - started
    good = file.data is None and file.said in _CLEAN_REFUSALS and took < _QUICK
    return judged(good, f"{file.said} after {took:.2f} s", f"a refusal within {_QUICK:g} s")


def cached_hash(subject: Subject) -> Outcome:
    """Check that _HASH_CHECK, which QGroundControl requests of PX4, is answered by a value or an error."""
    m, client = subject.mavlink, subject.client
    if client.vehicle is None or client.vehicle.autopilot != m.MAV_AUTOPILOT_PX4:
        return skipped("not PX4")
    client.discard_unread()
    client.send(m.MAVLink_param_request_read_message(*client.target, b"_HASH_CHECK", -1))
    reply = client.wait(lambda x: x.get_type() in ("PARAM_ERROR", "PARAM_VALUE"), _QUICK)
    return passed(reply.get_type()) if reply is not None else failed("nothing", "PARAM_VALUE or PARAM_ERROR")


def _same(a: float, b: float) -> bool:
    return (math.isnan(a) and math.isnan(b)) or math.isclose(a, b, rel_tol=_ROUNDING, abs_tol=1e-30)


def _read(subject: Subject, name: str = "", index: int = -1) -> Any:
    """Read one parameter; return its PARAM_VALUE, or None."""
    m, client = subject.mavlink, subject.client
    client.discard_unread()
    client.send(m.MAVLink_param_request_read_message(*client.target, name.encode(), index))
    return client.wait(
        lambda x: x.get_type() == "PARAM_VALUE" and (x.param_id == name if name else x.param_index == index), _TIMEOUT
    )


def _set(subject: Subject, parameter: Any, value: float) -> tuple[Any, bool]:
    """Set a parameter; return its PARAM_VALUE, or None, and True if an error came too."""
    m, client = subject.mavlink, subject.client
    errors = []

    def is_echo(message: Any) -> bool:
        if message.get_type() == "PARAM_ERROR":
            errors.append(message)
        return message.get_type() == "PARAM_VALUE" and bool(message.param_id == parameter.param_id)

    client.discard_unread()
    name = parameter.param_id.encode()
    client.send(m.MAVLink_param_set_message(*client.target, name, value, parameter.param_type))
    echo = client.wait(is_echo, _TIMEOUT)
    client.wait(is_echo, 0.1)  # an error may follow the value
    return echo, bool(errors)


CHECKS = (
    Check("parameter-list", ("QGC", "MAVSDK", "MAVProxy", "Mission Planner"), parameter_list),
    Check("parameter-read", ("QGC", "MAVSDK", "Mission Planner"), parameter_read),
    Check("parameter-unknown", ("MAVSDK",), parameter_unknown),
    Check("parameter-set", ("QGC", "MAVSDK", "MAVProxy"), parameter_set),
    Check("parameter-change", ("QGC", "MAVSDK", "MAVProxy"), parameter_change),
    Check("parameter-nan", ("MAVSDK",), parameter_nan),
    Check("parameter-file", ("QGC", "MAVProxy", "Mission Planner"), parameter_file),
    Check("missing-file", ("QGC", "MAVProxy"), missing_file),
    Check("cached-hash", ("QGC",), cached_hash),
)
