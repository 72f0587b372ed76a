"""The summary of a run: numbers that are computed from its record alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from controller.driven_axes import AXES, undriven_axes
from controller.regions.region_set import of_attitude
from cosim.io.strict_json import nan_to_none
from cosim.results.goal_miss import explain_miss
from cosim.results.law_reports import DRAG, ISOLATED, REJECTED, Isolations
from cosim.results.lyapunov_summary import summarize_lyapunov
from cosim.results.record import Rows
from cosim.results.spans import SETTLED_FOR, Span, Spans
from cosim.results.water_surface import heights_above_surface, hull_radius, is_submerged_model
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array

_SUM_SIZE = 2**18  # numbers that are summed at once

_FORCE = [f"actuation.{axis}" for axis in "XYZ"]
_COMMAND_COLUMNS = [f"command.{axis}" for axis in "XYZ"]
_SPEED = [f"velocity.{axis}" for axis in "uvw"]
_POSITION = [f"position.{axis}" for axis in "xyz"]
_ESTIMATE = [f"estimate.phi{i}" for i in range(1, 5)]


def summarize(scenario: Scenario, record: Rows, status: str, wall_time: float | None) -> dict[str, Any]:
    """Summarize a run; wall_time [s]."""
    names = [secondary.region.name for secondary in scenario.regions]
    first_rows = record.take(range(min(2, len(record))), ["time", *(f"{name}.clearance" for name in names)])
    # period of the record's rows, which may be fewer than the run's steps
    period = float(np.diff(first_rows["time"])[0]) if len(first_rows) > 1 else scenario.time.step
    data = _SummaryData(names, scenario, record, period)
    with np.errstate(over="ignore", invalid="ignore"):  # a damaged record: norms that overflow are infinite
        for block in record.blocks(data.signals):
            data.add(block)
    visits, last = data.visits, data.last
    simulated = float(last["time"])
    settled = bool(visits and data.inside.open and simulated - visits[-1].start >= SETTLED_FOR)
    submerged = scenario.has_goal and not scenario.log and is_submerged_model(scenario)
    above = [name for name, _ in heights_above_surface(scenario)] if submerged else []
    min_clearance = {name: data.least[f"{name}.clearance"] for name in names}
    summary = {
        "scenario": scenario.name,
        "law": scenario.law.name,
        "arbiter": scenario.arbiter.engine,
        "vehicle": scenario.vehicle.name,
        "status": status,
        "has_goal": scenario.has_goal,
        "simulated_time": simulated,
        "reached": bool(visits),
        "reach_time": visits[0].start if visits else None,
        "settled": settled,
        "settle_time": visits[-1].start if visits else None,
        "final_position": [last[name] for name in _POSITION],
        **(
            {
                "goals": {
                    "reached": int(last["goal.place"]),
                    "of": len(scenario.mission.stops),
                    "arrivals": data.arrivals,
                }
            }
            if scenario.goal_then
            else {}
        ),
        "closest_to_goal": -data.greatest["goal.clearance"],
        "weighted_violation": data.violation.total() * period,
        "intersection": [names[i] for i in scenario.intersection],
        "intersection_windows": [(span.start, span.end) for span in data.windows],
        "min_clearance": min_clearance,
        "clearance_unit": {r.region.name: "rad" if of_attitude(r.region.shape) else "m" for r in scenario.regions},
        "hard": [r.region.name for r in scenario.regions if r.region.hard],
        "hard_violated": [
            r.region.name for r in scenario.regions if r.region.hard and min_clearance[r.region.name] < 0.0
        ],
        "violated_at_start": [name for name in names if first_rows[f"{name}.clearance"][0] < 0.0],
        "max_force": data.greatest.get("force", 0.0),
        "max_force_asked": data.greatest["asked"],
        "max_speed": data.greatest["speed"],
        "weights_above_half": int(data.greatest["above half"]),
        "weights_sum_max": data.greatest["sum of weights"],
        "effort": data.force.total() * period,
        "saturated_time": data.saturated * period,
        "isolations": _isolations(scenario, data.isolations.changes),
        "rejected_samples": last.get(REJECTED),
        "drag_ratio": nan_to_none(last.get(DRAG)),
        "above_surface": above,
        "time_above_surface": min(data.above * period, simulated) if submerged else 0.0,
        "estimate_final": [last[name] for name in _ESTIMATE],
        "estimate_true": scenario.true_restoring_parameters.tolist(),
        "estimate_lowest": [data.least[name] for name in _ESTIMATE],
        "estimate_highest": [data.greatest[name] for name in _ESTIMATE],
        "lyapunov": summarize_lyapunov(record),
        "steps": round(simulated / scenario.time.step),
        "wall_time": wall_time,
        "real_time_factor": simulated / wall_time if wall_time else None,
    }
    return summary | {"goal_miss": explain_miss(scenario, record, data.flags, summary)}


def _isolations(scenario: Scenario, changes: list[tuple[float, int, bool]]) -> list[dict[str, Any]]:
    """Return the isolations of thrusters, each with the axes that those left do not drive."""
    vehicle, works, isolations = scenario.vehicle, np.ones(scenario.vehicle.n_thrusters), []
    for time, thruster, isolated in changes:
        works[thruster - 1] = not isolated
        if isolated:
            axes = undriven_axes(vehicle.thruster_matrix, vehicle.thrust_min * works, vehicle.thrust_max * works)
            isolations.append({"thruster": thruster, "time": time, "undriven": [AXES[axis] for axis in axes]})
    return isolations


class _SummaryData:
    """Data for a summary, collected from a record block by block."""

    def __init__(self, names: Sequence[str], scenario: Scenario, record: Rows, period: float) -> None:
        self._clearances = [f"{name}.clearance" for name in names]
        self._together = [self._clearances[i] for i in scenario.intersection]
        flags = ("wrench_saturated", "allocation_saturated")
        self.flags = [name for name in record.units if name.startswith("thrust_saturated[") or name in flags]
        self._weights = [f"weight.{name}" for name in scenario.criterion_names]
        self._place = ["goal.place"] if scenario.goal_then else []
        self.signals = [
            "time", "goal.clearance", *self._clearances, *_FORCE, *_COMMAND_COLUMNS, *_SPEED, *_POSITION, *_ESTIMATE,
            *self._weights, *self.flags, *self._place,
            *(name for name in (ISOLATED, REJECTED, DRAG) if name in record.units),
        ]  # fmt: skip
        self._last_place = len(scenario.goal_then)
        # s, first time within the goal at each of its places; None: not yet
        self.arrivals: dict[str, float | None] = dict.fromkeys(scenario.mission.stops)
        # rows with acting forces that are left: the forces of a complete run's last row do not act
        self._acting = math.ceil(scenario.steps / max(1, round(period / scenario.time.step)))
        # fmin and fmax ignore NaN
        self.least: dict[str, float] = {}
        self.greatest: dict[str, float] = {}
        self.force, self.violation, self.saturated = _Sum(), _Sum(), 0
        self._priorities = np.array([secondary.priority for secondary in scenario.regions])
        self._dry, self.above = -hull_radius(scenario), 0  # m, depth of a vehicle in the air; rows above that
        self.inside, self._overlap = Spans(), Spans()
        self._visits: list[Span] = []  # the first and the last visit of the goal that ended
        self._windows: list[Span] = []
        self.isolations = Isolations()
        self.last: dict[str, float] = {}

    @property
    def visits(self) -> list[Span]:
        """The first and the last span within the goal."""
        return [*self._visits, *([self.inside.open] if self.inside.open else [])]

    @property
    def windows(self) -> list[Span]:
        """All spans within the overlap of the regions."""
        return [*self._windows, *([self._overlap.open] if self._overlap.open else [])]

    def add(self, block: Rows) -> None:
        """Add the next rows."""
        time, goal = block["time"], block["goal.clearance"]
        if self._last_place:
            self._update_arrivals(time[goal >= 0.0], block["goal.place"][goal >= 0.0])
            goal = np.where(block["goal.place"] == self._last_place, goal, np.nan)
        for span in self.inside.add(goal >= 0.0, time):
            self._visits = [*self._visits[:1], span]
        if self._together:
            overlap = np.logical_and.reduce([block[name] < 0.0 for name in self._together])
            self._windows += self._overlap.add(overlap, time)
        acted = slice(0, max(0, self._acting))
        self._acting -= len(time)
        force = np.linalg.norm(block.stack(_FORCE), axis=1)[acted]
        self.force.add(force)
        if self._clearances:
            self.violation.add((np.maximum(-block.stack(self._clearances), 0.0) * self._priorities).sum(axis=1)[acted])
        self.saturated += int(np.count_nonzero(np.logical_or.reduce([block[n][acted] > 0.0 for n in self.flags])))
        self.above += int(np.count_nonzero(block["position.z"] < self._dry))
        weights = block.stack(self._weights)
        self._update_extremes(self.greatest, np.fmax, {
            "goal.clearance": goal,
            "force": force,
            "asked": np.linalg.norm(block.stack(_COMMAND_COLUMNS), axis=1),
            "speed": np.linalg.norm(block.stack(_SPEED), axis=1),
            "above half": (weights > 0.5).sum(axis=1),
            "sum of weights": weights.sum(axis=1),
            **{name: block[name] for name in _ESTIMATE},
        })  # fmt: skip
        self._update_extremes(self.least, np.fmin, {name: block[name] for name in (*self._clearances, *_ESTIMATE)})
        if ISOLATED in block.units:
            self.isolations.add(time, block[ISOLATED])
        reports = [name for name in (REJECTED, DRAG) if name in block.units]
        last = {name: float(block[name][-1]) for name in ("time", *_POSITION, *_ESTIMATE, *self._place, *reports)}
        if DRAG in last:
            known = block[DRAG][np.isfinite(block[DRAG])]  # a law without measurements has no estimate
            last[DRAG] = float(known[-1]) if known.size else self.last.get(DRAG, np.nan)
        self.last = last

    def _update_arrivals(self, time: Array, place: Array) -> None:
        """Note when the vehicle first was within the goal at each of its places."""
        places, rows = np.unique(place, return_index=True)
        names = [*self.arrivals]
        for index, row in zip(places.astype(int), rows, strict=True):
            if self.arrivals[names[index]] is None:
                self.arrivals[names[index]] = float(time[row])

    @staticmethod
    def _update_extremes(known: dict[str, float], extreme: np.ufunc, signals: dict[str, Array]) -> None:
        for name, signal in signals.items():
            if signal.size:
                known[name] = float(extreme(known.get(name, np.nan), extreme.reduce(signal)))


class _Sum:
    """A sum that does not depend on block sizes: NumPy sums a fixed count of numbers at once."""

    def __init__(self) -> None:
        self._waiting: Array = np.empty(_SUM_SIZE)
        self._filled, self._total = 0, 0.0

    def add(self, numbers: Array) -> None:
        """Add numbers, shape (n,)."""
        while numbers.size:
            accepted = numbers[: _SUM_SIZE - self._filled]
            self._waiting[self._filled : self._filled + len(accepted)] = accepted
            self._filled, numbers = self._filled + len(accepted), numbers[len(accepted) :]
            if self._filled == _SUM_SIZE:
                self._total, self._filled = self.total(), 0

    def total(self) -> float:
        """Return the sum of all added numbers."""
        return self._total + float(self._waiting[: self._filled].sum())
