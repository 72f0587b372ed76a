"""A scenario's loop as a system of three FMUs in one file (SSP 1.0), which other masters run without Python."""

from __future__ import annotations

import tempfile
from pathlib import Path

from controller.errors import RegionError
from controller.regions.in_c import require_in_c
from cosim.errors import RunError
from cosim.scenario.scenario import VEHICLE_COPY, Scenario
from cosim.scenario.start_values import start_values
from cosim.ssp.arbiter import arbiter_component
from cosim.ssp.controller import controller_component
from cosim.ssp.structure import Part, Wire, structure
from plant_fmu import build_fmu
from plant_fmu.archive import require_place, write_archive
from plant_fmu.build import cached_fmu
from plant_fmu.compiling.platforms import NATIVE
from plant_fmu.component import Component
from plant_fmu.variables import AXES, FORCES, VELOCITIES
from plant_fmu.vehicle_component import of_vehicle

_EXACT = ("closed", "exact")  # engines whose weights are those of the closed form
MOTION = (
    *(f"position.{axis}" for axis in AXES),
    *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{name}" for name in VELOCITIES),
)
WRENCH = tuple(f"wrench.{name}" for name in FORCES)


def package_system(scenario: Scenario, out: Path, fmi: int = 2, platforms: str = NATIVE) -> Path:
    """Write a scenario's plant, controller and arbiter as a system structure and package (SSP 1.0).

    The system is Jacobi's: in each step every FMU works on what the others had put out at its beginning, whatever order
    a master steps them in.

    Parameters
    ----------
    scenario : Scenario
        With the paper's law, on the direct wrench, and nothing that comes from outside.
    out : Path
        The file to write; it appears whole or not at all, with the same bytes each time.
    fmi : int
        2 or 3, of all three FMUs. Most masters of SSP take 2 alone.
    platforms : str
        As `plant_fmu.build_fmu` takes it.

    Returns
    -------
    Path
        `out`.

    Raises
    ------
    RunError
        If the scenario has what such a system has not.
    BuildError
        If an FMU cannot be built, or `out` cannot be written.
    """
    _require(scenario)
    out = Path(out)
    require_place(out)
    controller, arbiter = controller_component(scenario), arbiter_component(scenario)
    memberships, weights = (
        tuple(f"{what}.{name}" for name in scenario.criterion_names) for what in ("membership", "weight")
    )
    outputs = tuple(v.name for v in controller.variables if v.role == "output")
    parts = (
        Part("plant", "resources/plant.fmu", plant_component(scenario), (*MOTION, *WRENCH)),
        Part("controller", "resources/controller.fmu", controller, (*MOTION, *weights, *outputs)),
        Part("arbiter", "resources/arbiter.fmu", arbiter, (*memberships, *weights)),
    )
    wires = (
        Wire("plant", "controller", MOTION),
        Wire("controller", "plant", WRENCH),
        Wire("controller", "arbiter", memberships),
        Wire("arbiter", "controller", weights),
    )
    time = scenario.time
    members = {part.source: _fmu(part.component, fmi, platforms) for part in parts}
    described = structure(scenario.name, scenario.title, parts, wires, time.duration, time.step)
    members["SystemStructure.ssd"] = described.encode()
    write_archive(out, members | _origin(scenario))
    return out


def plant_component(scenario: Scenario) -> Component:
    """Return the plant of a scenario, which starts as the scenario says.

    Parameters
    ----------
    scenario : Scenario
        Whose vehicle, start and plant numbers are used.

    Returns
    -------
    Component
        The vehicle's, with other start values.
    """
    start = {name: float(value) for name, value in start_values(scenario).items()}
    return of_vehicle(scenario.vehicle, start, scenario.time.duration, scenario.time.step)


def _origin(scenario: Scenario) -> dict[str, bytes]:
    """Return the files from which the system can be made again."""
    if scenario.vehicle_file is None:
        return {"documentation/scenario.toml": scenario.toml().encode()}
    return {
        "documentation/scenario.toml": scenario.toml(VEHICLE_COPY).encode(),
        f"documentation/{VEHICLE_COPY}": scenario.vehicle_file.read_bytes(),
    }


def _fmu(component: Component, fmi: int, platforms: str) -> bytes:
    if platforms == NATIVE:
        return cached_fmu(component, fmi).read_bytes()
    with tempfile.TemporaryDirectory(prefix="cosim-") as folder:
        return build_fmu(component, fmi, Path(folder) / f"{component.name}.fmu", platforms).read_bytes()


def _require(scenario: Scenario) -> None:
    """Refuse what the FMUs of a system have not."""
    own = next((c.name for c in scenario.criteria if any(r.term or r.ramp is not None for r in c.reasons)), None)
    streamed = [r.region.name for r in scenario.regions if r.streamed]
    for good, key, received, expected in (
        (
            scenario.law.name == "ismail_dunnigan",
            "law.name",
            repr(scenario.law.name),
            "'ismail_dunnigan': the law there is in C",
        ),
        (
            scenario.actuation.through == "wrench",
            "actuation.through",
            repr(scenario.actuation.through),
            "'wrench': there is no allocation in C",
        ),
        (
            scenario.arbiter.engine in _EXACT,
            "arbiter.engine",
            repr(scenario.arbiter.engine),
            "'closed' or 'exact', such as by --set arbiter.engine=closed",
        ),
        (scenario.arbiter.rules == "ordered", "arbiter.rules", repr(scenario.arbiter.rules), "'ordered'"),
        (not scenario.arbiter.file, "arbiter.file", repr(scenario.arbiter.file), "none: rules get memberships alone"),
        (own is None, f"criteria.{own}.membership", "given", "none: there is one ramp for all"),
        (scenario.sensing.exact, "sensing", "not exact", "neither noise nor gaps"),
        (not scenario.failures, "failures", "given", "none"),
        (not scenario.commands.enabled, "commands.enabled", "true", "false: nobody steers a system from outside"),
        (not scenario.goal_streamed, "goal.streamed", "true", "false"),
        (not scenario.goal_then, "goal.then", "given", "none"),
        (not streamed, f"regions.{streamed[0]}.streamed" if streamed else "", "true", "false"),
    ):
        if not good:
            raise RunError(f"{key} is {received}, expected {expected} in a system of FMUs")
    try:
        require_in_c((scenario.goal_region, *(r.region for r in scenario.regions)), "a system of FMUs")
    except RegionError as error:
        raise RunError(str(error)) from error
