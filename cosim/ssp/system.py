"""A scenario's loop as a system of three FMUs in one file (SSP 1.0), which other masters run without Python."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import permutations
from pathlib import Path

from cosim.errors import RunError
from cosim.results.file_copies import files_of
from cosim.scenario.law_factory import require_builtin_law
from cosim.scenario.scenario import Scenario
from cosim.scenario.true_vehicle import start_values
from cosim.ssp.arbiter import arbiter_component
from cosim.ssp.controller import controller_component, prefixes
from cosim.ssp.own_fmus import ARBITER, CONTROLLER, PLANT, STAND_IN, own_fmus, own_wires
from cosim.ssp.structure import Connector, Part, Wire, structure
from cosim.ssp.variable_groups import osp_model_description
from fuzzy_arbiter import ArbiterError
from fuzzy_arbiter.export import to_c
from plant_fmu import build_fmu
from plant_fmu.archive import require_writable, temporary_folder, write_archive
from plant_fmu.build import cached_fmu
from plant_fmu.compiling.platforms import NATIVE
from plant_fmu.component import Component
from plant_fmu.contents.parameter_set import parameter_set
from plant_fmu.variables import AXES, FORCES, VELOCITIES, Variable
from plant_fmu.vehicle_component import make_vehicle_component

_EXACT = ("closed", "exact")  # engines whose weights are those of the closed form
MOTION = (
    *(f"position.{axis}" for axis in AXES),
    *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{name}" for name in VELOCITIES),
)
WRENCH = tuple(f"wrench.{name}" for name in FORCES)


def package_system(scenario: Scenario, out: Path, fmi: int = 2, platforms: str = NATIVE) -> Path:
    """Write a scenario's plant, controller and arbiter as a system structure and package (SSP 1.0)."""
    # The system is of Jacobi type: in each step every FMU uses the outputs of the others from the beginning of the
    # step, in any stepping order of the master.
    _require(scenario)
    out = Path(out)
    require_writable(out)
    own = own_fmus(scenario)
    components = {
        PLANT: plant_component(scenario, any(one.fmu is not scenario.law.fmu for one in own)),
        CONTROLLER: _controller(scenario),
        ARBITER: arbiter_component(scenario),
    }
    regions = [scenario.goal_region, *(secondary.region for secondary in scenario.regions)]
    named = {"goal" if i == 0 else region.name: prefix
             for i, (region, prefix) in enumerate(zip(regions, prefixes(regions), strict=True))}  # fmt: skip
    outputs = {name: {v.name for v in c.variables if _is_output(v)} for name, c in components.items()}
    wires = [*_wires(components), *own_wires(scenario, own, named, outputs)]
    parts = [Part(name, f"resources/{name}.fmu", component.description, _connectors(name, component, wires))
             for name, component in components.items()]  # fmt: skip
    time = scenario.time
    members = {part.source: _fmu(components[part.name], fmi, platforms) for part in parts}
    for part in parts:
        component = components[part.name]
        values = [(v, v.start) for v in component.variables if v.role == "parameter"]
        members[part.parameters] = parameter_set(part.name, f"{part.name} of {scenario.title}", values).encode()
        groups = osp_model_description(component, [connector.name for connector in part.connectors])
        members[f"resources/{component.name}_OspModelDescription.xml"] = groups.encode()
    for one in own:
        part = Part(one.fmu.name, f"resources/{one.fmu.name}.fmu", f"FMU {one.file.path.name}", one.connectors)
        members |= {part.source: one.file.path.read_bytes(), part.parameters: one.parameters()}
        parts.append(part)
    description = structure(scenario.name, scenario.title, parts, wires, time.duration, time.step)
    members["SystemStructure.ssd"] = description.encode()
    origin = {f"documentation/{name}": content for name, content in files_of(scenario).items()}
    write_archive(out, members | origin)
    return out


def _wires(components: Mapping[str, Component]) -> list[Wire]:
    """Connect every output to the inputs of other components with its name."""
    roles = {name: {v.name: v.role for v in component.variables} for name, component in components.items()}
    return [
        Wire(start, end, tuple(
            (name, name) for name, role in roles[end].items()
            if role == "input" and roles[start].get(name) in ("state", "output")
        ))
        for start, end in permutations(components, 2)
    ]  # fmt: skip


def _connectors(part: str, component: Component, wires: Sequence[Wire]) -> tuple[Connector, ...]:
    """Return the connectors of a component: of its real outputs, and of its inputs that are connected."""
    # FMPy sets inputs that have a connector but no connection to the value of another one.
    connected = {end for wire in wires if wire.end == part for _, end in wire.names}
    return tuple(
        Connector(v.name, "output" if _is_output(v) else "input", v.quantity.unit, v.description)
        for v in component.variables
        if _is_output(v) or (v.role == "input" and v.name in connected)
    )


def _is_output(v: Variable) -> bool:
    return v.type == "real" and not v.local and v.role in ("state", "output")


def _controller(scenario: Scenario) -> Component:
    """Make the controller; beside a law that is an FMU it senses and evaluates regions alone."""
    if not scenario.law.fmu:
        return controller_component(scenario)
    return controller_component(scenario.replace({"law": {"name": STAND_IN}}), has_law=False)


def plant_component(scenario: Scenario, coupled: bool = False) -> Component:
    """Make the component of a scenario's plant, with the scenario's start values."""
    start = {name: float(value) for name, value in start_values(scenario).items()}
    for failure in scenario.failures:  # failures at time 0 are start values, since connections act after the first step
        if failure.time <= 0.0 and not failure.stuck:
            start[f"thrust_effectiveness[{failure.thruster}]"] = failure.effectiveness
    coupled = coupled or bool(scenario.failures or scenario.outages)
    return make_vehicle_component(scenario.vehicle, start, scenario.time.duration, scenario.time.step, coupled)


def _fmu(component: Component, fmi: int, platforms: str) -> bytes:
    if platforms == NATIVE:
        return cached_fmu(component, fmi).read_bytes()
    with temporary_folder("cosim-") as folder:
        return build_fmu(component, fmi, folder / f"{component.name}.fmu", platforms).read_bytes()


def _require(scenario: Scenario) -> None:
    """Raise a RunError for features that the FMUs of a system do not support."""
    streamed, engine = next((r.region.name for r in scenario.regions if r.streamed), ""), scenario.arbiter.engine
    if not scenario.law.fmu:
        require_builtin_law(scenario)
    stuck, late = any(failure.stuck for failure in scenario.failures), scenario.time.control != scenario.time.step
    from_file = next((r.region.name for r in scenario.regions if hasattr(r.region.shape, "file")), "")
    for ok, key, received, expected in (
        (
            engine in _EXACT,
            "arbiter.engine",
            repr(engine),
            "'closed' or 'exact', such as by --set arbiter.engine=closed",
        ),
        (not scenario.plant_fmu, "plant.file", "given", "none"),
        (not scenario.vehicle.command_delay, "thrusters.delay", f"{scenario.vehicle.command_delay:g} s", "0"),
        (not (scenario.law.fmu and late), "time.control", f"{scenario.time.control:g} s", "time.step with law.file"),
        (not (scenario.law.fmu and stuck), "failures", "of stuck thrusters", "others with law.file"),
        (not scenario.commands.enabled, "commands.enabled", "true", "false: a system takes no commands"),
        (not scenario.goal_streamed, "goal.streamed", "true", "false"),
        (not from_file, f"regions.{from_file}.shape", "of a file", "a shape whose numbers can be parameters"),
        (not streamed, f"regions.{streamed}.streamed", "true", "false"),
    ):
        if not ok:
            raise RunError(f"{key} is {received}, expected {expected} in a system of FMUs")
    try:
        to_c(scenario.rules.system)
    except ArbiterError as error:
        raise RunError(f"arbiter.{'file' if scenario.arbiter.file else 'rules'}: {error}") from error
