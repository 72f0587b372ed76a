"""The map between the variables of an FMU of the user's and the signals of a run."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping

from controller.law import Output
from cosim.errors import ScenarioError
from cosim.scenario.scenario import Scenario
from cosim.scenario.tables import UserFmu
from cosim.simulation.signals import Signals
from plant_fmu.checking.fmu_file import NATIVE, FmuFile, read_fmu
from plant_fmu.errors import PlantFmuError
from plant_fmu.model_variables import ModelVariable
from plant_fmu.quantities import UNITS, base_unit
from plant_fmu.toml_tables import hint

_MOTION = {
    **{f"position.{axis}": "m" for axis in "xyz"},
    **{f"quaternion.e{i}": "" for i in range(4)},
    **{f"velocity.{axis}": "m/s" if axis in "uvw" else "rad/s" for axis in "uvwpqr"},
}
_WRENCH = {f"wrench.{axis}": "N" if axis in "XYZ" else "N.m" for axis in "XYZKMN"}
_ESTIMATE = {f"estimate.phi{i + 1}": "N.m" if i else "N" for i in range(4)}
_THRUSTER = re.compile(r"thruster\[(\d+)\]")


def read_fmu_of(fmu: UserFmu) -> FmuFile:
    """Read the model description of an FMU, without running it."""
    try:
        file = read_fmu(fmu.file)
    except PlantFmuError as error:
        raise ScenarioError(f"{fmu.key}.file: {error}") from error
    if "CS" not in file.libraries:
        reason = "has no binary for this machine" if "CS" in file.interfaces else "offers no co-simulation"
        raise ScenarioError(f"{fmu.key}.file: {file.path.name} {reason} ({NATIVE[-1]}), expected a co-simulation FMU")
    return file


def signal_units(scenario: Scenario, signals: Signals) -> dict[str, str | None]:
    """Return the unit of each signal that an FMU can receive, in the order of `FmuCalls.signals`; None: any unit."""
    regions = {"goal": scenario.goal, **{r.region.name: r.region.shape for r in scenario.regions}}
    own: dict[str, str | None] = {
        **_MOTION,
        **{f"weight.{name}": "" for name in list(regions)[1:]},
        **{f"{name}.value": shape.unit for name, shape in regions.items()},
        **{f"{name}.clearance": None for name in regions},
        **{f"{name}.gradient.{axis}": None for name in regions for axis in "xyz"},
    }
    units = dict(own)
    # a signal of the row with the name of one that the law receives has another one, which no FMU asks for
    for column in signals.columns:
        name = column.name
        units[f"row {name}" if name in own else name] = column.unit
    return units


def connect(fmu: UserFmu, file: FmuFile, units: Mapping[str, str | None]) -> dict[str, str]:
    """Return the signal of each input that is connected: by the map, else by its own name, or that in a terminal."""
    for name, signal in fmu.inputs.items():
        key = f"{fmu.key}.inputs.{name}"
        variable = _variable(fmu, file, key, name, "input")
        if signal not in units:
            raise ScenarioError(f"{key} is {signal!r}, which is no signal; {hint(signal, _public(units))}")
        require_unit(key, file, variable, units[signal])
    connected = dict(fmu.inputs)
    for variable, names in _unmapped(file, "input", fmu.inputs):
        signal = next((name for name in names if name in units), "")
        if signal:
            require_unit(f"{fmu.key}.inputs.{variable.name}", file, variable, units[signal])
            connected[variable.name] = signal
    return connected


def law_targets(fmu: UserFmu, file: FmuFile, scenario: Scenario) -> tuple[dict[str, int], Output]:
    """Return what each connected output of a law sets, as in `FmuCalls.targets`, and the kind of its forces."""
    thrust = {f"thrust[{i + 1}]": "N" for i in range(scenario.vehicle.n_thrusters)}
    known = _WRENCH | thrust | _ESTIMATE
    targets: dict[str, str] = {}
    for name, target in fmu.outputs.items():
        key = f"{fmu.key}.outputs.{name}"
        variable = _variable(fmu, file, key, name, "output")
        if target not in known:
            raise ScenarioError(f"{key} is {target!r}, which no law sets; {hint(target, known)}")
        if target in targets.values():
            raise ScenarioError(f"{key} is {target!r}, which another output sets")
        require_unit(key, file, variable, known[target])
        targets[name] = target
    for variable, names in _unmapped(file, "output", fmu.outputs):
        target = next((name for name in names if name in known and name not in targets.values()), "")
        if target:
            require_unit(f"{fmu.key}.outputs.{variable.name}", file, variable, known[target])
            targets[variable.name] = target
    of_thrusters, of_wrench = (any(t in names for t in targets.values()) for names in (thrust, _WRENCH))
    if of_thrusters == of_wrench:
        received = "set both wrench and thrust" if of_thrusters else "set no force"
        expected = f"wrench.X to wrench.N, or thrust[1] to thrust[{len(thrust)}]"
        raise ScenarioError(f"{fmu.key}.outputs: outputs of {file.path.name} {received}, expected {expected}")
    if of_thrusters and scenario.actuation.through != "thrusters":
        received = repr(scenario.actuation.through)
        raise ScenarioError(f"actuation.through is {received}, expected 'thrusters': {file.path.name} drives them")
    places = {name: i for i, name in enumerate((*(thrust if of_thrusters else _WRENCH), *_ESTIMATE))}
    return {name: places[target] for name, target in targets.items()}, "thrusters" if of_thrusters else "wrench"


def _public(units: Mapping[str, str | None]) -> list[str]:
    return [name for name in units if not name.startswith("row ")]


def _variable(fmu: UserFmu, file: FmuFile, key: str, name: str, causality: str) -> ModelVariable:
    """Return a variable that a map names."""
    known = [v.name for v in file.model.values() if v.is_real and v.causality == causality]
    variable = file.model.get(name)
    if variable is None:
        raise ScenarioError(f"{key}: {file.path.name} has no variable of this name; {hint(name, known)}")
    if variable.causality != causality:
        raise ScenarioError(
            f"{key}: {name} of {file.path.name} is of causality {variable.causality}, expected {causality}"
        )
    if not variable.is_real:
        kind = "an array" if variable.shape else f"of type {variable.type}"
        raise ScenarioError(f"{key}: {name} of {file.path.name} is {kind}, expected a real scalar")
    return variable


def _unmapped(file: FmuFile, causality: str, mapped: Mapping[str, str]) -> Iterator[tuple[ModelVariable, list[str]]]:
    """Yield the other real scalars of a causality, each with its name and those of its terminals."""
    for variable in file.model.values():
        if variable.is_real and variable.causality == causality and variable.name not in mapped:
            paths = file.terminals.get(variable.name, ())
            yield variable, [variable.name, *(_signal_of(*path) for path in paths)]


def _signal_of(*parts: str) -> str:
    """Return the signal that is the member of a terminal, as the terminals of the plant's FMU have it."""
    *above, member = parts
    thruster = _THRUSTER.fullmatch(above[-1]) if above else None
    if thruster and member == "command":
        return f"thrust[{thruster[1]}]"
    return ".".join((*(part for part in above if part != "pose"), member))


def require_unit(key: str, file: FmuFile, variable: ModelVariable, expected: str | None) -> None:
    """Raise an error for a variable whose unit is another one."""
    if expected is None or not variable.unit or _is_unit(file.units.get(variable.unit, {}), variable.unit, expected):
        return
    raise ScenarioError(
        f"{key}: {variable.name} of {file.path.name} is in {variable.unit!r}, expected {expected or '1'!r}"
    )


def _is_unit(definition: Mapping[str, str], unit: str, expected: str) -> bool:
    """Return True if a unit of a model description is an expected one, by name or by its base units."""
    if unit.replace("*", ".").replace(" ", ".") == expected or (expected not in UNITS and expected):
        return True
    if not definition:
        return (unit, expected) in (("Nm", "N.m"), ("1", ""), ("-", ""))
    wanted = base_unit(expected) if expected else {}
    factors = [float(base.get("factor", 1.0)) for base in (definition, wanted)]
    powers = [
        {key: int(base[key]) for key in base if key not in ("factor", "offset", "rad") and int(base[key])}
        for base in (definition, wanted)
    ]
    return powers[0] == powers[1] and math.isclose(*factors, rel_tol=1e-9) and not float(definition.get("offset", 0.0))
