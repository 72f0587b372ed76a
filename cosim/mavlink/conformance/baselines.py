"""Where an autopilot differs from what the checks expect, and rightly so: that is said, and is no failure."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from cosim.mavlink.conformance.outcome import Outcome, Subject


@dataclass(frozen=True)
class Baseline:
    """An autopilot, and why it fails which checks."""

    name: str
    differences: Mapping[str, str]  # why, by the name of a check

    def judge(self, check: str, outcome: Outcome) -> Outcome:
        """Return an outcome, or where this autopilot is known to fail the check that it differs, and why."""
        why = self.differences.get(check)
        if why is None or outcome.status != "fail":
            return outcome
        return dataclasses.replace(outcome, status="differs", expected=f"{outcome.expected}; {self.name}: {why}")


ARDUSUB = Baseline(
    "ArduSub",
    {
        "available-modes": "two of its modes share a number, CIRCLE and SURFACE",
        "stream-rates": "it streams what its parameters or a ground station ask for, and little else",
        "home-position": "it sends HOME_POSITION once that is set, and when it is asked",
        "parameter-unknown": "it is silent about a parameter that it lacks, and knows no PARAM_ERROR",
    },
)
NONE = Baseline("no known autopilot", {})  # ours, and PX4: of which none was checked so far
_OWN = b"subreach"  # custom version of our simulated vehicle, which shows itself as an ArduSub, too


def baseline_of(subject: Subject) -> Baseline:
    """Return the baseline of the vehicle that is checked, by its heartbeat and its AUTOPILOT_VERSION."""
    m, vehicle = subject.mavlink, subject.client.vehicle
    if vehicle is None or vehicle[2:] != (m.MAV_AUTOPILOT_ARDUPILOTMEGA, m.MAV_TYPE_SUBMARINE):
        return NONE
    version = subject.client.request(m.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    ours = version is not None and bytes(version.flight_custom_version).startswith(_OWN)
    return NONE if ours else ARDUSUB
