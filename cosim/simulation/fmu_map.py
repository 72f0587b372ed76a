"""The map between the variables of an FMU of the user's and the signals of a run."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from controller.law import Output
from cosim.errors import ScenarioError
from cosim.scenario.fmu_tables import UserFmu
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Column
from plant_fmu.checking.fmu_file import NATIVE, FmuFile, read_fmu
from plant_fmu.errors import PlantFmuError
from plant_fmu.model_variables import ModelVariable
from plant_fmu.quantities import UNITS, base_unit
from plant_fmu.toml_tables import hint
from plant_fmu.variables.former_names import present_name

Definition = Mapping[str, str]  # attributes of ``BaseUnit`` of a unit

MOTION = {
    **{f"position.{axis}": "m" for axis in "xyz"},
    **{f"quaternion.e{i}": "" for i in range(4)},
    **{f"velocity.{axis}": "m/s" if axis in "uvw" else "rad/s" for axis in "uvwpqr"},
}
_WRENCH = {f"wrench.{axis}": "N" if axis in "XYZ" else "N.m" for axis in "XYZKMN"}
_ESTIMATE = {f"estimate.phi{i + 1}": "N.m" if i else "N" for i in range(4)}
_THRUSTER = re.compile(r"thruster\[(\d+)\]")


@dataclass(frozen=True)
class Signal:
    """A signal that an FMU can receive or set."""

    index: int  # of `cosim.step.fmu_call.signal`
    unit: str | None  # None: any unit
    definition: Definition | None = None  # definition of a unit that an FMU of the user's defines

    def require(self, key: str, file: FmuFile, variable: ModelVariable) -> None:
        """Raise an error for a variable whose unit is another one than that of the signal."""
        require_unit(key, file, variable, self.unit, self.definition)


def read_fmu_of(fmu: UserFmu) -> FmuFile:
    """Read the model description of an FMU, without running it."""
    try:
        status = fmu.file.stat()
        file = _read(fmu.file, status.st_mtime_ns, status.st_size)
    except OSError as error:
        raise ScenarioError(f"{fmu.key}.file: {fmu.file}: {error.strerror or error}") from error
    except PlantFmuError as error:
        raise ScenarioError(f"{fmu.key}.file: {error}") from error
    if "CS" not in file.libraries:
        reason = "has no binary for this machine" if "CS" in file.interfaces else "offers no co-simulation"
        raise ScenarioError(f"{fmu.key}.file: {file.path.name} {reason} ({NATIVE[-1]}), expected a co-simulation FMU")
    return file


@functools.lru_cache(maxsize=16)
def _read(file: Path, modified: int, size: int) -> FmuFile:
    return read_fmu(file)


def law_signals(scenario: Scenario, columns: Sequence[Column]) -> dict[str, Signal]:
    """Return the signals that a law's FMU can receive, by name: the measured motion, and columns of the record."""
    # a column with the name of a signal that laws receive is another one, which no law gets
    own = _own_signals(scenario)
    return {name: Signal(i, column.unit) for i, (name, column) in _numbered(columns, len(own))} | own


def component_signals(scenario: Scenario, columns: Sequence[Column]) -> dict[str, Signal]:
    """Return the signals that an FMU beside the plant can receive: columns of the record, then others of laws."""
    own = _own_signals(scenario)
    return own | {name: Signal(i, column.unit) for i, (name, column) in _numbered(columns, len(own))}


def _numbered(columns: Sequence[Column], first: int) -> Iterator[tuple[int, tuple[str, Column]]]:
    return enumerate(((column.name, column) for column in columns), first)


def _own_signals(scenario: Scenario) -> dict[str, Signal]:
    """Return the signals that laws receive, in the order of `cosim.step.fmu_call.signal`."""
    regions = {"goal": scenario.goal, **{r.region.name: r.region.shape for r in scenario.regions}}
    units: dict[str, str | None] = {
        **MOTION,
        **{f"weight.{name}": "" for name in list(regions)[1:]},
        **{f"{name}.value": shape.unit for name, shape in regions.items()},
        **{f"{name}.clearance": None for name in regions},
        **{f"{name}.gradient.{axis}": None for name in regions for axis in "xyz"},
    }
    return {name: Signal(i, unit) for i, (name, unit) in enumerate(units.items())}


def connect(fmu: UserFmu, file: FmuFile, signals: Mapping[str, Signal]) -> dict[str, str]:
    """Return the signal of each input that is connected: by the map, else by its own name, or that in a terminal."""
    for name, signal in fmu.inputs.items():
        key = f"{fmu.key}.inputs.{name}"
        variable = find_variable(file, key, name, "input")
        signal = present_name(signal, signals)
        if signal not in signals:
            raise ScenarioError(f"{key} is {signal!r}, which is no signal; {hint(signal, signals)}")
        signals[signal].require(key, file, variable)
    connected = {name: present_name(signal, signals) for name, signal in fmu.inputs.items()}
    for variable, names in unmapped(file, "input", fmu.inputs):
        signal = next((name for name in _present(names, signals) if name in signals), "")
        if signal:
            signals[signal].require(f"{fmu.key}.inputs.{variable.name}", file, variable)
            connected[variable.name] = signal
    return connected


def assign(
    fmu: UserFmu, file: FmuFile, known: Mapping[str, Signal], what: str, taken: Sequence[str] = ()
) -> dict[str, str]:
    """Return what each connected output sets, of known names: by the map, else by its own name, or a terminal's."""
    targets: dict[str, str] = {}
    for name, target in fmu.outputs.items():
        key = f"{fmu.key}.outputs.{name}"
        variable = find_variable(file, key, name, "output")
        target = present_name(target, known)
        if target not in known:
            raise ScenarioError(f"{key} is {target!r}, which {what}; {hint(target, known)}")
        if target in (*targets.values(), *taken):
            raise ScenarioError(f"{key} is {target!r}, which another output sets")
        known[target].require(key, file, variable)
        targets[name] = target
    for variable, names in unmapped(file, "output", fmu.outputs):
        free = (name for name in _present(names, known) if name in known and name not in targets.values())
        target = next(free, "")
        if target in taken:
            raise ScenarioError(f"{fmu.key}.outputs.{variable.name} is {target!r}, which another output sets")
        if target:
            known[target].require(f"{fmu.key}.outputs.{variable.name}", file, variable)
            targets[variable.name] = target
    return targets


def law_targets(fmu: UserFmu, file: FmuFile, scenario: Scenario) -> tuple[dict[str, int], Output]:
    """Return what each connected output of a law sets, as in `FmuCalls.targets`, and the kind of its forces."""
    thrust = {f"thrust[{i + 1}]": "N" for i in range(scenario.vehicle.n_thrusters)}
    known = {name: Signal(-1, unit) for name, unit in (_WRENCH | thrust | _ESTIMATE).items()}
    targets = assign(fmu, file, known, "no law sets")
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


def find_variable(file: FmuFile, key: str, name: str, causality: str = "") -> ModelVariable:
    """Return a real scalar variable that a map names, of a causality if one is given."""
    known = [v.name for v in file.model.values() if v.is_real and v.causality == (causality or v.causality)]
    variable = file.model.get(present_name(name, file.model))
    if variable is None:
        raise ScenarioError(f"{key}: {file.path.name} has no variable of this name; {hint(name, known)}")
    if causality and variable.causality != causality:
        raise ScenarioError(
            f"{key}: {name} of {file.path.name} is of causality {variable.causality}, expected {causality}"
        )
    if not variable.is_real:
        kind = "an array" if variable.shape else f"of type {variable.type}"
        raise ScenarioError(f"{key}: {name} of {file.path.name} is {kind}, expected a real scalar")
    return variable


def unmapped(file: FmuFile, causality: str, mapped: Mapping[str, str]) -> Iterator[tuple[ModelVariable, list[str]]]:
    """Yield the other real scalars of a causality, each with its name and those of its terminals."""
    for variable in file.model.values():
        if variable.is_real and variable.causality == causality and variable.name not in mapped:
            paths = file.terminals.get(variable.name, ())
            yield variable, [variable.name, *(_signal_of(*path) for path in paths)]


def _present(names: Sequence[str], known: Mapping[str, Signal]) -> list[str]:
    return [present_name(name, known) for name in names]


def _signal_of(*parts: str) -> str:
    """Return the signal that is the member of a terminal, as the terminals of the plant's FMU have it."""
    *above, member = parts
    thruster = _THRUSTER.fullmatch(above[-1]) if above else None
    if thruster and member == "command":
        return f"thrust[{thruster[1]}]"
    return ".".join((*(part for part in above if part != "pose"), member))


def require_unit(
    key: str, file: FmuFile, variable: ModelVariable, expected: str | None, definition: Definition | None = None
) -> None:
    """Raise an error for a variable whose unit is another one; `definition` of one that another FMU defines."""
    unit = variable.unit
    if expected is None or not unit or (definition is not None and not expected):
        return
    if not _is_unit(file.units.get(unit, {}), unit, expected, definition):
        raise ScenarioError(f"{key}: {variable.name} of {file.path.name} is in {unit!r}, expected {expected or '1'!r}")


def _is_unit(definition: Definition, unit: str, expected: str, expected_definition: Definition | None) -> bool:
    """Return True if a unit of a model description is an expected one, by name or by its base units."""
    if unit.replace("*", ".").replace(" ", ".") == expected:
        return True
    if expected and expected not in UNITS and not expected_definition:
        return expected_definition is None  # a unit of the record that is none of FMI: nothing to compare with
    wanted = expected_definition or (base_unit(expected) if expected else {})
    if not definition:
        return (unit, expected) in (("Nm", "N.m"), ("1", ""), ("-", ""))
    factors = [float(base.get("factor", 1.0)) for base in (definition, wanted)]
    powers = [
        {key: int(base[key]) for key in base if key not in ("factor", "offset", "rad") and int(base[key])}
        for base in (definition, wanted)
    ]
    offsets = [float(base.get("offset", 0.0)) for base in (definition, wanted)]
    return powers[0] == powers[1] and math.isclose(*factors, rel_tol=1e-9) and offsets[0] == offsets[1]
