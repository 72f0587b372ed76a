"""Contents of a report on a run that was imported from a log: sources of its signals, and gaps."""

from __future__ import annotations

from typing import Any

from cosim.report.table import Table
from cosim.results.log_facts import IMPORT, LogFacts, TopicFacts, load_log_facts
from cosim.results.run_result import Run
from cosim.results.wording import format_number

_NAMED = 12  # greatest number of unused kinds of messages, and of gaps, that a table lists


def log_remarks(run: Run) -> tuple[str, ...]:
    """Return remarks on the reliability of an imported run; none for other runs."""
    facts = _facts(run)
    return facts.remarks if facts else ()


def log_tables(run: Run) -> tuple[Table, ...]:
    """Return tables of the sources and the gaps of an imported run's signals; none for other runs."""
    facts = _facts(run)
    if facts is None:
        return ()
    rows = tuple(
        (
            t.quantity, t.source, str(t.samples), format_number(t.rate, 3), str(t.gaps),
            format_number(max((end - begin for begin, end in t.longest_gaps), default=0.0), 3), _repairs(t),
        )
        for t in facts.topics
    )  # fmt: skip
    head = ("Quantity", "From", "Samples", "Rate [Hz]", "Gaps", "Longest [s]", "Mended")
    tables = [Table("Log", head, rows, (1.0, 1.4, 0.7, 0.7, 0.5, 0.7, 1.4))]
    gaps = sorted((begin, end, t.quantity) for t in facts.topics for begin, end in t.longest_gaps)
    if gaps:
        shown = tuple((quantity, f"{begin:.2f} to {end:.2f}") for begin, end, quantity in gaps[:_NAMED])
        more = (("and more", str(len(gaps) - _NAMED)),) if len(gaps) > _NAMED else ()
        tables.append(Table("Gaps of the log", ("Quantity", "From and to [s]"), (*shown, *more), (1.0, 1.0)))
    return tuple(tables)


def effort_of_log(summary: dict[str, Any]) -> Table:
    """Return a table of the forces that the commands of a log ask for."""
    rows = (
        ("greatest force that the commands ask for, norm [N]", format_number(summary["max_force_asked"], 4)),
        ("greatest force within the thrusters' limits, norm [N]", format_number(summary["max_force"], 4)),
        ("beyond the thrusters' limits for [s]", format_number(summary["saturated_time"], 4)),
        ("time of the log [s]", f"{format_number(summary['simulated_time'], 6)} in {summary['steps']} rows"),
    )
    return Table("Commands", (), rows, (1.0, 1.0))


def setting_of_log(run: Run) -> Table:
    """Return a table of log, vehicle, rates and unused messages of an imported run."""
    s, facts = run.scenario, _facts(run)
    unread = facts.unread if facts else {}
    shown = ", ".join(list(unread)[:_NAMED])
    more = f" and {len(unread) - _NAMED} more kinds" if len(unread) > _NAMED else ""
    rows = (
        ("log", f"{s.log}, flown by {'an unknown pilot' if s.law.name == 'log' else s.law.name}"),
        ("vehicle", f"{s.vehicle.title}. {s.vehicle.source}".strip()),
        ("commands", (facts.commands if facts else "") or "none"),
        ("rows a second [Hz]", f"{1.0 / s.time.step:g}"),
        ("start: north, east, down [m]", ", ".join(format_number(x, 6) for x in s.initial.position)),
        ("not read", f"{shown}{more}" or "nothing"),
    )
    return Table("Import", (), rows, (1.0, 2.4))


def _repairs(topic: TopicFacts) -> str:
    """Describe the repairs of the samples of a topic."""
    words = (
        (topic.held, "repeats of held values left out"),
        (topic.bursts, "samples of bursts spread"),
        (topic.late, "out of order left out"),
        (topic.broken, "without a number left out"),
    )
    return "; ".join(f"{count} {text}" for count, text in words if count) or "–"


def _facts(run: Run) -> LogFacts | None:
    return load_log_facts(run.folder) if run.scenario.log and (run.folder / IMPORT).exists() else None
