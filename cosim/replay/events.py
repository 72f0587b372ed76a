"""What happened in a run, in plain words and at its times: the marks on a view's time line."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controller.regions import of_attitude
from cosim.flown_run import FlownRun
from cosim.replay.activity import active_regions
from cosim.replay.order_words import ordered_events
from cosim.replay.steering import Log
from cosim.scenario import CRITERIA
from cosim.signals import Array

_MOST = 12  # events of a kind; what comes closer together than that allows is told as one

_BACK = 0.1  # s; a region that is given way to again after less was not left


@dataclass(frozen=True)
class Event:
    """One mark."""

    time: float  # s
    kind: str  # order, goal, violation, active, failure, saturation or end
    text: str
    until: float | None = None  # s, of what lasts


@dataclass(frozen=True)
class _Span:
    """Rows from the first one to the one before `end`, in which a condition held."""

    first: int
    end: int


def events_of(run: FlownRun, log: Log) -> list[Event]:
    """Return what happened in a run, in the order of time; few enough to be read.

    Parameters
    ----------
    run : FlownRun
        Any.
    log : sequence of (int, Order)
        What it was ordered.

    Returns
    -------
    list of Event
        The last one is the end of the run.
    """
    step, rows = run.scenario.time.step, len(run.record["time"])
    # a killed run has logged orders of rows that it did not save; a reset comes behind the last row
    log = [(min(k, rows - 1), order) for k, order in log if k <= rows]
    orders = [Event(time, "order", text) for time, text in ordered_events(log, step, _MOST)]
    found = [*orders, *_goal(run), *_violations(run), *_active(run), *_failures(run), *_saturation(run)]
    return [*sorted(found, key=lambda event: event.time), _end(run)]


def _goal(run: FlownRun) -> Iterator[Event]:
    time, clearance = run.record["time"], run.record["goal.clearance"]
    known = np.flatnonzero(np.isfinite(clearance))
    for span in _few(_spans(clearance[known] >= 0.0), time[known], _MOST // 2):
        began = float(time[known[span.first]])
        yield Event(began, "goal", "Starts in the goal region" if span.first == 0 else "Enters the goal region")
        if span.end < len(known):
            yield Event(float(time[known[span.end]]), "goal", "Leaves the goal region")


def _violations(run: FlownRun) -> Iterator[Event]:
    time, regions = run.record["time"], run.scenario.regions
    most = max(1, _MOST // max(1, len(regions)))
    for secondary in regions:
        clearance = run.record[f"{secondary.region.name}.clearance"]
        for span in _few(_spans(clearance < 0.0), time, most):
            depth = -float(np.nanmin(clearance[span.first : span.end]))
            by = f"{math.degrees(depth):.1f}°" if of_attitude(secondary.region.shape) else f"{depth:.3f} m"
            soft = "" if secondary.region.hard else " (soft)"
            text = f"Violates {secondary.region.name}{soft} {_lasting(span, time)}, by up to {by}"
            yield Event(float(time[span.first]), "violation", text, _until(span, time))


def _active(run: FlownRun) -> Iterator[Event]:
    record, regions = run.record, run.scenario.regions
    memberships = record.stack([f"membership.{name}" for name in CRITERIA])
    weights = record.stack([f"weight.{name}" for name in CRITERIA])
    clearances = (
        record.stack([f"{secondary.region.name}.clearance" for secondary in regions])
        if regions
        else np.empty((len(weights), 0))
    )
    active = active_regions([secondary.criterion for secondary in regions], memberships, weights, clearances)
    time = record["time"]
    for row in _turns(active, time):
        index = int(active[row])
        if index:
            secondary = regions[index - 1]
            yield Event(float(time[row]), "active", f"Gives way to {secondary.region.name} ({secondary.criterion})")
        elif row:
            yield Event(float(time[row]), "active", "Goes for the goal again")


def _failures(run: FlownRun) -> Iterator[Event]:
    end = run.record["time"][-1]
    for failure in run.scenario.failures:
        if failure.time <= end:
            yield Event(failure.time, "failure", f"Thruster {failure.thruster} fails")


def _saturation(run: FlownRun) -> Iterator[Event]:
    record, time = run.record, run.record["time"]
    cut = (record["wrench_saturated"] > 0.0) | (record["allocation_saturated"] > 0.0)
    for span in _few(_spans(cut), time, _MOST // 2):
        text = f"More force is asked for than there is, {_lasting(span, time)}"
        yield Event(float(time[span.first]), "saturation", text, _until(span, time))


def _end(run: FlownRun) -> Event:
    status = run.summary["status"]
    words = {
        "completed": "End of the run",
        "interrupted": "The run was interrupted",
        "reset": "The run was reset",
        "killed": "The run was killed: its record ends here",
    }
    return Event(float(run.record["time"][-1]), "end", words.get(status, f"The run {status}"))


def _spans(flags: NDArray[np.bool_]) -> list[_Span]:
    edges = np.diff(flags.astype(np.int8), prepend=0, append=0)
    return [_Span(a, b) for a, b in zip(*(np.flatnonzero(edges == x).tolist() for x in (1, -1)), strict=True)]


def _until(span: _Span, time: Array) -> float:
    return float(time[min(span.end, len(time) - 1)])


def _lasting(span: _Span, time: Array) -> str:
    return f"until {time[span.end]:.3f} s" if span.end < len(time) else "to the end"


def _few(spans: list[_Span], time: Array, most: int) -> list[_Span]:
    """Join those spans that are nearest to each other, until there are few enough."""
    gaps = sorted(time[b.first] - time[a.end] for a, b in zip(spans, spans[1:], strict=False))
    if len(spans) <= most:
        return spans
    apart = gaps[len(spans) - most - 1]  # which, and all that are less, are closed
    joined = spans[:1]
    for span in spans[1:]:
        if time[span.first] - time[joined[-1].end] <= apart:
            joined[-1] = _Span(joined[-1].first, span.end)
        else:
            joined.append(span)
    return joined


def _turns(active: Array, time: Array) -> list[int]:
    """Return the rows at which another region takes over for long enough; of many only those where it stays longest."""
    rows = np.array([0, *(np.flatnonzero(np.diff(active)) + 1)])
    brief = np.diff(time[rows], append=np.inf) < _BACK
    kept = [0]
    for i in range(1, len(rows)):
        # one that is back at once was hardly away
        before = active[rows[kept[-1]]]
        if active[rows[i]] != before and not (brief[i] and active[rows[i + 1]] == before):
            kept.append(i)
    rows = rows[kept]
    if len(rows) > _MOST:
        lasting = np.diff(time[rows], append=np.inf)
        lasting[0] = np.inf
        rows = rows[np.sort(np.argsort(-lasting, kind="stable")[:_MOST])]
    return [int(row) for i, row in enumerate(rows) if i == 0 or active[row] != active[rows[i - 1]]]
