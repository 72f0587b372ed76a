"""A check as text for a person, and as JSON for a program."""

from __future__ import annotations

import json
import math
import textwrap
from typing import Any

from cosim.precheck.precheck import Check

_TOPICS = {
    "vehicle": "Vehicle",
    "law": "Law",
    "regions": "Regions",
    "thrust": "Thrusters",
}
_WIDTH = 110


def check_text(check: Check) -> str:
    """Format a check as text: findings by topic, then the verdict."""
    lines = [f"{check.title} ({check.scenario}; {check.vehicle}, {check.law} law)"]
    for topic, heading in _TOPICS.items():
        lines += ["", heading]
        for finding in check.findings:
            if finding.topic == topic:
                lead = f"  {finding.status:5}  {finding.name}: "
                lines += textwrap.wrap(finding.text, _WIDTH, initial_indent=lead, subsequent_indent=" " * 9)
    lines += ["", *_verdict(check)]
    return "\n".join(lines)


def _verdict(check: Check) -> list[str]:
    if check.holds:
        return ["Verdict: nothing stands against this scenario."]
    lines = [f"Verdict: {len(check.failed)} of {len(check.findings)} fail. What to change:"]
    for finding in check.failed:
        lead = f"  - {finding.name}: "
        lines += textwrap.wrap(finding.advice, _WIDTH, initial_indent=lead, subsequent_indent="    ")
    return lines


def check_json(check: Check) -> str:
    """Format a check as JSON, with null for NaN and infinity."""
    findings = [
        {
            "topic": finding.topic,
            "name": finding.name,
            "status": finding.status,
            "text": finding.text,
            "advice": finding.advice,
            "numbers": {key: _finite(value) for key, value in finding.numbers.items()},
        }
        for finding in check.findings
    ]
    head = {"scenario": check.scenario, "title": check.title, "vehicle": check.vehicle, "law": check.law}
    return json.dumps(head | {"holds": check.holds, "findings": findings}, indent=2)


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
