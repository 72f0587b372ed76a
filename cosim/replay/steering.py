"""What orders made of the regions on the way: their shapes and gains, from the log of orders and the record."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from controller.regions import Shape, Sphere
from cosim.errors import OrderError
from cosim.flown_run import ORDERS, FlownRun
from cosim.helm.course import way
from cosim.helm.orders import MODES, Begin, Change, Item, Mission, Order, Steer
from cosim.helm.settings import LiveSettings
from cosim.helm.sources import read_log
from cosim.replay.header import shape_of
from cosim.scenario_tables import FAR_AWAY, SecondaryRegion
from cosim.surroundings import middle_of

Log = Sequence[tuple[int, Order]]  # step that took it, and what was ordered

_SAME = 1e-6  # m; radii from a record that are nearer to each other are equal, but for rounding


def log_of(run: FlownRun) -> Log:
    """Return what a run was ordered.

    Parameters
    ----------
    run : FlownRun
        Any.

    Returns
    -------
    sequence of (int, Order)
        Steps, and orders that were taken at them; none where nothing could be ordered.

    Raises
    ------
    RunError
        If there is a log that cannot be read.
    """
    file = run.path / ORDERS
    return read_log(file) if run.scenario.commands.enabled and file.exists() else ()


def changes_of(run: FlownRun, log: Log) -> list[dict[str, Any]]:
    """Return how regions changed on the way, beside their motion.

    Parameters
    ----------
    run : FlownRun
        Any.
    log : sequence of (int, Order)
        From `log_of`.

    Returns
    -------
    list of dict
        ``time`` [s], ``region`` (its index in the header), ``shape`` and ``gain`` from then on, in the order of time.
    """
    if not run.scenario.commands.enabled:
        return []
    by_settings = _Changes(run).of(log)
    by_obstacles = (
        change
        for i, secondary in enumerate(run.scenario.regions)
        if secondary.seen
        for change in _sizes(run, i + 1, secondary)
    )
    return sorted([*by_settings, *by_obstacles], key=lambda change: change["time"])


class _Changes:
    """Follows the changes that were ordered, at once or by items of a mission, on settings of its own."""

    def __init__(self, run: FlownRun) -> None:
        record = run.record
        self._step = run.scenario.time.step
        self._settings = LiveSettings(run.planned)
        self._middle = middle_of(run.planned.goal)
        self._index = {"goal": 0, **{r.region.name: i + 1 for i, r in enumerate(run.scenario.regions)}}
        self._gains = [run.scenario.goal_region.gain, *(r.region.gain for r in run.scenario.regions)]
        self._radius = record["target.radius"]
        self._in_mission = record["helm.mode"] == MODES.index("mission")
        self._item = record["helm.item"]
        self._items: tuple[Item, ...] = ()
        self._at = -1  # item of the mission, as far as its orders were followed

    def of(self, log: Log) -> Iterator[dict[str, Any]]:
        """Yield what changes, step by step."""
        ordered = {k: [order for _, order in group] for k, group in groupby(log, key=lambda entry: entry[0])}
        changed = [np.flatnonzero(np.diff(signal)) + 1 for signal in (self._radius, self._in_mission, self._item)]
        rows = len(self._radius)
        for k in sorted({0, *ordered, *(int(k) for steps in changed for k in steps)}):
            orders = ordered.get(k, [])
            # the last order, such as a reset, may have come after the last row
            row = min(k, rows - 1)
            touched = {name for order in (*orders, *self._by_mission(orders, row)) if (name := self._follow(order))}
            if (row and self._radius[row] != self._radius[row - 1]) or (not row and self._radius[0] > 0.0):
                touched.add("goal")
            for name in sorted(touched, key=self._index.__getitem__):
                yield self._change(name, k, float(self._radius[row]))

    def _by_mission(self, orders: Iterable[Order], row: int) -> Iterator[Order]:
        """Yield the orders of the items that begin in a step."""
        begun = False
        for order in orders:
            if isinstance(order, Mission):
                self._items, self._at = order.items, -1
            elif isinstance(order, Begin):
                self._at, begun = order.item - 1, True
            elif isinstance(order, Steer) and order.mode == "mission":
                self._at, begun = max(self._at, 0) - 1, True
        if not self._in_mission[row]:
            return
        now = int(self._item[row])
        if not 0 <= now < len(self._items) or (now == self._at and not begun):
            return
        for item in way(self._items, self._at, now) or [now]:
            yield from self._items[item].orders
        self._at = now

    def _follow(self, order: Order) -> str | None:
        """Take a change, and return the region that has it; None if none has, or it was refused then too."""
        if not isinstance(order, Change):
            return None
        region = self._settings.region_of(order.key)
        with contextlib.suppress(OrderError):
            self._settings.change(order.key, order.value)
            if region is not None and order.key.endswith(".gain"):
                self._gains[self._index[region]] = order.value
            return region
        return None

    def _change(self, name: str, k: int, target_radius: float) -> dict[str, Any]:
        shape: Shape = self._settings.shapes[name]
        if name == "goal" and target_radius > 0.0:
            shape = Sphere(self._middle, target_radius)
        return _changed(k * self._step, self._index[name], shape, self._gains[self._index[name]])


def _sizes(run: FlownRun, index: int, secondary: SecondaryRegion) -> Iterator[dict[str, Any]]:
    """Yield the sizes with which an obstacle came, each at its time."""
    name, record = secondary.region.name, run.record
    shifts = record.stack([f"{name}.shift.{axis}" for axis in "xyz"])
    there = np.flatnonzero(shifts.any(axis=1))
    positions = record.stack([f"position.{axis}" for axis in "xyz"])[there]
    radii = np.linalg.norm(positions - shifts[there] - FAR_AWAY, axis=1) - record[f"{name}.clearance"][there]
    known = np.isfinite(radii)  # not where the pose is none
    there, radii = there[known], radii[known]
    fresh = np.abs(np.diff(radii, prepend=-np.inf)) > _SAME
    for row, radius in zip(there[fresh], radii[fresh], strict=True):
        shape = Sphere(FAR_AWAY, max(float(radius), _SAME))
        yield _changed(float(record["time"][row]), index, shape, secondary.region.gain)


def _changed(time: float, index: int, shape: Shape, gain: float) -> dict[str, Any]:
    return {"time": time, "region": index, "shape": shape_of(shape), "gain": gain}
