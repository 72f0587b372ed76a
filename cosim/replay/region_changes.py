"""Shapes and gains of the regions that commands changed, from the log of commands and the record."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.regions import Sphere
from controller.regions.region_set import shape_center
from controller.regions.shape import Bounds, Shape
from cosim.errors import CommandError
from cosim.replay.header import limits_of, shape_of
from cosim.results.as_flown import radii_of
from cosim.results.record import Rows
from cosim.results.run_result import COMMANDS_LOG, Run
from cosim.scenario.region_tables import PARKED_POSITION, SecondaryRegion
from cosim.simulation.commands.commands import (
    MODES,
    ChangeSetting,
    Command,
    MissionItem,
    SetCurrentItem,
    SetMission,
    SetMode,
)
from cosim.simulation.commands.mission_executor import passed_items
from cosim.simulation.commands.settings import LiveSettings
from cosim.simulation.commands.sources import read_log
from cosim.simulation.signals import Array

Log = Sequence[tuple[int, Command]]  # each command with the step at which it was applied

_RADIUS_TOLERANCE = 1e-6  # m; closer radii of a record are equal up to rounding


def read_command_log(run: Run) -> Log:
    """Read the log of commands of a run."""
    file = run.folder / COMMANDS_LOG
    return read_log(file) if run.scenario.commands.enabled and file.exists() else ()


def list_region_changes(run: Run, log: Log) -> list[dict[str, Any]]:
    """List the changes of regions during a run, except their motion."""
    if not run.scenario.commands.enabled:
        return []
    by_settings = _ChangeReplay(run).iterate(log)
    by_obstacles = (
        change
        for i, secondary in enumerate(run.scenario.regions)
        if secondary.is_dynamic
        for change in _radius_changes(run, i + 1, secondary)
    )
    return sorted([*by_settings, *by_obstacles], key=lambda change: change["time"])


class _ChangeReplay:
    """Replay the commanded changes, immediate or by items of a mission, on its own settings."""

    def __init__(self, run: Run) -> None:
        self._step = run.scenario.time.step
        self._limits = limits_of(run.scenario)
        self._settings = LiveSettings(run.planned)
        self._center = shape_center(run.planned.goal)
        self._index = {"goal": 0, **{r.region.name: i + 1 for i, r in enumerate(run.scenario.regions)}}
        self._gains = [run.scenario.goal_region.gain, *(r.region.gain for r in run.scenario.regions)]
        self._last_row = len(run.record) - 1
        self._changed_rows, self._values = _change_rows(run.record)
        self._items: tuple[MissionItem, ...] = ()
        self._item = -1  # item of the mission whose commands were applied last

    def iterate(self, log: Log) -> Iterator[dict[str, Any]]:
        """Yield the changes, step by step."""
        commanded = {k: [command for _, command in group] for k, group in groupby(log, key=lambda entry: entry[0])}
        for k in sorted({*commanded, *self._changed_rows.tolist()}):
            commands = commanded.get(k, [])
            # the last command, such as a reset, may be after the last row
            row = min(k, self._last_row)
            radius, in_mission, item = self._at_row(row)
            by_mission = self._by_mission(commands, int(item) if in_mission else None)
            changed_regions = {name for command in (*commands, *by_mission) if (name := self._apply(command))}
            if radius != self._at_row(row - 1)[0] if row else radius > 0.0:
                changed_regions.add("goal")
            for name in sorted(changed_regions, key=self._index.__getitem__):
                yield self._region_change(name, k, float(radius))

    def _at_row(self, row: int) -> Array:
        """Return the target's radius, 1 or 0 for a mission, and its item, shape (3,)."""
        values: Array = self._values[np.searchsorted(self._changed_rows, row, "right") - 1]
        return values

    def _by_mission(self, commands: Iterable[Command], now: int | None) -> Iterator[Command]:
        """Yield the commands of the items that start in a step; `now` is the item, None outside a mission."""
        restarted = False
        for command in commands:
            if isinstance(command, SetMission):
                self._items, self._item = command.items, -1
            elif isinstance(command, SetCurrentItem):
                self._item, restarted = command.item - 1, True
            elif isinstance(command, SetMode) and command.mode == "mission":
                self._item, restarted = max(self._item, 0) - 1, True
        if now is None or not 0 <= now < len(self._items) or (now == self._item and not restarted):
            return
        for item in passed_items(self._items, self._item, now) or [now]:
            yield from self._items[item].commands
        self._item = now

    def _apply(self, command: Command) -> str | None:
        """Apply a change, and return the name of its region; None if it has none, or the change is refused."""
        if not isinstance(command, ChangeSetting):
            return None
        region = self._settings.region_of(command.key)
        with contextlib.suppress(CommandError):
            self._settings.change(command.key, command.value)
            if region is not None and command.key.endswith(".gain"):
                self._gains[self._index[region]] = command.value
            return region
        return None

    def _region_change(self, name: str, k: int, target_radius: float) -> dict[str, Any]:
        shape: Shape = self._settings.shapes[name]
        if name == "goal" and target_radius > 0.0:
            shape = Sphere(self._center, target_radius)
        return _change_record(k * self._step, self._index[name], shape, self._gains[self._index[name]], self._limits)


def _radius_changes(run: Run, index: int, secondary: SecondaryRegion) -> Iterator[dict[str, Any]]:
    """Yield the changes of an obstacle's radius."""
    before, limits = -np.inf, limits_of(run.scenario)
    for times, radii in radii_of(run.record, secondary.region.name):
        fresh = np.abs(np.diff(radii, prepend=before)) > _RADIUS_TOLERANCE
        for time, radius in zip(times[fresh], radii[fresh], strict=True):
            obstacle = Sphere(PARKED_POSITION, max(float(radius), _RADIUS_TOLERANCE))
            yield _change_record(float(time), index, obstacle, secondary.region.gain, limits)
        before = radii[-1] if radii.size else before


def _change_rows(record: Rows) -> tuple[NDArray[np.intp], Array]:
    """Return the rows at which target or mission change, with the first, and their new values, shape (n, 3)."""
    first, rows, values, before = 0, [], [], np.full((1, 3), np.nan)
    for block in record.blocks(["target.radius", "commands.mode", "commands.item"]):
        item = block["commands.item"]
        in_mission = (block["commands.mode"] == MODES.index("mission")) & np.isfinite(item)
        rows_now = np.column_stack([block["target.radius"], in_mission, item])
        changed = np.flatnonzero((np.diff(rows_now, axis=0, prepend=before) != 0.0).any(axis=1))
        rows.append(first + changed)
        values.append(rows_now[changed])
        first, before = first + len(rows_now), rows_now[-1:]
    return np.concatenate(rows), np.concatenate(values)


def _change_record(time: float, index: int, shape: Shape, gain: float, limits: Bounds) -> dict[str, Any]:
    return {"time": time, "region": index, "shape": shape_of(shape, limits), "gain": gain}
