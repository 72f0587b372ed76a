"""State of the run that is shown, and the messages for each viewer at its own pace. No sockets; one thread."""

from __future__ import annotations

import logging
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from controller.regions import Sphere
from controller.regions.region_set import shape_center
from controller.regions.shape import Shape
from cosim.errors import CommandError
from cosim.live.command_desk import CommandDesk
from cosim.live.history import History
from cosim.live.viewer_messages import format_message, write_rows
from cosim.replay.command_words import command_words
from cosim.replay.header import header_of, limits_of, shape_of
from cosim.replay.view_columns import ViewColumns
from cosim.scenario.region_tables import PARKED_POSITION
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import AddObstacle, ChangeSetting, Command, ManualControl, RemoveObstacle
from cosim.simulation.commands.obstacle_slots import ObstacleSlots
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.signals import Array, Column

log = logging.getLogger(__name__)

_MAX_ROWS = 512  # in a message
_MAX_TEXTS = 50  # latest ones, stored for viewers that connect late
_MAX_CHANGES = 1000  # of regions, stored for them


@dataclass
class Cursor:
    """Position of a viewer: counts of rows, texts and changes that were sent to it."""

    run: int = -1
    row: int = 0
    text: int = 0
    change: int = 0


class Hub:
    """State of the run that is shown, and messages about it for viewers."""

    def __init__(self) -> None:
        self.run = -1
        self.desk: CommandDesk | None = None
        self._texts: list[str] = []
        self._dropped = 0  # number of texts that were discarded
        self._last: Array | None = None

    def begin(self, run: int, scenario: Scenario, columns: Sequence[Column], queue: CommandQueue | str) -> None:
        """Begin showing another run."""
        self.run = run
        self._view_columns = ViewColumns(scenario, columns)
        accepted = isinstance(queue, CommandQueue) and (list(queue.modes) or True)
        self._names = {column.name: i for i, column in enumerate(self._view_columns.columns)}
        self._header = header_of(scenario, self._view_columns.columns, accepted)
        self._changes: list[dict[str, Any]] = []
        self._header["changes"] = self._changes
        self._change_numbers: list[int] = []  # of each kept change, from 1
        self._change_count = 0  # number of changes so far
        self._limits = limits_of(scenario)
        self._step = scenario.time.step
        self._goal_center, self._target_radius = shape_center(scenario.goal), 0.0
        self._regions = ["goal", *(secondary.region.name for secondary in scenario.regions)]
        self._slots = ObstacleSlots(scenario.commands.obstacles)
        self._slot_names = [secondary.region.name for secondary in scenario.regions if secondary.is_dynamic]  # by slot
        self._history = History(len(self._view_columns.columns))
        self._texts, self._dropped, self._last = [], 0, None
        self.desk = CommandDesk(scenario, queue, self._is_occupied)

    @property
    def picked(self) -> list[int]:
        """Indices of the columns of the run's rows that are shown."""
        return self._view_columns.picked

    def _is_occupied(self, region: str) -> bool:
        if self._last is None:
            return False
        return any(self._last[self._names[f"{region}.shift.{axis}"]] for axis in "xyz")

    # ---- updates from the run ----

    def show(self, picked: Sequence[Array]) -> None:
        """Add rows of the run, each of the columns `picked`; a row equal to the one before it is skipped."""
        for row in self._view_columns.compute_rows(np.array(picked)):
            if self._last is None or not np.array_equal(row, self._last, equal_nan=True):
                self._history.add(row)
                self._last = row
                if "target.radius" in self._names and row[self._names["target.radius"]] != self._target_radius:
                    self._target_radius = float(row[self._names["target.radius"]])
                    self._change("goal", float(row[0]))

    def show_commands(self, k: int, commands: Sequence[Command]) -> None:
        """Show the commands that step `k` applies, and the regions that they change."""
        time = k * self._step
        for command in commands:
            if not isinstance(command, ManualControl):  # these arrive continually
                self.say(command_words(command), "command", time)
            try:
                self._apply(command, time)
            except CommandError as error:
                log.debug("%s", error)  # the command handler warns of it

    def _apply(self, command: Command, time: float) -> None:
        assert self.desk is not None
        self.desk.update_settings(command)
        match command:
            case ChangeSetting():
                region = self.desk.settings.region_of(command.key)
                if region is not None:
                    self._change(region, time)
            case AddObstacle():
                name = self._slot_names[self._slots.assign(command.number)]
                self._change(name, time, Sphere(PARKED_POSITION, command.radius))
                self._changes[-1]["number"] = command.number  # for commands that move or remove it
            case RemoveObstacle():
                self._slots.release(command.number)

    def _change(self, name: str, time: float, shape: Shape | None = None) -> None:
        """Record a changed shape or gain of a region; default: those of the settings."""
        assert self.desk is not None
        settings, index = self.desk.settings, self._regions.index(name)
        if name == "goal" and self._target_radius > 0.0:
            shape = Sphere(self._goal_center, self._target_radius)
        gain = self._header["regions"][index]["gain"] if shape or not index else settings[f"regions.{name}.gain"]
        drawn = shape_of(shape or settings.shapes[name], self._limits)
        self._changes.append({"time": time, "region": index, "shape": drawn, "gain": gain})
        self._change_count += 1
        self._change_numbers.append(self._change_count)
        if len(self._changes) > max(_MAX_CHANGES, len(self._regions)):  # drop the oldest one that a later one replaces
            last = {change["region"]: i for i, change in enumerate(self._changes)}
            oldest = next(i for i, change in enumerate(self._changes) if last[change["region"]] > i)
            del self._changes[oldest], self._change_numbers[oldest]

    def say(self, text: str, kind: str = "info", time: float | None = None) -> None:
        """Show a `text` to all viewers; `kind` is info, command or warning, `time` simulated [s]."""
        self._add_text(format_message("message", kind=kind, text=text, time=time))

    def end(self, status: str, verdict: str) -> None:
        """Show the `status` and `verdict` of a run that has ended."""
        self._header |= {"status": status, "verdict": verdict}
        self._add_text(format_message("end", status=status, verdict=verdict))

    def _add_text(self, text: str) -> None:
        self._texts.append(text)
        if len(self._texts) > _MAX_TEXTS:
            self._texts.pop(0)
            self._dropped += 1

    # ---- messages for viewers ----

    def is_up_to_date(self, cursor: Cursor) -> bool:
        """Return True if all rows, texts and changes were sent to a viewer."""
        return (cursor.run, cursor.row, cursor.change, cursor.text) == (
            self.run, self._history.count, self._change_count, self._dropped + len(self._texts),
        )  # fmt: skip

    def next_for(self, cursor: Cursor) -> str | bytes | None:
        """Return the next message for a viewer, and advance its cursor; None if there is nothing new."""
        if self.run < 0:
            return None
        if cursor.run != self.run:
            cursor.run, cursor.row, cursor.text = self.run, 0, self._dropped
            cursor.change = self._change_count
            return format_message("header", run=self._header)
        rows, number = self._history.since(cursor.row, _MAX_ROWS)
        if len(rows):
            cursor.row = number
            return write_rows(rows)
        if cursor.change < self._change_count:
            first, cursor.change = bisect_right(self._change_numbers, cursor.change), self._change_count
            return format_message("changes", changes=self._changes[first:])
        cursor.text = max(cursor.text, self._dropped)
        if cursor.text < self._dropped + len(self._texts):
            cursor.text += 1
            return self._texts[cursor.text - self._dropped - 1]
        return None
