"""Missions: upload, download, and the current item."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from cosim.mavlink.services.mission_items import ItemError, decode_mission_item, home_item
from cosim.mavlink.services.parameter_protocol import ParameterProtocol
from cosim.mavlink.services.service import CommandRequest, Service, to_local_position, unscale_position
from cosim.mavlink.services.targets import Targets
from cosim.mavlink.vehicle.vehicle_context import ReceivedMissionItem, Result, Sender, VehicleContext
from cosim.mavlink.wire.encode import round_finite
from cosim.simulation.commands.commands import ChangeSetting, Command, MissionItem, SetCurrentItem, SetMission, SetMode
from cosim.simulation.commands.mission_executor import passed_items

_MAX_ITEMS = 500
_RETRY_PERIOD = 1.0  # s of the wall clock
_MAX_RETRIES = 5
_MISSION, _ALL = 0, 255  # MAV_MISSION_TYPE
_GO_TO, _CHANGE_DEPTH = 2, 3  # MISSION_ITEM.current of guided items, which are not part of a mission
_SUPPORTED_TYPES = (0, 1, 2)


@dataclass
class _Upload:
    """A mission upload under way."""

    sender: Sender
    count: int
    request_time: float  # s, the last request for an item
    items: list[ReceivedMissionItem] = field(default_factory=list)
    decoded: list[MissionItem] = field(default_factory=list)  # without home
    retries: int = 0


class MissionProtocol(Service):
    """MISSION_*: one mission of regions; fences and rally points are always empty."""

    # In ArduPilot's profile item 0 is home: it is added to downloads, and ignored in uploads.

    def __init__(self, context: VehicleContext, targets: Targets, parameters: ParameterProtocol) -> None:
        super().__init__(context)
        self._targets, self._parameters = targets, parameters
        self._current_item = -1  # item of the last snapshot
        self._upload: _Upload | None = None
        self._first_seq = int(context.profile.has_home_item)  # sequence number of the first item after home

    def restart(self) -> None:
        """Cancel an upload under way."""
        self._upload, self._current_item = None, -1

    def on_snapshot(self) -> None:
        """Update the parameters with settings changed by items passed since the last snapshot."""
        context, before = self.context, self._current_item
        now = self._current_item = context.view.item if context.mode == "mission" else -1
        if now == before or not 0 <= now < len(context.mission_items):
            return
        for item in passed_items(context.mission_items, before, now) or [now]:
            for command in context.mission_items[item].commands:
                if isinstance(command, ChangeSetting):
                    self._parameters.record(command.key, command.value)

    # ---- download ----

    def _all_items(self) -> tuple[ReceivedMissionItem, ...]:
        plan = self.context.plan
        return (home_item(self.context), *plan) if plan and self._first_seq else plan

    def _receive_mission_request_list(self, sender: Sender, message: Any) -> None:
        mission_type = message.mission_type
        if mission_type not in _SUPPORTED_TYPES:
            self._ack(sender, self.context.mavlink.MAV_MISSION_UNSUPPORTED, mission_type)
            return
        count = len(self._all_items()) if mission_type == _MISSION else 0
        sender.link.send(self.context.make("MISSION_COUNT", *sender.address, count, mission_type))

    def _receive_mission_request(self, sender: Sender, message: Any) -> None:
        context, m = self.context, self.context.mavlink
        seq, mission_type = message.seq, message.mission_type
        items = self._all_items() if mission_type == _MISSION else ()
        if seq >= len(items):
            self._ack(sender, m.MAV_MISSION_INVALID_SEQUENCE, mission_type)
            return
        item = items[seq]
        current = int(context.mode == "mission" and context.view.item + self._first_seq == seq)
        head = *sender.address, seq, item.frame, item.command, current, item.autocontinue
        numbers = item.param1, item.param2, item.param3, item.param4
        if message.get_type() == "MISSION_REQUEST_INT":
            reply = context.make("MISSION_ITEM_INT", *head, *numbers, item.x, item.y, item.z, mission_type)
        else:
            scale = _scale(item.frame, m)
            reply = context.make("MISSION_ITEM", *head, *numbers, item.x / scale, item.y / scale, item.z, mission_type)
        sender.link.send(reply)

    _receive_mission_request_int = _receive_mission_request

    def _ack(self, sender: Sender, result: int, mission_type: int) -> None:
        sender.link.send(self.context.make("MISSION_ACK", *sender.address, result, mission_type))

    # ---- upload ----

    def _receive_mission_count(self, sender: Sender, message: Any) -> None:
        context, m, mission_type = self.context, self.context.mavlink, message.mission_type
        upload = self._upload
        if self.rejects_commands():
            self._ack(sender, m.MAV_MISSION_DENIED, mission_type)
        elif mission_type != _MISSION:
            self._ack(sender, m.MAV_MISSION_UNSUPPORTED if message.count else m.MAV_MISSION_ACCEPTED, mission_type)
        elif upload is not None and upload.sender != sender:
            self._ack(sender, m.MAV_MISSION_DENIED, mission_type)
        elif message.count > _MAX_ITEMS:
            self._ack(sender, m.MAV_MISSION_NO_SPACE, mission_type)
        else:
            self._upload = _Upload(sender, message.count, context.now)
            self._request_next(self._upload)

    def _request_next(self, upload: _Upload) -> None:
        """Request the next item, or finish the upload."""
        context, sender = self.context, upload.sender
        upload.request_time = context.now
        if len(upload.items) < upload.count:
            sender.link.send(context.make("MISSION_REQUEST_INT", *sender.address, len(upload.items), _MISSION))
            return
        self._upload = None
        self._ack(sender, self._submit_mission(sender, upload.items[self._first_seq :], upload.decoded), _MISSION)

    def _receive_mission_item(self, sender: Sender, message: Any) -> None:
        m, upload, mission_type = self.context.mavlink, self._upload, message.mission_type
        if message.current in (_GO_TO, _CHANGE_DEPTH) and mission_type == _MISSION:
            self._ack(sender, self._apply_guided_item(sender, message), mission_type)
            return
        if upload is None or upload.sender != sender or mission_type != _MISSION:
            result = m.MAV_MISSION_ERROR if self.context.accepts_commands else m.MAV_MISSION_DENIED
            self._ack(sender, result, mission_type)
            return
        if message.seq != len(upload.items):  # a repeated item, or one out of order
            return
        result = self._add(upload, message)
        if result != m.MAV_MISSION_ACCEPTED:  # at once: stations relate the ack to the last item sent
            self._upload = None
            self._ack(sender, result, mission_type)
            return
        upload.retries = 0
        self._request_next(upload)

    _receive_mission_item_int = _receive_mission_item

    def _add(self, upload: _Upload, message: Any) -> int:
        """Add an item to an upload, and return MAV_MISSION_RESULT."""
        context, m, first = self.context, self.context.mavlink, self._first_seq
        item = _received_item(message, m)
        if item is None:
            return int(m.MAV_MISSION_INVALID)
        if message.seq >= first:
            try:
                upload.decoded.append(decode_mission_item(context, item, upload.decoded, upload.count - first))
            except ItemError as error:
                context.reject(f"mission item {message.seq}: {error}", "item")
                return int(getattr(m, f"MAV_MISSION_{error.result}"))
        upload.items.append(item)
        return int(m.MAV_MISSION_ACCEPTED)

    def _apply_guided_item(self, sender: Sender, message: Any) -> int:
        """Execute a guided item at once, as of QGroundControl's go-to for ArduPilot; return MAV_MISSION_RESULT."""
        context, m = self.context, self.context.mavlink
        if message.command != m.MAV_CMD_NAV_WAYPOINT:
            return int(m.MAV_MISSION_UNSUPPORTED)
        item = _received_item(message, m)
        x, y = (0.0, 0.0) if item is None else unscale_position(item.frame, item.x, item.y)
        position = None if item is None else to_local_position(context, item.frame, x, y, item.z)
        if position is None:
            return int(m.MAV_MISSION_INVALID if item is None else m.MAV_MISSION_UNSUPPORTED_FRAME)
        if message.current == _CHANGE_DEPTH:
            position = *context.view.target[:2], position[2]
        accepted = self._targets.go(sender, position) == Result.ACCEPTED
        return int(m.MAV_MISSION_ACCEPTED if accepted else m.MAV_MISSION_DENIED)

    def _submit_mission(self, sender: Sender, items: list[ReceivedMissionItem], decoded: list[MissionItem]) -> int:
        """Submit a mission, and return MAV_MISSION_RESULT."""
        context, m = self.context, self.context.mavlink
        result = self.submit(sender, SetMission(tuple(decoded)))
        if result == Result.ACCEPTED:
            context.plan, context.mission_items = tuple(items), tuple(decoded)
            for number, item in enumerate(decoded, self._first_seq):
                if item.position is not None:
                    self._targets.warn_about(item.position, f"mission item {number}")
            return int(m.MAV_MISSION_ACCEPTED)
        return int(m.MAV_MISSION_DENIED if result == Result.DENIED else m.MAV_MISSION_ERROR)

    def _receive_mission_ack(self, sender: Sender, message: Any) -> None:
        """End a download, or an upload that its sender cancels."""
        if self._upload is not None and self._upload.sender == sender:
            self._upload = None

    def tick(self) -> None:
        """Request a missing item again each second; cancel the upload after five retries."""
        upload, context = self._upload, self.context
        if upload is None or context.now - upload.request_time < _RETRY_PERIOD:
            return
        if upload.retries < _MAX_RETRIES:
            upload.retries += 1
            self._request_next(upload)
        else:
            self._upload = None
            self._ack(upload.sender, context.mavlink.MAV_MISSION_OPERATION_CANCELLED, _MISSION)

    def _receive_mission_clear_all(self, sender: Sender, message: Any) -> None:
        m, mission_type = self.context.mavlink, message.mission_type
        if mission_type not in (*_SUPPORTED_TYPES, _ALL):
            self._ack(sender, m.MAV_MISSION_UNSUPPORTED, mission_type)
        elif self.rejects_commands():
            self._ack(sender, m.MAV_MISSION_DENIED, mission_type)
        elif mission_type in (_MISSION, _ALL):
            self._upload = None
            self._ack(sender, self._submit_mission(sender, [], []), mission_type)
        else:
            self._ack(sender, m.MAV_MISSION_ACCEPTED, mission_type)

    # ---- current item ----

    def _set_current_item(self, sender: Sender, seq: int | None, *more: Command) -> Result:
        context = self.context
        if not context.accepts_commands:
            return context.submit()
        item = None if seq is None else max(seq - self._first_seq, 0)
        if item is None or item >= len(context.plan):
            context.reject(f"mission item {seq}: there are {len(self._all_items())}", "item")
            return Result.DENIED if context.plan else Result.FAILED
        return self.submit(sender, SetCurrentItem(item), *more)

    def _receive_mission_set_current(self, sender: Sender, message: Any) -> None:
        self._set_current_item(sender, message.seq)

    def _execute_do_set_mission_current(self, request: CommandRequest) -> Result:
        """Continue with another item; -1 is the present one."""
        seq = request.int_param(1)
        return self._set_current_item(
            request.sender, seq if seq is None or seq >= 0 else self.context.view.item + self._first_seq
        )

    def _execute_mission_start(self, request: CommandRequest) -> Result:
        return self._set_current_item(request.sender, max(request.int_param(1) or 0, 0), SetMode("mission"))


def _scale(frame: int, mavlink: Any) -> float:
    """Return the integer scale of an item's position in a frame: 1e7 per degree, 1e4 per meter, or 1."""
    return {mavlink.MAV_FRAME_LOCAL_NED: 1e4, mavlink.MAV_FRAME_MISSION: 1.0}.get(frame, 1e7)


def _received_item(message: Any, mavlink: Any) -> ReceivedMissionItem | None:
    """Return a received item, or None if its position is not finite or exceeds the integer fields."""
    x, y = message.x, message.y
    if message.get_type() == "MISSION_ITEM":
        x, y = (round_finite(v * _scale(message.frame, mavlink)) for v in (x, y))
        if x is None or y is None or max(abs(x), abs(y)) > 0x7FFFFFFF:
            return None
    numbers = message.param1, message.param2, message.param3, message.param4
    return ReceivedMissionItem(message.frame, message.command, message.autocontinue, *numbers, x, y, message.z)
