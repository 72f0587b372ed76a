"""A check as text for a person, and as JSON for a program."""

from __future__ import annotations

import dataclasses
import textwrap

from cosim.io.strict_json import json_text
from cosim.precheck.precheck import Check

_TOPICS = {"vehicle": "Vehicle", "law": "Law", "regions": "Regions", "thrust": "Thrusters", "components": "FMUs"}
_WIDTH = 110


def check_text(check: Check) -> str:
    """Format a check as text: findings by topic, then the verdict."""
    lines = [f"{check.title} ({check.scenario}; {check.vehicle}, {check.law} law)"]
    for topic, heading in _TOPICS.items():
        findings = [finding for finding in check.findings if finding.topic == topic]
        lines += ["", heading] if findings else []
        for finding in findings:
            lines += _wrapped(f"  {finding.status:5}  {finding.name}: ", finding.text, 9)
    if check.holds:
        return "\n".join([*lines, "", "Verdict: nothing is wrong with this scenario."])
    lines += ["", f"Verdict: {len(check.failed)} of {len(check.findings)} fail. What to change:"]
    for finding in check.failed:
        lines += _wrapped(f"  - {finding.name}: ", finding.advice, 4)
    return "\n".join(lines)


def _wrapped(lead: str, text: str, indent: int) -> list[str]:
    return textwrap.wrap(text, _WIDTH, initial_indent=lead, subsequent_indent=" " * indent)


def check_json(check: Check) -> str:
    """Format a check as JSON, with null for NaN and infinity."""
    return json_text({**dataclasses.asdict(check), "holds": check.holds})
