"""The map between an FMU of the user's that is the plant and the outputs of the vehicle's own FMU."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from controller.quaternion import rotation_matrix
from cosim.errors import ScenarioError
from cosim.scenario.fmu_tables import UserFmu
from cosim.scenario.scenario import Scenario
from cosim.simulation.fmu_map import Signal, assign, find_variable, require_unit
from cosim.simulation.stepped_plant import vehicle_channels
from cosim.step.plant_fmu_call import write_angles
from plant_fmu import Vehicle
from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.model_variables import ModelVariable

_POSITION = [f"position.{axis}" for axis in "xyz"]
QUATERNION, _ANGLES = [f"quaternion.e{i}" for i in range(4)], ["attitude.roll", "attitude.pitch", "attitude.yaw"]
BODY, NED = [f"velocity.{axis}" for axis in "uvw"], [f"velocity.{axis}" for axis in "xyz"]
_RATES = [f"velocity.{axis}" for axis in "pqr"]
MOTION_FORMS = frozenset((*_POSITION, *QUATERNION, *_ANGLES, *BODY, *NED, *_RATES))
STATE = [*_POSITION, *QUATERNION, *BODY, *_RATES]


def plant_targets(fmu: UserFmu, file: FmuFile, vehicle: Vehicle) -> dict[str, str]:
    """Return the output of the vehicle's FMU that each connected output sets, or `velocity.x` to `velocity.z`."""
    known = {c.name: Signal(-1, c.unit) for c in vehicle_channels(vehicle).outputs}
    known |= {name: Signal(-1, "m/s") for name in NED}
    targets = assign(fmu, file, known, "is no pose, velocity or other output of the vehicle's FMU")
    given = set(targets.values())
    for choices in ([_POSITION], [QUATERNION, _ANGLES], [BODY, NED], [_RATES]):
        if not any(given.issuperset(names) for names in choices):
            missing = next((name for names in choices for name in names if given & {*names} and name not in given),
                           choices[0][0])  # fmt: skip
            expected = " or ".join(f"{names[0]} to {names[-1]}" for names in choices)
            raise ScenarioError(f"{fmu.key}.outputs: no output of {file.path.name} is {missing}, expected {expected}")
    return targets


def check_plant_inputs(fmu: UserFmu, through: str, signals: Iterable[str]) -> None:
    """Raise `ScenarioError` unless an input receives the forces of the law."""
    kinds = ("thrust[", "command.") if through == "thrusters" else ("wrench.", "command.")
    if not any(signal.startswith(kinds) for signal in signals):
        forces = "thrust[1] and on" if through == "thrusters" else "wrench.X to wrench.N"
        raise ScenarioError(
            f"{fmu.key}.inputs: no input of {fmu.file.name} receives the forces of actuation.through = {through!r}, "
            f"expected {forces}, or command.X to command.N"
        )


def plant_start(fmu: UserFmu, file: FmuFile, scenario: Scenario, targets: Mapping[str, str]) -> dict[str, float]:
    """Return the start values that give the FMU the scenario's initial state: by the map, else by equal names."""
    known = initial_state(scenario)
    for name, part in fmu.initial.items():
        key = f"{fmu.key}.initial.{name}"
        variable = find_variable(file, key, name)
        if part not in known:
            raise ScenarioError(f"{key} is {part!r}, expected one of {', '.join(known)}")
        if not _is_settable(variable):
            raise ScenarioError(f"{key}: {name} of {file.path.name} cannot be set, expected a parameter or start value")
        unit = "m" if part in _POSITION else "m/s" if part in (*BODY, *NED) else "rad/s" if part in _RATES else None
        require_unit(key, file, variable, unit)
    start = {name: known[part] for name, part in fmu.initial.items()}
    for variable in file.model.values():
        part = targets.get(variable.name, variable.name)
        is_free = variable.name not in start and part not in fmu.initial.values()
        if is_free and part in known and variable.is_real and _is_settable(variable):
            start[variable.name] = known[part]
    return start


def _is_settable(variable: ModelVariable) -> bool:
    is_start = variable.initial in ("exact", "approx") and variable.causality in ("output", "local")
    return variable.variability != "constant" and (variable.causality == "parameter" or is_start)


def initial_state(scenario: Scenario) -> dict[str, float]:
    """Return the scenario's initial state by name, in all forms."""
    initial, angles = scenario.initial, np.zeros(3)
    write_angles(np.array(initial.quaternion), angles)
    velocity = np.array(initial.velocity[:3])
    ned = rotation_matrix(np.array(initial.quaternion)) @ velocity
    names = (*STATE, *_ANGLES, *NED)
    values = (*initial.position, *initial.quaternion, *initial.velocity, *angles.tolist(), *ned.tolist())
    return dict(zip(names, map(float, values), strict=True))
