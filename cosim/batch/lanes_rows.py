"""Scenarios as rows of numbers for the lanes, and the checks of many rows at once."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from controller.errors import RegionError
from controller.regions import Pipe, Prism, Region, pack
from controller.regions.in_c import require_in_c
from cosim.batch.variation import Variation
from cosim.errors import RunError, ScenarioError
from cosim.scenario.scenario import Scenario
from cosim.scenario.start_values import start_values
from plant_fmu.variables import Variable, variables

Array = NDArray[np.float64]

_PARAMETERS = "plant.parameters."
# keys that may vary: those in a row; and the seed, which has no effect in lanes
_VARIED = (
    "initial.",
    "goal.",
    "regions.",
    "law.",
    "limit.",
    "plant.current.",
    _PARAMETERS,
    "arbiter.ramp",
    "sensing.seed",
)
# parameters that start clocks in the plant
_CLOCKED = ("depth_sensor.rate", "dvl.rate", "imu.rate", "compass.rate", "usbl.rate", "current_variation.")
# numbers that are checked together: the parts of a unit quaternion, and shapes whose points must not coincide
_JOINT = ("initial.quaternion.", "law.desired_quaternion.")
_JOINT_SHAPES = (Pipe, Prism)
_PAPER = "the paper's"
_SEEDS = (0, 2**31 - 1)  # range of the plant's seed


class Rows:
    """Rows of numbers for a variation, and the checks of their values.

    A value that is copied unchanged from the scenario into the row is written for many rows at once. Such values are
    checked one by one by the scenario's own checks, which accept all values between two accepted ones. All other rows
    are made from their scenario, one by one.

    Parameters
    ----------
    variation : Variation
        The variation.

    Attributes
    ----------
    reals, integers : tuple of Variable
        Variables of the plant, with whose start values a row begins.
    regions : tuple of Region
        The goal and the other regions of the base.
    base : ndarray, shape (width,)
        The row of the base: start values, desired attitude, gains of the law, ramp, gains of the regions, numbers of
        the shapes (the goal's first), velocities of the regions (the goal's first).

    Raises
    ------
    RunError
        If a key is not part of a row.
    """

    def __init__(self, variation: Variation) -> None:
        self.variation = variation
        base = variation.base
        for key in variation.keys:
            _require_variable(key, _CLOCKED)
        self._references = {v.name: (i, v) for i, v in enumerate(variables(base.vehicle))}
        names = dict.fromkeys((*start_values(base), "wrench_force_limit"))
        names |= dict.fromkeys(k.removeprefix(_PARAMETERS) for k in variation.keys if k.startswith(_PARAMETERS))
        rows = [self._references[name][1] for name in names]
        self.reals = tuple(v for v in rows if v.type == "real")
        self.integers = tuple(v for v in rows if v.type != "real")
        for v in self.integers:
            if f"{_PARAMETERS}{v.name}" in variation.keys:
                raise RunError(f"lanes cannot vary '{_PARAMETERS}{v.name}', which is no real number")
        self.regions = regions_of(base)
        self.base = self.row(base)
        self._slots = [self._slot(i) for i in range(len(variation.keys))]
        self._direct = [i for i, slot in enumerate(self._slots) if slot >= 0]
        self._ranges = np.array([[base_value] * 2 for base_value in (*self._base_values(), 0.0)])

    def references(self, rows: tuple[Variable, ...]) -> NDArray[np.uint32]:
        """Return the value references of some of the plant's variables."""
        return np.array([self._references[v.name][0] for v in rows], np.uint32)

    def row(self, scenario: Scenario) -> Array:
        """Return the row of a scenario of the variation, shape (width,)."""
        given = start_values(scenario)
        packed = pack(regions_of(scenario))
        parts = (
            [float(given.get(v.name, v.start)) for v in (*self.reals, *self.integers)],
            scenario.law.desired_quaternion,
            scenario.law.gains,
            [scenario.arbiter.ramp],
            packed.gains[1:],
            packed.numbers,
            packed.velocities.ravel(),
        )
        return np.concatenate([np.asarray(part, dtype=float) for part in parts])

    def fill(self, values: Array, seeds: NDArray[np.int64]) -> tuple[Array, dict[int, str]]:
        """Make the rows of a batch.

        Parameters
        ----------
        values : ndarray, shape (rows, keys)
            Values of the keys that vary.
        seeds : ndarray of int, shape (rows,)
            Seed of each row.

        Returns
        -------
        ndarray, shape (rows, width), and dict
            The rows, and by index the reasons for refusing some of them; those have undefined contents.
        """
        rows = np.tile(self.base, (len(seeds), 1))
        refused: dict[int, str] = {}
        slots = [self._slots[i] for i in self._direct]
        rows[:, slots] = values[:, self._direct]
        limit = [v.name for v in self.reals].index("wrench_force_limit")
        rows[np.isposinf(rows[:, limit]), limit] = self.reals[limit].start  # none
        alone = ~self._between(values, seeds)
        for at in np.flatnonzero(alone).tolist():
            try:
                rows[at] = self.row(self.variation.scenario(values[at].tolist(), int(seeds[at])))
            except ScenarioError as error:
                refused[at] = str(error)
        for at in np.flatnonzero((seeds < _SEEDS[0]) | (seeds > _SEEDS[1])).tolist():
            refused.setdefault(at, f"seed is {seeds[at]}, expected a whole number from {_SEEDS[0]} to {_SEEDS[1]}")
        return rows, refused

    # ---- rows that need no own check ----

    def _between(self, values: Array, seeds: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return a mask of the rows whose values are all between accepted ones; check extremes beyond those."""
        if len(self._direct) < len(self._slots) or not len(seeds):
            return np.zeros(len(seeds), np.bool_)
        columns = np.column_stack([values, seeds.astype(float)])
        for i, column in enumerate(columns.T):
            for side, extreme in enumerate((np.fmin.reduce(column), np.fmax.reduce(column))):
                beyond = extreme < self._ranges[i, 0] if side == 0 else extreme > self._ranges[i, 1]
                if beyond and self._accepts(i, float(extreme)):
                    self._ranges[i, side] = extreme
        within = (columns >= self._ranges[:, 0]) & (columns <= self._ranges[:, 1])
        return np.asarray(within.all(axis=1), np.bool_)

    def _accepts(self, i: int, value: float) -> bool:
        """Return True if the scenario accepts a value of key `i`, with all others as in the base."""
        values = [*self._base_values(), 0.0]
        values[i] = value
        try:
            self.variation.scenario(values[:-1], int(values[-1]))
        except ScenarioError:
            return False
        return True

    def _base_values(self) -> list[float]:
        return [float(self.variation.number(key)) for key in self.variation.keys]

    def _slot(self, i: int) -> int:
        """Return the index in a row to which the value of a key is copied; -1 if there is none, or for joint checks."""
        key = self.variation.keys[i]
        whole = not isinstance(self.variation.number(key), float)  # fractions are invalid, which no range expresses
        if whole or key.startswith(_JOINT) or self._is_joint(key):
            return -1
        values = self._base_values()
        for changed in _others(values[i]):
            tried = [*values[:i], changed, *values[i + 1 :]]
            try:
                row = self.row(self.variation.scenario(tried, 0))
            except ScenarioError:
                continue
            (places,) = np.nonzero(row != self.base)
            return int(places[0]) if places.size == 1 and row[places[0]] == changed else -1
        return -1

    def _is_joint(self, key: str) -> bool:
        """Return True if a number of a shape is checked together with others."""
        first, _, rest = key.partition(".")
        if first == "goal":
            return isinstance(self.regions[0].shape, _JOINT_SHAPES)
        if first != "regions":
            return False
        names = [region.name for region in self.regions[1:]]
        which = rest.partition(".")[0]
        at = names.index(which) if which in names else int(which)
        return isinstance(self.regions[1 + at].shape, _JOINT_SHAPES)


def regions_of(scenario: Scenario) -> tuple[Region, ...]:
    """Return the goal and the other regions of a scenario, in this order."""
    return (scenario.goal_region, *(secondary.region for secondary in scenario.regions))


def require_lanes(scenario: Scenario) -> None:
    """Raise `RunError` for the first key of a scenario that the lanes do not support."""
    s = scenario
    clocks = [name for name, value in s.plant.parameters.items() if name.startswith(_CLOCKED) and value]
    for key, received, expected in (
        ("law.name", s.law.name, "ismail_dunnigan"),
        ("arbiter.engine", s.arbiter.engine, "closed"),
        ("arbiter.file", s.arbiter.file, ""),
        ("arbiter.rules", s.arbiter.rules, "ordered"),
        ("criteria", _criteria_in_words(s), _PAPER),
        ("master.order", s.master.order, "gauss-seidel"),
        ("commands.enabled", s.commands.enabled, False),
        ("sensing", "noisy" if not s.sensing.exact else "exact", "exact"),
        ("failures", len(s.failures), 0),
        ("goal.then", s.goal_then, ()),
        *((f"{_PARAMETERS}{name}", s.plant.parameters[name], 0.0) for name in clocks),
    ):
        if received != expected:
            raise RunError(f"{key} is {received!r}, expected {expected!r} for lanes; the fused loop flies it")
    try:
        require_in_c(regions_of(s), "lanes")
    except RegionError as error:
        raise RunError(f"{error}; the fused loop flies it") from error
    if s.time.step / s.plant.substep > 1e6:
        raise RunError(f"plant.substep is {s.plant.substep} s, expected a millionth of time.step or more for lanes")


def _criteria_in_words(scenario: Scenario) -> str:
    return _PAPER if scenario.has_paper_criteria else f"one's own ({', '.join(scenario.criterion_names)})"


def _require_variable(key: str, clocked: tuple[str, ...]) -> None:
    if not key.startswith(_VARIED) or key.removeprefix(_PARAMETERS).startswith(clocked):
        raise RunError(
            f"lanes cannot vary {key!r}, expected a number of the start, goal, regions, law, limit, arbiter.ramp, "
            f"or of the plant but for samples and the current's variation; the fused loop can"
        )


def _others(value: float) -> Iterator[float]:
    """Yield values that differ from `value`, some of which may be valid."""
    tried = (1.0, 100.0) if math.isinf(value) else (value * 1.0078125, value * 0.9921875, value + 0.5, value - 0.5)
    yield from (other for other in tried if other != value)
