"""What is known of the run that is shown, and told to each viewer at its own pace. No sockets; one thread."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from controller.regions import Sphere
from controller.regions.shape import Shape
from cosim.errors import CommandError
from cosim.live.command_desk import CommandDesk
from cosim.live.history import History
from cosim.live.messages import bytes_of, text_of
from cosim.replay.command_words import command_words
from cosim.replay.header import header_of, limits_of, shape_of
from cosim.replay.viewing import Viewing
from cosim.scenario.scenario import Scenario
from cosim.scenario.tables import PARKED_POSITION
from cosim.simulation.commands.commands import AddObstacle, ChangeSetting, Command, ManualControl, RemoveObstacle
from cosim.simulation.commands.obstacle_slots import ObstacleSlots
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.environment import shape_center
from cosim.simulation.signals import Array, Column

log = logging.getLogger(__name__)

_ROWS = 512  # of a message
_SAID = 50  # texts that who comes late still gets


@dataclass
class Cursor:
    """What a viewer has been told."""

    run: int = -1
    row: int = 0
    text: int = 0
    change: int = 0


class Hub:
    """The run that is shown.

    Attributes
    ----------
    run : int
        Which run it is, from 0; -1 before the first.
    desk : CommandDesk
        Takes what viewers order.
    """

    def __init__(self) -> None:
        self.run = -1
        self.desk: CommandDesk | None = None
        self._texts: list[str] = []
        self._dropped = 0  # texts that are kept no more
        self._last: Array | None = None

    def begin(self, run: int, scenario: Scenario, columns: Sequence[Column], queue: CommandQueue | str) -> None:
        """Show another run from now on.

        Parameters
        ----------
        run : int
            Its number.
        scenario : Scenario
            What is run.
        columns : sequence of Column
            Of its rows.
        queue : CommandQueue or str
            Where commands go, or why there are none.
        """
        self.run = run
        self._viewing = Viewing(scenario, columns)
        self._names = {column.name: i for i, column in enumerate(self._viewing.columns)}
        self._header = header_of(scenario, self._viewing.columns, isinstance(queue, CommandQueue))
        self._header["changes"] = []
        self._limits = limits_of(scenario)
        self._step = scenario.time.step
        self._middle, self._target_radius = shape_center(scenario.goal), 0.0
        self._regions = ["goal", *(secondary.region.name for secondary in scenario.regions)]
        self._slots = ObstacleSlots(scenario.commands.obstacles)
        self._came = [secondary.region.name for secondary in scenario.regions if secondary.is_dynamic]  # by slot
        self._history = History(len(self._viewing.columns))
        self._texts, self._dropped, self._last = [], 0, None
        self.desk = CommandDesk(scenario, queue, self._has_come)

    @property
    def picked(self) -> list[int]:
        """Columns of the run's rows that are shown."""
        return self._viewing.picked

    def _has_come(self, region: str) -> bool:
        if self._last is None:
            return False
        return any(self._last[self._names[f"{region}.shift.{axis}"]] for axis in "xyz")

    # ---- what happens ----

    def show(self, picked: Sequence[Array]) -> None:
        """Take rows of the run, each of the columns `picked`; one that says nothing new is left out."""
        for row in self._viewing.extended(np.array(picked)):
            if self._last is None or not np.array_equal(row, self._last, equal_nan=True):
                self._history.add(row)
                self._last = row
                if "target.radius" in self._names and row[self._names["target.radius"]] != self._target_radius:
                    self._target_radius = float(row[self._names["target.radius"]])
                    self._change("goal", float(row[0]))

    def show_commands(self, k: int, commands: Sequence[Command]) -> None:
        """Tell of the commands that step `k` follows, and of the regions that they change."""
        time = k * self._step
        for command in commands:
            if not isinstance(command, ManualControl):  # which come all the time
                self.say(command_words(command), "command", time)
            try:
                self._follow(command, time)
            except CommandError as error:
                log.debug("%s", error)  # which the command handler tells

    def _follow(self, command: Command, time: float) -> None:
        assert self.desk is not None
        self.desk.follow(command)
        match command:
            case ChangeSetting():
                region = self.desk.settings.region_of(command.key)
                if region is not None:
                    self._change(region, time)
            case AddObstacle():
                name = self._came[self._slots.take(command.number)]
                self._change(name, time, Sphere(PARKED_POSITION, command.radius))
                self._header["changes"][-1]["number"] = command.number  # by which it is moved and forgotten
            case RemoveObstacle():
                self._slots.leave(command.number)

    def _change(self, name: str, time: float, shape: Shape | None = None) -> None:
        """Note another shape or gain of a region; default: as the settings have it."""
        assert self.desk is not None
        settings, index = self.desk.settings, self._regions.index(name)
        if name == "goal" and self._target_radius > 0.0:
            shape = Sphere(self._middle, self._target_radius)
        gain = self._header["regions"][index]["gain"] if shape or not index else settings[f"regions.{name}.gain"]
        drawn = shape_of(shape or settings.shapes[name], self._limits)
        self._header["changes"].append({"time": time, "region": index, "shape": drawn, "gain": gain})

    def say(self, text: str, kind: str = "info", time: float | None = None) -> None:
        """Tell all viewers something; `kind` is info, order or warning, `time` simulated [s]."""
        self._tell(text_of("said", kind=kind, text=text, time=time))

    def end(self, status: str, verdict: str) -> None:
        """Tell how the run ended."""
        self._header |= {"status": status, "verdict": verdict}
        self._tell(text_of("end", status=status, verdict=verdict))

    def _tell(self, text: str) -> None:
        self._texts.append(text)
        if len(self._texts) > _SAID:
            self._texts.pop(0)
            self._dropped += 1

    # ---- what a viewer is told ----

    def told_all(self, cursor: Cursor) -> bool:
        """Return whether a viewer knows all."""
        return (cursor.run, cursor.row, cursor.change, cursor.text) == (
            self.run, self._history.count, len(self._header["changes"]), self._dropped + len(self._texts),
        )  # fmt: skip

    def next_for(self, cursor: Cursor) -> str | bytes | None:
        """Return the next message for a viewer, and note that it is told; None if there is nothing new."""
        if self.run < 0:
            return None
        if cursor.run != self.run:
            cursor.run, cursor.row, cursor.text = self.run, 0, self._dropped
            cursor.change = len(self._header["changes"])
            return text_of("header", run=self._header)
        rows, number = self._history.since(cursor.row, _ROWS)
        if len(rows):
            cursor.row = number
            return bytes_of(rows)
        if cursor.change < len(changes := self._header["changes"]):
            sent, cursor.change = cursor.change, len(changes)
            return text_of("changes", changes=changes[sent:])
        cursor.text = max(cursor.text, self._dropped)
        if cursor.text < self._dropped + len(self._texts):
            cursor.text += 1
            return self._texts[cursor.text - self._dropped - 1]
        return None
