"""Contents of a report, independent of its format: sentences, tables, and commands that repeat the run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from controller.laws import LAWS
from cosim.replay.events import active_region_changes
from cosim.report.log_contents import effort_of_log, log_remarks, log_tables, setting_of_log
from cosim.report.table import Table
from cosim.results.log_facts import IMPORT
from cosim.results.paper_claims import paper_claims
from cosim.results.record import PARTS, RECORD
from cosim.results.run_result import COMMANDS_LOG, SCENARIO, SUMMARY, Run
from cosim.results.spans import Spans
from cosim.results.wording import describe_task, format_isolations, format_number, shape_name, verdict
from cosim.scenario.scenario import Scenario
from cosim.scenario.tables import Sensing
from cosim.simulation.signals import Array

_MAX_SPANS = 6  # greatest number of spans that a table lists for a criterion


@dataclass(frozen=True)
class Contents:
    """Contents of a report without its figures."""

    title: str
    asked: str
    verdict: str
    remarks: tuple[str, ...]
    claims: Table | None  # comparison with the paper's claims
    regions: Table | None
    numbers: tuple[Table, ...]
    setting: Table
    scenario: str  # text of the scenario file
    repeat: tuple[str, ...]  # commands that repeat the run
    repeats: str  # description of these commands
    files: tuple[tuple[str, str], ...]  # name and description of files in the run folder


def contents_of(run: Run) -> Contents:
    """Make the contents of a run's report.

    Parameters
    ----------
    run : Run
        Completed, interrupted or killed run.

    Returns
    -------
    Contents
        Contents as plain text without escapes.
    """
    commands, repeats = _repeating(run)
    return Contents(
        title=run.scenario.title,
        asked=describe_task(run.scenario),
        verdict=verdict(run.summary),
        remarks=_remarks(run),
        claims=_claims(run),
        regions=_regions(run),
        numbers=tuple(
            table
            for table in (*log_tables(run), _criteria(run), _goal(run), _effort(run), _estimates(run), _lyapunov(run))
            if table
        ),
        setting=_setting(run),
        scenario=run.scenario.toml(),
        repeat=commands,
        repeats=repeats,
        files=_files(run),
    )


def _remarks(run: Run) -> tuple[str, ...]:
    names = [f"position.{axis}" for axis in "xyz"]
    names += ["goal.clearance"] if run.scenario.has_goal else []
    names += [f"{secondary.region.name}.clearance" for secondary in run.scenario.regions]
    count, first = 0, math.inf
    for block in run.record.blocks(["time", *names]):
        missing = np.logical_or.reduce([~np.isfinite(block[name]) for name in names])
        if missing.any():
            count, first = count + int(np.count_nonzero(missing)), min(first, block["time"][np.argmax(missing)])
    if not count:
        return log_remarks(run)
    many = f"{count} of {len(run.record)} rows of the record hold places or clearances that are no numbers"
    return (f"{many}; the first is at {first:g} s. Figures have gaps there.", *log_remarks(run))


def _claims(run: Run) -> Table | None:
    if run.scenario.compare != "paper":
        return None
    rows = tuple((c.stated, c.measured, c.why) for c in paper_claims(run.scenario, run.summary))
    return Table("Beside the paper", ("The paper states", "This run gave", "Why"), rows, (1.0, 1.1, 1.4))


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
        violation, least = violations[region.name], run.summary["min_clearance"][region.name]
        when = f"{violation.worst_at:.2f}" if math.isfinite(least) else "–"
        degrees = run.summary["clearance_unit"][region.name] == "rad"
        shown = f"{format_number(math.degrees(least), 4)}°" if degrees else f"{format_number(least, 4)} m"
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
    return Table("Regions", head, tuple(rows), (1.6, 1.1, 1.0, 0.8, 0.8, 1.1, 0.8, 0.9))


class _Violation:
    """Finds the time of a region's least clearance and the duration of its violations, block by block."""

    def __init__(self) -> None:
        self._least, self.worst_at = math.inf, math.nan  # m or rad, s
        self._spans, self._ended = Spans(), 0.0

    def add(self, time: Array, clearance: Array) -> None:
        """Add the next rows."""
        known = np.where(np.isnan(clearance), np.inf, clearance)
        i = int(np.argmin(known))
        if known[i] < self._least:
            self._least, self.worst_at = float(known[i]), float(time[i])
        self._ended += sum(span.end - span.start for span in self._spans.add(clearance < 0.0, time))

    def duration(self) -> float | None:
        """Return the total duration of violations of the region [s], None if there were none."""
        last = self._spans.open
        return self._ended + (last.end - last.start if last else 0.0) if self._least < 0.0 else None


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
        lasting = sum(stop - start for start, stop, _ in spans)
        row = (f"{i + 1} {criterion.name}", why, f"{lasting:.2f}" if spans else "never", f"{shown}{more}" or "–")
        rows.append((*row, *([costs.get(criterion.name, "–")] if costs else [])))
    head = ["By priority", "Asks", "Led for [s]", "From and to [s]"]
    widths = [0.9, 1.6, 0.7, 2.2]
    if costs:  # of a metre of path half a metre deep in its soft regions: they decide which way round the path goes
        head, widths = [*head, "Path's cost of a metre [m]"], [*widths, 0.8]
    return Table("Criteria", tuple(head), tuple(rows), tuple(widths))


def _goal(run: Run) -> Table:
    s = run.summary
    outside = s["closest_to_goal"]
    nearest = f"{format_number(outside, 4)} m outside" if outside > 0.0 else f"{format_number(-outside, 4)} m inside"
    windows = ", ".join(f"{start:.3f} to {end:.3f}" for start, end in s["intersection_windows"])
    rows = [
        ("first within the goal [s]", format_number(s["reach_time"], 5) if s["reached"] else "never"),
        ("within it for good from [s]", format_number(s["settle_time"], 5) if s["settled"] else "never"),
        ("deepest in the goal, or nearest to its surface", nearest if math.isfinite(outside) else "no number"),
    ]
    rows = [
        *(rows if run.scenario.has_goal else []),
        ("position at the end: north, east, down [m]", ", ".join(format_number(x, 4) for x in s["final_position"])),
        ("greatest speed through the ground [m/s]", format_number(s["max_speed"], 4)),
    ]
    if s["intersection"]:
        rows.append(("within the overlap of regions [s]", windows or "never"))
    return Table("Goal and way" if run.scenario.has_goal else "Way", (), tuple(rows), (1.0, 1.0))


def _effort(run: Run) -> Table:
    s = run.summary
    if run.scenario.log:
        return effort_of_log(s)
    factor = s["real_time_factor"]
    rows = (
        ("greatest force that the law asked for, norm [N]", format_number(s["max_force_asked"], 4)),
        ("greatest force that acted, norm [N]", format_number(s["max_force"], 4)),
        ("effort: time integral of the acting force's norm [N s]", format_number(s["effort"], 4)),
        ("actuators asked for more than they give, for [s]", format_number(s["saturated_time"], 4)),
        ("thrusters that the law isolated", format_isolations(s) or "none"),
        ("position and velocity samples that the law rejected [%]", _percent(s["rejected_samples"])),
        ("weights above ½ at once, at the most [–]", str(s["weights_above_half"])),
        ("sum of the weights, at the most [–]", format_number(s["weights_sum_max"], 4)),
        ("how the run ended", s["status"]),
        ("simulated time [s]", f"{format_number(s['simulated_time'], 6)} in {s['steps']} steps"),
        (
            "stepping took [s]",
            "not known" if s["wall_time"] is None
            else format_number(s["wall_time"], 3)
            + (f", {format_number(factor, 3)} times as fast as the clock" if factor else ""),
        ),
    )  # fmt: skip
    return Table("Effort and course", (), rows, (1.0, 1.0))


def _percent(fraction: float | None) -> str:
    return "not reported" if fraction is None else format_number(100.0 * fraction, 3)


def _estimates(run: Run) -> Table | None:
    if run.scenario.log:
        return None
    s = run.summary
    names = (
        "weight less buoyancy, W − B [N]",
        "x_G W − x_B B [N m]",
        "y_G W − y_B B [N m]",
        "z_G W − z_B B [N m]",
    )
    columns = (s[f"estimate_{which}"] for which in ("final", "true", "lowest", "highest"))
    rows = tuple(
        (name, *(format_number(value, 4) for value in values)) for name, *values in zip(names, *columns, strict=True)
    )
    return Table("Estimates", ("Restoring parameter, body frame", "at the end", "true", "lowest", "highest"), rows,
                 (2.0, 1.0, 1.0, 1.0, 1.0))  # fmt: skip


def _lyapunov(run: Run) -> Table | None:
    if not run.summary["lyapunov"]:
        return None
    rows = tuple(
        (
            form,
            *(format_number(form_summary[which], 4) for which in ("start", "end", "least")),
            str(form_summary["increases"]),
            *(
                "never" if form_summary[which] is None else format_number(form_summary[which], 5)
                for which in ("first_rise", "first_negative")
            ),
        )
        for form, form_summary in run.summary["lyapunov"].items()
    )
    head = (
        "Form", "at the start [N m]", "at the end [N m]", "least [N m]", "steps in which it rose", "first [s]",
        "first below 0 [s]",
    )  # fmt: skip
    return Table("V of (31)", head, rows, (1.1, 1.0, 1.0, 1.0, 1.0, 0.8, 1.0))


def _setting(run: Run) -> Table:
    s = run.scenario
    if s.log:
        return setting_of_log(run)
    through = "the thrusters" if s.actuation.through == "thrusters" else "the body directly, as a wrench"
    rows = [
        ("vehicle", f"{s.vehicle.title}. {s.vehicle.source}".strip()),
        ("law, and what it acts through", f"{s.law.name}; {through}"),
        ("arbiter", f"{s.arbiter.engine}; {_weighed(s)}"),
        ("planned for [s], in steps of [s]", f"{s.time.duration:g}, {s.time.step:g}"),
        ("start: north, east, down [m]", ", ".join(format_number(x, 6) for x in s.initial.position)),
        ("current: north, east, down [m/s]", ", ".join(format_number(x, 6) for x in s.plant.current)),
        ("state for the law", _state_for_law(s.sensing)),
    ]
    if math.isfinite(s.limit.force) or s.limit.time_constant > 0.0:
        rows.append(("limit on the force [N], lag [s]", f"{s.limit.force:g}, {s.limit.time_constant:g}"))
    if s.failures:
        rows.append(
            ("failures", f"{len(s.failures)}, {'reported' if s.report_failures else 'not reported'} to the law")
        )
    if s.outages:
        rows.append(
            ("outages of sensors", ", ".join(f"{o.sensor} {o.time:g} to {o.time + o.duration:g} s" for o in s.outages))
        )
    if s.commands.enabled:
        rows.append(("commands", f"could be given while it ran; {run.summary.get('commands', 0)} were"))
    return Table("Scenario", (), tuple(rows), (1.0, 2.4))


def _weighed(scenario: Scenario) -> str:
    """Describe the rules that weigh the criteria."""
    if scenario.arbiter.file:
        inputs = ", ".join(f"{signal.name} ({signal.what})" for signal in scenario.rules.inputs)
        return f"the rules of {scenario.arbiter.file}, of {inputs}"
    if scenario.arbiter.rules != "ordered":
        return f"{', '.join(scenario.criterion_names)}: {scenario.arbiter.rules}"
    ramp = f"memberships fall to 0 over {scenario.arbiter.ramp:g} m (rad for attitude)"
    return ramp if scenario.has_paper_criteria else f"{', '.join(scenario.criterion_names)}, in this order"


def _state_for_law(sensing: Sensing) -> str:
    if sensing.through == "sensors":
        return "estimate of the navigation filter from the sensors"
    return "the true state" if sensing.exact else "position and velocity with noise or gaps"


def _repeating(run: Run) -> tuple[tuple[str, ...], str]:
    """Return the commands that repeat a run, and their description."""
    again = ("cosim report . --format html,png", "cosim replay .")
    if run.scenario.log:
        return again, f"The run is imported from {run.scenario.log}: it cannot be repeated, but be shown again."
    if run.scenario.law.own:
        whose = f"The law that flew this run, {run.scenario.law.name}, is its user's own and in no file here"
        return again, f"{whose}: the run is repeated from where the law is, and can be shown again from here."
    if run.scenario.law.name not in LAWS:
        return again, "An autopilot outside flew this run: it cannot be repeated from here, but be shown again."
    commands = f" --replay-commands {COMMANDS_LOG}" if (run.folder / COMMANDS_LOG).exists() else ""
    command = f"cosim run {SCENARIO}{commands} --out again"
    cut = run.summary["status"] != "completed"
    how = (
        "In this folder. The first repeats the run to the last bit on a machine of this kind with this version"
        + (", and goes on to where it was meant to end" if cut else "")
        + "; the others write report and replay from its record."
    )
    return (command, *again), how


def _files(run: Run) -> tuple[tuple[str, str], ...]:
    record = RECORD if (run.folder / RECORD).exists() else PARTS
    files = [
        (record, "every signal of every step, with its unit"),
        (SUMMARY, "these numbers, in SI units"),
        (SCENARIO, "all that the run depends on"),
    ]
    if (run.folder / COMMANDS_LOG).exists():
        files.append((COMMANDS_LOG, "what was commanded, and when"))
    if (run.folder / IMPORT).exists():
        files.append((IMPORT, "where each signal is from, its rate and its gaps, and what was not read"))
    return tuple(files)
