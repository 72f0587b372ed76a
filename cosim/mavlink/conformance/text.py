"""Format results of checks as text, and as JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import msgspec

from cosim.mavlink.conformance.checking import Result
from cosim.mavlink.listening.watch import printable


def as_text(result: Result) -> str:
    """Format a result as one line."""
    check, outcome = result.check, result.outcome
    expected = f"; expected {outcome.expected}" if outcome.expected else ""
    clients = ", ".join(check.clients)
    return f"{outcome.status.upper()} {check.name:<22} {printable(outcome.received)}{expected} [{clients}]"


def summary(results: Sequence[Result]) -> str:
    """Format the numbers of passed, failed and skipped `results`, and their time."""
    counts = Counter(result.outcome.status for result in results)
    took = sum(result.seconds for result in results)
    differ = f"{counts['differs']} differ as known, " if counts["differs"] else ""
    return f"{counts['pass']} passed, {counts['fail']} failed, {differ}{counts['skip']} skipped, {took:.1f} s"


def as_json(name: str, results: Sequence[Result]) -> str:
    """Format all results as JSON.

    Parameters
    ----------
    name : str
        Name of the link.
    results : sequence of Result
        Results in the order of the checks.

    Returns
    -------
    str
        An object with the endpoint, ``passed`` (true if nothing failed), and a list of checks.
    """
    checks = [
        {
            "name": result.check.name,
            "clients": list(result.check.clients),
            "status": result.outcome.status,
            "received": printable(result.outcome.received),
            "expected": result.outcome.expected,
            "seconds": round(result.seconds, 3),
        }
        for result in results
    ]
    passed = all(result.outcome.status != "fail" for result in results)
    document = {"endpoint": name, "passed": passed, "checks": checks}
    return msgspec.json.format(msgspec.json.encode(document), indent=2).decode()
