"""Checks of an FMU of the user's without running it: its map, units and directions, and its step."""

from __future__ import annotations

from collections.abc import Iterator

from cosim.errors import ScenarioError
from cosim.precheck.finding import Finding, status
from cosim.scenario.scenario import Scenario
from cosim.scenario.tables import UserFmu
from cosim.simulation.columns import columns_without_plant
from cosim.simulation.fmu_map import connect, law_targets, read_fmu_of, signal_units
from cosim.simulation.signals import Signals
from plant_fmu.checking.fmu_file import FmuFile

_ROUNDING = 1e-6  # tolerance of a period, as a fraction of a step


def fmu_findings(scenario: Scenario, fmu: UserFmu) -> Iterator[Finding]:
    """Yield the findings on the FMU that is the law."""
    try:
        file = read_fmu_of(fmu)
        targets, output = law_targets(fmu, file, scenario)
        connected = connect(fmu, file, signal_units(scenario, Signals(columns_without_plant(scenario))))
    except ScenarioError as error:
        yield Finding("law", "FMU", "fails", str(error), "correct the map, or the FMU")
        return
    inputs = [v.name for v in file.model.values() if v.causality == "input"]
    free = [name for name in inputs if name not in connected]
    text = f"{file.path.name} sets the {output} by {len(targets)} outputs, from {len(connected)} inputs"
    yield Finding("law", "FMU", "holds", f"{text}; units and directions fit.")
    if free:
        yield Finding("law", "inputs", "note", f"{', '.join(free)}: not connected, and keep their start values.")
    yield _step_finding(file, scenario.time.control)


def _step_finding(file: FmuFile, period: float) -> Finding:
    """Compare the law's period [s] with the steps that the FMU declares."""
    attributes, varies = file.interfaces["CS"], file.offers("CS", "canHandleVariableCommunicationStepSize")
    key = "fixedInternalStepSize" if attributes.get("fixedInternalStepSize") else "DefaultExperiment.stepSize"
    step = float(attributes.get("fixedInternalStepSize", 0.0)) or (0.0 if varies else file.default_step)
    how = "varying" if varies else "equal"
    if not step:
        return Finding(
            "law", "step", "holds", f"time.control is {period:g} s; the FMU takes {how} steps of any length."
        )
    fits = period > 0.5 * step and abs(period - round(period / step) * step) <= _ROUNDING * step
    text = f"time.control is {period:g} s, {key} of the FMU {step:g} s, and its steps are {how}."
    advice = "" if fits else f"set time.control to a multiple of {step:g} s"
    return Finding("law", "step", status(fits), text, advice)
