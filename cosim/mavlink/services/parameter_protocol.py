"""Parameters: the live settings of the scenario, by short names, and a few that stations expect."""

from __future__ import annotations

import contextlib
import math
import re
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cosim.errors import CommandError
from cosim.mavlink.services.packed_parameters import hash_parameters
from cosim.mavlink.services.parameter_names import parameter_names
from cosim.mavlink.services.service import Service
from cosim.mavlink.services.station_parameters import station_parameters
from cosim.mavlink.vehicle.vehicle_context import Result, Sender, VehicleContext
from cosim.mavlink.wire.encode import clip_to_float32
from cosim.mavlink.wire.link import Link
from cosim.mavlink.wire.options import LossAction
from cosim.simulation.commands.commands import ChangeSetting

_HASH = "_HASH_CHECK"
_NO_INDEX = 0xFFFF
_VALUES_PER_TICK = 50
_ACTIONS: tuple[LossAction, ...] = ("none", "warn", "disarm", "hold", "surface")  # order of ArduSub's FS_GCS_ENABLE
_TIMEOUTS = (1.0, 120.0)  # s, range of FS_GCS_TIMEOUT


@dataclass(frozen=True)
class _LinkParameter:
    """A parameter that is not a setting of the scenario."""

    read: Callable[[], float]
    write: Callable[[float], str | None] | None = None  # returns the expected range for an invalid value


class ParameterProtocol(Service):
    """PARAM_REQUEST_LIST, PARAM_REQUEST_READ and PARAM_SET; all parameters are REAL32."""

    # The list is sent in slices, one per tick, and at most once at a time on a link: a request while it is under way
    # restarts the count from the present parameter. It pauses while a link has no room, so that a slow line loses none,
    # and repeated requests do not displace other messages.

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        keys = [setting.key for setting in context.settings]
        self._keys = {name: key for key, name in parameter_names(keys).items()}
        former = parameter_names(re.sub(r"\.center\.(\d)$", r".centre.\1", key) for key in keys)
        self._current_names = dict(zip(former.values(), self._keys, strict=True))  # by those of keys with `centre`
        self._link_parameters = self._make_link_parameters()
        self.names = sorted({*self._keys, *self._link_parameters})
        self._index = {name: i for i, name in enumerate(self.names)}
        self._bursts: dict[Link, tuple[int, int]] = {}  # next index, and number left, by link
        self.restart()

    def _make_link_parameters(self) -> dict[str, _LinkParameter]:
        context = self.context
        own = {name: _LinkParameter(read) for name, read in station_parameters(context).items()}
        return own | {
            context.profile.system_id_parameter: _LinkParameter(lambda: float(context.options.system_id)),
            "FS_GCS_TIMEOUT": _LinkParameter(lambda: context.loss_timeout, self._write_timeout),
            "FS_GCS_ENABLE": _LinkParameter(lambda: float(_ACTIONS.index(context.loss_action)), self._write_action),
        }

    def _write_timeout(self, value: float) -> str | None:
        low, high = _TIMEOUTS
        if not low <= value <= high:
            return f"{low:g} to {high:g}"
        self.context.loss_timeout = value
        return None

    def _write_action(self, value: float) -> str | None:
        if value not in range(len(_ACTIONS)):
            return ", ".join(f"{i} {action}" for i, action in enumerate(_ACTIONS))
        self.context.loss_action = _ACTIONS[int(value)]
        return None

    def restart(self) -> None:
        """Reset the values to the vehicle's settings."""
        self.setting_values = {setting.key: setting.value for setting in self.context.settings}

    def _current_name(self, name: str) -> str:
        """Translate the former spelling of a parameter's name."""
        return name if name in self._index else self._current_names.get(name, name)

    # ---- for other services ----

    def value(self, name: str) -> float:
        """Return a parameter's value, limited to the range of float32."""
        parameter = self._link_parameters.get(name)
        return clip_to_float32(self.setting_values[self._keys[name]] if parameter is None else parameter.read())

    def list_values(self) -> list[tuple[str, float]]:
        """Return names and values of all parameters, in the order of the list."""
        return [(name, self.value(name)) for name in self.names]

    def change(self, key: str, value: float) -> Result:
        """Submit a new value of a setting; an invalid value is denied with the reason."""
        context, before = self.context, self.setting_values[key]
        if not context.accepts_commands:
            return context.submit()
        try:
            context.settings.change(key, value)
        except CommandError as error:
            context.reject(str(error), "value")
            return Result.DENIED
        result = context.submit(ChangeSetting(key, value))
        if result != Result.ACCEPTED:
            context.settings.change(key, before)
            return result
        self.setting_values[key] = value
        return result

    def record(self, key: str, value: float) -> None:
        """Record the value of a setting that a mission has changed."""
        with contextlib.suppress(CommandError):  # as the command handler does, which logs it
            self.context.settings.change(key, value)
            self.setting_values[key] = value

    # ---- the list ----

    def _receive_param_request_list(self, sender: Sender, message: Any) -> None:
        index, left = self._bursts.get(sender.link, (0, 0))
        if not left and self.context.profile.has_parameter_hash:
            self._send_hash(sender.link)
        self._bursts[sender.link] = index, len(self.names)
        if not left:
            self._send_slice(sender.link)

    def tick(self) -> None:
        """Send the next slice of each list that is under way."""
        for link in list(self._bursts):
            self._send_slice(link)

    def _send_slice(self, link: Link) -> None:
        index, left = self._bursts[link]
        for _ in range(min(left, _VALUES_PER_TICK)):
            if not link.has_room():
                break
            self._send_value(link, self.names[index])
            index, left = (index + 1) % len(self.names), left - 1
        if left:
            self._bursts[link] = index, left
        else:
            del self._bursts[link]

    def _send_value(self, link: Link, name: str, requested: str = "") -> None:
        """Send a parameter's value, by the name that was requested, which may be a former one."""
        m = self.context.mavlink
        kind = m.MAV_PARAM_TYPE_REAL32, len(self.names), self._index[name]
        link.send(self.context.make("PARAM_VALUE", requested or name, self.value(name), *kind))

    def _send_hash(self, link: Link) -> None:
        m = self.context.mavlink
        (bits,) = struct.unpack("<f", struct.pack("<I", hash_parameters(dict(self.list_values()))))
        kind = m.MAV_PARAM_TYPE_UINT32, len(self.names), _NO_INDEX
        link.send(m.MAVLink_param_value_message(_HASH.encode(), bits, *kind))

    # ---- single parameters ----

    def _receive_param_request_read(self, sender: Sender, message: Any) -> None:
        m, index, requested = self.context.mavlink, message.param_index, message.param_id
        if requested == _HASH and index < 0 and self.context.profile.has_parameter_hash:
            self._send_hash(sender.link)
        elif 0 <= index < len(self.names):
            self._send_value(sender.link, self.names[index])
        elif index < 0 and (name := self._current_name(requested)) in self._index:
            self._send_value(sender.link, name, requested)
        else:
            self._send_error(sender, requested, index, m.MAV_PARAM_ERROR_DOES_NOT_EXIST)

    def _send_error(self, sender: Sender, name: str, index: int, error: int) -> None:
        sender.link.send(self.context.make("PARAM_ERROR", *sender.address, name, index, error))

    def _receive_param_set(self, sender: Sender, message: Any) -> None:
        m, requested, value = self.context.mavlink, message.param_id, message.param_value
        name = self._current_name(requested)
        if name == _HASH:  # the station has the list already
            self._bursts.pop(sender.link, None)
            return
        if name not in self._index:
            self._send_error(sender, requested, -1, m.MAV_PARAM_ERROR_DOES_NOT_EXIST)
            return
        error = self._write(name, value, message.param_type)
        if error != m.MAV_PARAM_ERROR_NO_ERROR:
            self._send_error(sender, requested, self._index[name], error)
        self._send_value(sender.link, name, requested)

    def _write(self, name: str, value: float, kind: int) -> int:
        """Write a value, and return MAV_PARAM_ERROR."""
        m, context = self.context.mavlink, self.context
        parameter = self._link_parameters.get(name)
        if parameter is not None and parameter.write is None:
            return int(m.MAV_PARAM_ERROR_READ_ONLY)
        if self.rejects_commands():
            return int(m.MAV_PARAM_ERROR_PERMISSION_DENIED)
        if kind != m.MAV_PARAM_TYPE_REAL32 and not context.profile.casts_parameters:
            context.reject(f"{name} has type {kind}, expected REAL32 ({m.MAV_PARAM_TYPE_REAL32})", "value")
            return int(m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE)
        if not math.isfinite(value):
            context.reject(f"{name} is {value}, expected a finite number", "value")
            return int(m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE)
        if _as_float32(self.value(name)) == value:
            return int(m.MAV_PARAM_ERROR_NO_ERROR)
        value = shorten_float32(value)
        if parameter is not None and parameter.write is not None:
            expected = parameter.write(value)
            if expected is not None:
                context.reject(f"{name} is {value:g}, expected {expected}", "value")
                return int(m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE)
            return int(m.MAV_PARAM_ERROR_NO_ERROR)
        errors = {Result.ACCEPTED: m.MAV_PARAM_ERROR_NO_ERROR, Result.DENIED: m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE}
        return int(errors.get(self.change(self._keys[name], value), m.MAV_PARAM_ERROR_PERMISSION_DENIED))


def _as_float32(value: float) -> float:
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


def shorten_float32(value: float) -> float:
    """Return the number with the fewest digits that is the same float32: 0.3 for what arrives as 0.30000001192."""
    same = _as_float32(value)
    for digits in range(6, 10):
        candidate = float(f"{value:.{digits}g}")
        if _as_float32(clip_to_float32(candidate)) == same:
            return candidate
    return value
