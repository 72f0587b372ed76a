"""Checks of a scenario without running it: vehicle, gains, regions, thrusters."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cosim.precheck.angles import angle_findings
from cosim.precheck.feasibility import region_findings
from cosim.precheck.finding import Finding
from cosim.precheck.own_fmu import component_findings, law_fmu_findings
from cosim.precheck.stability import gain_findings, start_weights, vehicle_findings
from cosim.precheck.thrust import initial_force_finding, thrust_findings
from cosim.scenario.law_factory import FIND_GAINS, foreign_gains
from cosim.scenario.scenario import Scenario, to_scenario


@dataclass(frozen=True)
class Check:
    """All findings of a scenario.

    Examples
    --------
    >>> import cosim
    >>> check = cosim.check_scenario(cosim.load_scenario("docking"))
    >>> check.holds
    True
    >>> [finding.name for finding in check.findings][:2]
    ['goal and regions', 'overlaps']
    """

    scenario: str
    title: str
    law: str
    vehicle: str
    findings: tuple[Finding, ...]

    @property
    def holds(self) -> bool:
        """Whether nothing fails."""
        return not self.failed

    @property
    def failed(self) -> tuple[Finding, ...]:
        """The findings that fail."""
        return tuple(finding for finding in self.findings if finding.status == "fails")


def check_scenario(scenario: Scenario | str | Path) -> Check:
    """Check a scenario without running it.

    Parameters
    ----------
    scenario : Scenario, str or Path
        Scenario with any law, or its name or file; the paper's conditions are checked for its law only.

    Returns
    -------
    Check
        Findings on the true vehicle, and on the regions at time 0.

    Raises
    ------
    DefinitionError
        If the arbiter cannot be set up.

    Examples
    --------
    >>> import cosim
    >>> check = cosim.check_scenario(cosim.load_scenario("paper-limited"))
    >>> for finding in check.failed[:1]:
    ...     print(finding.name)
    (38) 1, 2
    """
    scenario = to_scenario(scenario)
    is_papers = scenario.law.name == "ismail_dunnigan"
    findings = [finding for finding in vehicle_findings(scenario) if is_papers or finding.status == "fails"]
    findings += [*angle_findings(scenario), *region_findings(scenario), *thrust_findings(scenario)]
    if is_papers:
        weights = start_weights(scenario)
        findings += [*gain_findings(scenario, weights), initial_force_finding(scenario, weights)]
    elif scenario.law.fmu:
        findings += law_fmu_findings(scenario, scenario.law.fmu)
    elif text := foreign_gains(scenario):
        findings.append(Finding("law", "gains", "fails", f"The {text}.", f"{FIND_GAINS.capitalize()}."))
    findings += component_findings(scenario)
    return Check(scenario.name, scenario.title, scenario.law.name, scenario.vehicle.name, tuple(findings))
