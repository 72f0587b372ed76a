"""Contents of a report, independent of its format: sentences, tables, and commands that repeat the run."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from controller.laws import LAWS
from cosim.replay.events import active_region_changes
from cosim.results.log_facts import IMPORT, LogFacts, load_log_facts
from cosim.results.paper_claims import paper_claims
from cosim.results.run_result import Run
from cosim.results.spans import Spans
from cosim.results.wording import describe_task, format_isolations, format_number, shape_name, verdict
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array

_NAMED = 12  # maximum number of unused kinds of messages, and of gaps, that a table lists
_MAX_SPANS = 6  # maximum number of spans that a table lists for a criterion


class Table(NamedTuple):
    """A table of texts."""

    title: str
    head: tuple[str, ...]  # names of the columns
    rows: tuple[tuple[str, ...], ...]


def contents_of(run: Run) -> dict[str, Any]:
    """Return what the report of a run says beside its figures and the summary, as plain text without escapes."""
    s, outside = run.scenario, run.summary["closest_to_goal"]
    side = f"{format_number(abs(outside), 4)} m {'outside' if outside > 0.0 else 'inside'}"
    windows = ", ".join(f"{start:.3f} to {end:.3f}" for start, end in run.summary["intersection_windows"])
    return {
        "task": describe_task(s),
        "verdict": verdict(run.summary),
        "remarks": _remarks(run),
        "claims": _claims(run),
        "regions": _regions(run),
        "criteria": _criteria(run),
        "nearest": side if math.isfinite(outside) else "no number",
        "windows": windows or "never",  # within the overlap of regions
        "arbiter": f"{s.arbiter.engine}; {_rules(s)}",
        "outages": ", ".join(f"{o.sensor} {o.time:g} to {o.time + o.duration:g} s" for o in s.outages),
        "isolated": format_isolations(run.summary) or "none",
        "limited": math.isfinite(s.limit.force) or s.limit.time_constant > 0.0,
        "log": _log(run),
        "repeatable": not s.log and (s.law.fmu is not None or s.law.name in LAWS),  # by ``cosim run`` from the folder
    }


def _remarks(run: Run) -> tuple[str, ...]:
    facts = _log_facts(run)
    remarks = facts.remarks if facts else ()
    names = [f"position.{axis}" for axis in "xyz"]
    names += ["goal.clearance"] if run.scenario.has_goal else []
    names += [f"{secondary.region.name}.clearance" for secondary in run.scenario.regions]
    count, first = 0, math.inf
    for block in run.record.blocks(["time", *names]):
        missing = np.logical_or.reduce([~np.isfinite(block[name]) for name in names])
        if missing.any():
            count, first = count + int(np.count_nonzero(missing)), min(first, block["time"][np.argmax(missing)])
    if not count:
        return remarks
    many = f"{count} of {len(run.record)} rows of the record hold places or clearances that are no numbers"
    return (f"{many}; the first is at {first:g} s. Figures have gaps there.", *remarks)


def _claims(run: Run) -> Table | None:
    if run.scenario.compare != "paper":
        return None
    rows = tuple((c.statement, c.result, c.reason) for c in paper_claims(run.scenario, run.summary))
    return Table("Beside the paper", ("The paper states", "This run gave", "Why"), rows)


def _regions(run: Run) -> Table | None:
    if not run.scenario.regions:
        return None
    violations = {secondary.region.name: _Violation() for secondary in run.scenario.regions}
    for block in run.record.blocks(["time", *(f"{name}.clearance" for name in violations)]):
        for name, violation in violations.items():
            violation.add(block["time"], block[f"{name}.clearance"])
    rows = []
    for secondary in run.scenario.regions:
        region = secondary.region
        violation, clearance = violations[region.name], run.summary["min_clearance"][region.name]
        when = f"{violation.worst_at:.2f}" if math.isfinite(clearance) else "–"
        degrees = run.summary["clearance_unit"][region.name] == "rad"
        shown = f"{format_number(math.degrees(clearance), 4)}°" if degrees else f"{format_number(clearance, 4)} m"
        violated_for = violation.duration()
        rows.append(
            (
                region.name,
                shape_name(region.shape),
                secondary.criterion,
                "within" if region.keep == "in" else "out of",
                "hard" if region.hard else "soft",
                shown,
                when,
                "never" if violated_for is None else f"{violated_for:.2f}",
            )
        )
    head = (
        "Region", "Shape", "Criterion", "Keep", "Hard or soft", "Least clearance", "at [s]", "Violated for [s]",
    )  # fmt: skip
    return Table("Regions", head, tuple(rows))


class _Violation:
    """Finds the time of a region's minimum clearance and the duration of its violations, block by block."""

    def __init__(self) -> None:
        self._min_clearance, self.worst_at = math.inf, math.nan  # m or rad, s
        self._spans, self._ended = Spans(), 0.0

    def add(self, time: Array, clearance: Array) -> None:
        """Add the next rows."""
        known = np.where(np.isnan(clearance), np.inf, clearance)
        i = int(np.argmin(known))
        if known[i] < self._min_clearance:
            self._min_clearance, self.worst_at = float(known[i]), float(time[i])
        self._ended += sum(span.end - span.start for span in self._spans.add(clearance < 0.0, time))

    def duration(self) -> float | None:
        """Return the total duration of violations of the region [s], None if there were none."""
        last = self._spans.open
        return self._ended + (last.end - last.start if last else 0.0) if self._min_clearance < 0.0 else None


def _criteria(run: Run) -> Table | None:
    """Return a table with the memberships of each criterion, the path's costs, and the spans in which it was active."""
    scenario = run.scenario
    if not scenario.regions or scenario.log:
        return None
    plans = bool(getattr(scenario.law.gains, "path_planning", 0.0))
    costs = {
        r.criterion: format_number(r.region.crossing_cost, 3) for r in scenario.regions if plans and not r.region.hard
    }
    changes, end = active_region_changes(run), run.record.value("time", -1)
    rows = []
    for i, criterion in enumerate(scenario.criteria):
        spans = [
            (start, stop, scenario.regions[index - 1].region.name)
            for (start, index), (stop, _) in pairwise([*changes, (end, 0)])
            if index and scenario.criterion_places[index - 1] == i
        ]
        shown = ", ".join(f"{start:.2f} to {stop:.2f} ({name})" for start, stop, name in spans[:_MAX_SPANS])
        more = f", and {len(spans) - _MAX_SPANS} more" if len(spans) > _MAX_SPANS else ""
        why = "; ".join(reason.words(scenario.arbiter.ramp) for reason in criterion.reasons)
        duration = sum(stop - start for start, stop, _ in spans)
        row = (f"{i + 1} {criterion.name}", why, f"{duration:.2f}" if spans else "never", f"{shown}{more}" or "–")
        rows.append((*row, *([costs.get(criterion.name, "–")] if costs else [])))
    head = ["By priority", "Asks", "Led for [s]", "From and to [s]"]
    if costs:  # of a meter of path half a meter deep in its soft regions: they decide which way round the path goes
        head.append("Path's cost of a meter [m]")
    return Table("Criteria", tuple(head), tuple(rows))


def _rules(scenario: Scenario) -> str:
    """Describe the rules that weigh the criteria."""
    if scenario.arbiter.file:
        inputs = ", ".join(f"{signal.name} ({signal.what})" for signal in scenario.rules.inputs)
        return f"the rules of {scenario.arbiter.file}, of {inputs}"
    if scenario.arbiter.rules != "ordered":
        return f"{', '.join(scenario.criterion_names)}: {scenario.arbiter.rules}"
    ramp = f"memberships fall to 0 over {scenario.arbiter.ramp:g} m (rad for attitude)"
    return ramp if scenario.has_paper_criteria else f"{', '.join(scenario.criterion_names)}, in this order"


def _log_facts(run: Run) -> LogFacts | None:
    """Load the facts about an imported run; None for other runs."""
    return load_log_facts(run.folder) if run.scenario.log and (run.folder / IMPORT).exists() else None


def _log(run: Run) -> dict[str, Any] | None:
    """Return the sources and the gaps of an imported run; None for other runs."""
    facts = _log_facts(run)
    if facts is None:
        return None
    rows = tuple(
        (
            t.quantity, t.source, str(t.samples), format_number(t.rate, 3), str(t.gaps),
            format_number(max((end - begin for begin, end in t.longest_gaps), default=0.0), 3), t.repairs or "–",
        )
        for t in facts.topics
    )  # fmt: skip
    topics = Table("Log", ("Quantity", "From", "Samples", "Rate [Hz]", "Gaps", "Longest [s]", "Mended"), rows)
    gaps = sorted((begin, end, t.quantity) for t in facts.topics for begin, end in t.longest_gaps)
    gap_rows = [(quantity, f"{begin:.2f} to {end:.2f}") for begin, end, quantity in gaps[:_NAMED]]
    gap_rows += [("and more", str(len(gaps) - _NAMED))] if len(gaps) > _NAMED else []
    more = f" and {len(facts.unread) - _NAMED} more kinds" if len(facts.unread) > _NAMED else ""
    return {
        "topics": topics,
        "gaps": Table("Gaps of the log", ("Quantity", "From and to [s]"), tuple(gap_rows)) if gaps else None,
        "commands": facts.commands or "none",
        "unread": f"{', '.join(list(facts.unread)[:_NAMED])}{more}" or "nothing",
    }
