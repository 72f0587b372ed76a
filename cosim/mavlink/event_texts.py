"""Status texts for events: changes from one snapshot to the next."""

from __future__ import annotations

from controller.regions.region_set import of_attitude
from cosim.mavlink.messages.message_table import build_messages
from cosim.mavlink.vehicle.profile import MODE_TABLE
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.vehicle.view import View
from cosim.simulation.commands.mission_executor import passed_items

_HYSTERESIS = 0.01  # m or rad past a region's surface, beyond which it counts as entered or left
_UNSATURATED_TIME = 1_000_000  # µs of simulated time without saturation, before its end is reported
_TEXT_PERIOD = 2.0  # s of the wall clock, between two texts of the same kind


class EventTexts:
    """Compare snapshots, and send status texts of the changes."""

    def __init__(self, context: VehicleContext) -> None:
        self._context = context
        self.restart()

    def restart(self) -> None:
        """Reset; the next snapshot is the first."""
        self._before: View | None = None
        self._satisfied: list[bool] = []
        self._saturated = False
        self._saturated_us = 0  # time of the last saturation

    def watch(self) -> None:
        """Compare the vehicle's snapshot with the last one."""
        context, view = self._context, self._context.view
        before = self._before
        self._before = view
        if before is None:
            self._satisfied = [clearance >= 0.0 for clearance in view.clearances]
            return
        self._watch_commands(before, view)
        self._watch_regions(view)
        self._watch_limits(view)
        if view.touches_bottom and not before.touches_bottom:
            context.send_text("Bottom touched", "WARNING", "bottom", _TEXT_PERIOD)

    def _watch_commands(self, before: View, view: View) -> None:
        context = self._context
        if view.armed != before.armed:
            context.send_text("Armed" if view.armed else "Disarmed", "NOTICE")
        if view.mode != before.mode:
            context.send_text(f"Mode: {MODE_TABLE[view.mode].name}", "NOTICE")
        if (view.armed, view.mode) != (before.armed, before.mode):
            for message in build_messages(context, "HEARTBEAT", "CURRENT_MODE"):
                context.send(message)
        if view.mode == before.mode == "mission" and view.item != before.item:
            self._watch_mission(before.item, view.item)

    def _watch_mission(self, before: int, now: int) -> None:
        """Report the mission items that were passed; items without a position are not reported."""
        passed = passed_items(self._context.mission_items, before, now) if before >= 0 else None
        for item in [before, *passed[:-1]] if passed else []:
            self._reached_item(item)

    def _reached_item(self, item: int) -> None:
        context = self._context
        if not 0 <= item < len(context.mission_items) or context.mission_items[item].position is None:
            return
        number = item + int(context.profile.has_home_item)
        context.send(context.make("MISSION_ITEM_REACHED", number))
        context.send_text(f"Reached mission item {number}")

    def _watch_regions(self, view: View) -> None:
        for i, clearance in enumerate(view.clearances):
            satisfied = self._satisfied[i]
            # hysteresis of a margin about the surface; NaN changes nothing
            now_satisfied = not clearance < -_HYSTERESIS if satisfied else clearance > _HYSTERESIS
            if now_satisfied == satisfied:
                continue
            self._satisfied[i] = now_satisfied
            if i == 0:
                self._report_target(view, now_satisfied)
                continue
            region = self._context.scenario.regions[i - 1].region
            what = "Attitude" if of_attitude(region.shape) else "Region"
            inside = now_satisfied == (region.keep == "in")
            text = f"{what} {region.name} {'entered' if inside else 'left'}"
            severity = "INFO" if now_satisfied else "WARNING"
            self._context.send_text(
                text if now_satisfied else f"{text}: keep {region.keep}", severity, text, _TEXT_PERIOD
            )

    def _report_target(self, view: View, inside: bool) -> None:
        context = self._context
        last = view.item == len(context.plan) - 1 and view.mode == "mission"
        context.send_text("Target reached" if inside else "Target left", "INFO", f"target {inside}", _TEXT_PERIOD)
        if inside and last:
            self._reached_item(view.item)

    def _watch_limits(self, view: View) -> None:
        context = self._context
        if view.saturated:
            self._saturated_us = view.boot_us
            if not self._saturated:
                context.send_text("Thrust saturated", "WARNING", "saturated", _TEXT_PERIOD)
            self._saturated = True
        elif self._saturated and view.boot_us - self._saturated_us >= _UNSATURATED_TIME:
            self._saturated = False
            context.send_text("Thrust no longer saturated", "INFO", "released", _TEXT_PERIOD)
