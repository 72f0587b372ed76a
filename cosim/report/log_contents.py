"""Contents of a report on a run that was imported from a log: sources of its signals, and gaps."""

from __future__ import annotations

from dataclasses import dataclass

from cosim.report.table import Table
from cosim.results.log_facts import IMPORT, LogFacts, TopicFacts, load_log_facts
from cosim.results.run_result import Run
from cosim.results.wording import format_number

_NAMED = 12  # maximum number of unused kinds of messages, and of gaps, that a table lists


@dataclass(frozen=True)
class LogContents:
    """What a report says about an imported run."""

    topics: Table
    gaps: Table | None
    commands: str
    unread: str


def log_facts(run: Run) -> LogFacts | None:
    """Load the facts about an imported run; None for other runs."""
    return load_log_facts(run.folder) if run.scenario.log and (run.folder / IMPORT).exists() else None


def log_contents(run: Run) -> LogContents | None:
    """Make the contents about the sources and the gaps of an imported run; None for other runs."""
    facts = log_facts(run)
    if facts is None:
        return None
    rows = tuple(
        (
            t.quantity, t.source, str(t.samples), format_number(t.rate, 3), str(t.gaps),
            format_number(max((end - begin for begin, end in t.longest_gaps), default=0.0), 3), _repairs(t),
        )
        for t in facts.topics
    )  # fmt: skip
    topics = Table("Log", ("Quantity", "From", "Samples", "Rate [Hz]", "Gaps", "Longest [s]", "Mended"), rows)
    gaps = sorted((begin, end, t.quantity) for t in facts.topics for begin, end in t.longest_gaps)
    listed = [(quantity, f"{begin:.2f} to {end:.2f}") for begin, end, quantity in gaps[:_NAMED]]
    listed += [("and more", str(len(gaps) - _NAMED))] if len(gaps) > _NAMED else []
    more = f" and {len(facts.unread) - _NAMED} more kinds" if len(facts.unread) > _NAMED else ""
    return LogContents(
        topics=topics,
        gaps=Table("Gaps of the log", ("Quantity", "From and to [s]"), tuple(listed)) if gaps else None,
        commands=facts.commands or "none",
        unread=f"{', '.join(list(facts.unread)[:_NAMED])}{more}" or "nothing",
    )


def _repairs(topic: TopicFacts) -> str:
    """Describe the repairs of the samples of a topic."""
    words = (
        (topic.held, "repeats of held values left out"),
        (topic.bursts, "samples of bursts spread"),
        (topic.late, "out of order left out"),
        (topic.broken, "without a number left out"),
    )
    return "; ".join(f"{count} {text}" for count, text in words if count) or "–"
