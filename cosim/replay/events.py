"""Events of a run with times and texts: the marks on a view's time line."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise

import numpy as np

from controller.regions.region_set import of_attitude
from cosim.replay.activity import active_at, activity_signals
from cosim.replay.command_words import command_events
from cosim.replay.region_changes import Log
from cosim.results.law_reports import ISOLATED, REJECTED, Isolations, rejects
from cosim.results.record import Rows
from cosim.results.run_result import Run
from cosim.results.spans import Flags, Span, Spans
from cosim.results.wording import DRY_RUN, IMPORTED, isolation_text
from cosim.scenario.sensor_suite import SENSOR_NAMES
from cosim.simulation.signals import Array

Block = tuple[Array, Flags, Array | None]  # (rows,) times [s], where a condition holds, and a signal

_MAX_EVENTS = 12  # maximum number of events of a kind; of more, the closest ones are joined

_REJECTIONS_APART = 1.0  # s; rejected samples closer than that are one event, which takes at least as long

_MIN_ABSENCE = 0.1  # s; a shorter absence of the active region is ignored


@dataclass(frozen=True)
class Event:
    """A mark on the time line."""

    time: float  # s
    kind: str  # command, goal, violation, active, failure, saturation or end
    text: str
    until: float | None = None  # s, end of an event with a duration


def events_of(run: Run, log: Log) -> list[Event]:
    """List the events of a run in the order of time, at most `_MAX_EVENTS` of a kind."""
    step, rows = run.scenario.time.step, len(run.record)
    # a killed run has logged commands of rows that it did not save; a reset comes after the last row
    log = [(min(k, rows - 1), command) for k, command in log if k <= rows]
    commands = [Event(time, "command", text) for time, text in command_events(log, step, _MAX_EVENTS)]
    events = [
        *commands,
        *_arrivals(run),
        *_goal(run),
        *_violations(run),
        *_active(run),
        *_failures(run),
        *_outages(run),
        *_isolations(run),
        *_rejections(run),
        *_saturation(run),
    ]
    return [*sorted(events, key=lambda event: event.time), *_goal_miss(run), _end(run)]


def _arrivals(run: Run) -> Iterator[Event]:
    for name, time in run.summary.get("goals", {}).get("arrivals", {}).items():
        if time is not None:
            yield Event(time, "goal", f"Reaches {name} of the goal")


def _goal(run: Run) -> Iterator[Event]:
    def known() -> Iterator[Rows]:
        for block in run.record.blocks(["time", "goal.clearance"]):
            yield block.take(np.flatnonzero(np.isfinite(block["goal.clearance"])))

    first = next((float(block["time"][0]) for block in known() if len(block)), math.inf)
    for span, is_open in joined_spans((block["time"], block["goal.clearance"] >= 0.0, None) for block in known()):
        begins = "Starts in" if span.start == first else "Enters"
        yield Event(span.start, "goal", f"{begins} the goal region")
        if not is_open:
            yield Event(span.end, "goal", "Leaves the goal region")


def _violations(run: Run) -> Iterator[Event]:
    max_spans = max(1, _MAX_EVENTS // max(1, len(run.scenario.regions)))
    for secondary in run.scenario.regions:
        region, name = secondary.region, f"{secondary.region.name}.clearance"
        blocks = ((block["time"], block[name] < 0.0, block[name]) for block in run.record.blocks(["time", name]))
        for span, is_open in joined_spans(blocks, max_spans):
            depth = -span.least
            by = f"{math.degrees(depth):.1f}°" if of_attitude(region.shape) else f"{depth:.3f} m"
            soft = "" if region.hard else " (soft)"
            text = f"Violates {region.name}{soft} {_until(span, is_open)}, by up to {by}"
            yield Event(span.start, "violation", text, span.end)


def active_region_changes(run: Run) -> list[tuple[float, int]]:
    """List the changes of the active region; of more than 12 those after which it stays longest."""
    return _longest_changes(_all_changes(run))


def _active(run: Run) -> Iterator[Event]:
    regions = run.scenario.regions
    for i, (time, index) in enumerate(active_region_changes(run)):
        if index:
            secondary = regions[index - 1]
            yield Event(time, "active", f"Gives way to {secondary.region.name} ({secondary.criterion})")
        elif i:
            yield Event(time, "active", "Goes for the goal again")


def _all_changes(run: Run) -> Iterator[tuple[float, int]]:
    """Yield time and index of the active region's changes, 0 for the goal; first those of the first row."""
    before = -1
    for block in run.record.blocks(["time", *activity_signals(run.scenario)]):
        active = active_at(run.scenario, block)
        for row in np.flatnonzero(np.diff(active, prepend=before)).tolist():
            yield float(block["time"][row]), int(active[row])
        before = int(active[-1])


def _failures(run: Run) -> Iterator[Event]:
    end = run.record.value("time", -1)
    for failure in run.scenario.failures:
        if failure.time <= end:
            what = "gets stuck" if failure.stuck else "fails"
            if not failure.is_total:
                what = f"keeps {failure.effectiveness:.0%} of its force"
            yield Event(failure.time, "failure", f"Thruster {failure.thruster} {what}")


def _outages(run: Run) -> Iterator[Event]:
    end = run.record.value("time", -1)
    for outage in run.scenario.outages:
        for time, what in ((outage.time, "is lost"), (outage.time + outage.duration, "is back")):
            if time <= end:
                yield Event(time, "failure", f"{SENSOR_NAMES[outage.sensor]} {what}")


def _isolations(run: Run) -> Iterator[Event]:
    if ISOLATED in run.record.units:
        isolations = Isolations()
        for block in run.record.blocks(["time", ISOLATED]):
            isolations.add(block["time"], block[ISOLATED])
        for time, thruster, isolated in isolations.changes[:_MAX_EVENTS]:
            yield Event(time, "failure", isolation_text(thruster, isolated))


def _rejections(run: Run) -> Iterator[Event]:
    if REJECTED not in run.record.units:
        return

    def blocks() -> Iterator[Block]:
        before = 0.0
        for block in run.record.blocks(["time", REJECTED]):
            yield block["time"], rejects(block[REJECTED], before), None
            before = float(block[REJECTED][-1])

    for span, is_open in joined_spans(blocks(), apart=_REJECTIONS_APART):
        if span.end - span.start >= _REJECTIONS_APART:
            text = f"The law rejects samples of position or velocity {_until(span, is_open)}"
            yield Event(span.start, "failure", text, span.end)


def _goal_miss(run: Run) -> Iterator[Event]:
    if run.summary["goal_miss"]:
        yield Event(run.record.value("time", -1), "goal", f"Misses the goal. {run.summary['goal_miss']}")


def _saturation(run: Run) -> Iterator[Event]:
    flags = ("wrench_saturated", "allocation_saturated")
    blocks = (
        (block["time"], np.logical_or.reduce([block[name] > 0.0 for name in flags]), None)
        for block in run.record.blocks(["time", *flags])
    )
    for span, is_open in joined_spans(blocks):
        text = f"The commanded force exceeds the limits, {_until(span, is_open)}"
        yield Event(span.start, "saturation", text, span.end)


def _end(run: Run) -> Event:
    status = run.summary["status"]
    words = {
        "completed": "End of the run",
        "interrupted": "The run was interrupted",
        "reset": "The run was reset",
        "killed": "The run was killed: its record ends here",
        IMPORTED: "End of the log",
        DRY_RUN: "End of the dry run",
    }
    return Event(run.record.value("time", -1), "end", words.get(status, f"The run {status}"))


def _until(span: Span, is_open: bool) -> str:
    """Format the end of a span as text."""
    return "to the end" if is_open else f"until {span.end:.3f} s"


def joined_spans(
    blocks: Iterable[Block], max_spans: int = _MAX_EVENTS // 2, apart: float = -math.inf
) -> list[tuple[Span, bool]]:
    """Find the spans in which a condition holds, and if they last to the end; join the closest ones; apart [s]."""
    # spans at most `apart` from each other are joined; if more than `max_spans` are left, more of them
    spans, joined = Spans(), list[Span]()
    for time, flags, signal in blocks:
        joined, apart = _join([*joined, *spans.add(flags, time, signal)], max_spans, apart)
    joined, _ = _join([*joined, *([spans.open] if spans.open else [])], max_spans, apart)
    return [(span, span is spans.open) for span in joined]


def _join(spans: Sequence[Span], max_spans: int, apart: float) -> tuple[list[Span], float]:
    """Join spans that are close to each other; return them, and the distance up to which they were joined [s]."""
    gaps = sorted(gap for a, b in pairwise(spans) if (gap := b.start - a.end) > apart)
    if len(gaps) >= max_spans:
        apart = gaps[len(gaps) - max_spans]
    joined: list[Span] = []
    for span in spans:
        if joined and span.start - joined[-1].end <= apart:
            last = joined.pop()  # the later one stays, so that the open one is found again
            span.start, span.least = last.start, float(np.fmin(last.least, span.least))
        joined.append(span)
    return joined, apart


def _longest_changes(changes: Iterator[tuple[float, int]]) -> list[tuple[float, int]]:
    """Return at most `_MAX_EVENTS` changes, those after which the region stays active longest."""
    longest = heapq.nsmallest(_MAX_EVENTS, _changes_with_duration(changes))
    kept: list[tuple[float, int]] = []
    for _, time, active in sorted(longest, key=lambda change: change[1]):
        if not kept or active != kept[-1][1]:
            kept.append((time, active))
    return kept


def _changes_with_duration(changes: Iterator[tuple[float, int]]) -> Iterator[tuple[float, float, int]]:
    """Yield negative duration [s], time [s] and region of each change; ignore absences below `_MIN_ABSENCE`."""
    pending: tuple[float, int] | None = None
    first = True
    for (time, active), (then, back) in pairwise(chain(changes, [(math.inf, -1)])):
        if pending is not None and (active == pending[1] or (then - time < _MIN_ABSENCE and back == pending[1])):
            continue
        if pending is not None:
            yield -math.inf if first else pending[0] - time, *pending
            first = False
        pending = time, active
    if pending is not None:
        yield -math.inf, *pending
