"""Known differences of autopilots from what the checks expect: they are reported, but are not failures."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from cosim.mavlink.conformance.outcome import Outcome, Subject


@dataclass(frozen=True)
class Baseline:
    """An autopilot, and the checks that it is known to fail."""

    name: str
    differences: Mapping[str, str]  # reasons, by the name of the check

    def apply(self, check: str, outcome: Outcome) -> Outcome:
        """Replace a failure that this autopilot is known for by ``differs`` with the reason; return other outcomes."""
        reason = self.differences.get(check)
        if reason is None or outcome.status != "fail":
            return outcome
        return dataclasses.replace(outcome, status="differs", expected=f"{outcome.expected}; {self.name}: {reason}")


ARDUSUB = Baseline(
    "ArduSub",
    {
        "available-modes": "two of its modes share a number, CIRCLE and SURFACE",
        "stream-rates": "it streams what its parameters or a ground station ask for, and little else",
        "home-position": "it sends HOME_POSITION once that is set, and when it is asked",
        "parameter-unknown": "it is silent about a parameter that it lacks, and knows no PARAM_ERROR",
    },
)
NONE = Baseline("no known autopilot", {})  # for our vehicle, and for PX4, of which none was checked so far
_OWN = b"subreach"  # custom version of our simulated vehicle, also when it imitates an ArduSub


def baseline_of(subject: Subject) -> Baseline:
    """Return the baseline of the vehicle that is checked, by its heartbeat and its AUTOPILOT_VERSION."""
    m, vehicle = subject.mavlink, subject.client.vehicle
    if vehicle is None or vehicle[2:] != (m.MAV_AUTOPILOT_ARDUPILOTMEGA, m.MAV_TYPE_SUBMARINE):
        return NONE
    version = subject.client.request(m.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    ours = version is not None and bytes(version.flight_custom_version).startswith(_OWN)
    return NONE if ours else ARDUSUB
