"""The columns of a run's row, in its order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from controller import LAWS
from controller.law import Diagnostic
from controller.regions.region_set import of_attitude
from cosim.errors import ScenarioError
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import MODES
from cosim.simulation.component_map import component_channels, component_columns
from cosim.simulation.lyapunov_signals import lyapunov_columns
from cosim.simulation.signals import Column
from cosim.simulation.stepped_plant import SteppedPlant, VehicleChannels, vehicle_channels
from plant_fmu.running import Channel

_FORCE_UNITS = ("N",) * 3 + ("N.m",) * 3


def channels_of_run(scenario: Scenario, plant: SteppedPlant | None = None) -> VehicleChannels:
    """Return the plant's channels in the record: all of a caller's plant, else the inputs that components set too."""
    if plant is not None:
        return VehicleChannels(plant.outputs.channels, plant.flags.channels, plant.inputs.channels)
    outputs, flags, inputs = vehicle_channels(scenario.vehicle)
    return VehicleChannels(outputs, flags, (*inputs, *component_channels(scenario)))


def column_names(scenario: Scenario) -> list[str]:
    """Return the names of the columns of a run, without the diagnostics of a custom law."""
    return [column.name for column in columns_without_plant(scenario)]


def columns_without_plant(scenario: Scenario) -> list[Column]:
    """Return the columns of a run from the vehicle's table of variables and a built-in law."""
    law = LAWS.get(scenario.law.name)
    return columns_of_channels(scenario, *channels_of_run(scenario), law.diagnostics if law else ())


def columns_of_channels(
    scenario: Scenario,
    outputs: Sequence[Channel],
    flags: Sequence[Channel],
    inputs: Sequence[Channel],
    diagnostics: Sequence[Diagnostic],
) -> list[Column]:
    """Return the columns of a run that exchanges some channels with its plant."""
    regions = [("goal", scenario.goal), *((r.region.name, r.region.shape) for r in scenario.regions)]
    columns = [
        Column("time", "s", "Simulated time at the beginning of the step"),
        *_as_columns(outputs),
        *_as_columns(flags),
        *(Column(f"{name}.value", shape.unit, f"g of {name}, above 0 where violated") for name, shape in regions),
        *(
            Column(f"{name}.clearance", "rad", f"Angle left within {name}, below 0 where violated")
            if of_attitude(shape)
            else Column(f"{name}.clearance", "m", f"Distance to the surface of {name}, below 0 where violated")
            for name, shape in regions
        ),
        *(
            Column(f"membership.{name}", "", f"Degree to which criterion {name} asks for attention")
            for name in scenario.criterion_names
        ),
        *(
            Column(f"weight.{name}", "", f"Weight of the criterion {name} from the arbiter")
            for name in scenario.criterion_names
        ),
        *(Column(f"estimate.phi{i + 1}", "N.m" if i else "N", f"Estimate of phi {i + 1} in (12)") for i in range(4)),
        *(
            Column(f"command.{name}", unit, "Commanded wrench, body frame")
            for name, unit in zip("XYZKMN", _FORCE_UNITS, strict=True)
        ),
        Column("allocation_saturated", "", "Commanded wrench clipped by the thrusters' limits"),
        *_as_columns(inputs),
        *(column for name in scenario.moving for column in _along(f"{name}.shift", "m", f"Displacement of {name}")),
        *([Column("goal.place", "", "Index of the goal's present place, from 0")] if scenario.goal_then else []),
        *_sensing_columns(scenario),
        *_command_columns(scenario),
        *(Column(f"law.{d.name}", d.unit, d.description) for d in diagnostics),
        *lyapunov_columns(scenario),
        *_arbiter_input_columns(scenario),
    ]
    names, beside = {column.name for column in columns}, component_columns(scenario)
    for column in beside:
        if column.name in names:
            name = column.name.partition(".")[0]
            raise ScenarioError(
                f"components.{name}.name is {name!r}, but {column.name!r} is a column already, expected another name"
            )
    return [*columns, *beside]


def _arbiter_input_columns(scenario: Scenario) -> Iterator[Column]:
    """Yield the columns of the arbiter's inputs, where these are not the memberships alone."""
    if scenario.arbiter.file:
        for signal in scenario.rules.inputs:
            yield Column(f"arbiter.{signal.name}", signal.unit, f"Input {signal.name} of the arbiter: {signal.what}")


def _sensing_columns(scenario: Scenario) -> Iterator[Column]:
    if scenario.sensing.exact:
        return
    yield from _along("sensed", "m", "Sensed position")
    for i, name in enumerate("uvwpqr"):
        yield Column(f"sensed.{name}", "m/s" if i < 3 else "rad/s", f"Sensed velocity {name}, body frame")
    if scenario.sensing.through == "state":
        return
    for i in range(4):
        yield Column(f"sensed.e{i}", "", f"Sensed attitude, unit quaternion, component {i}")
    for name, unit in (("position", "m"), ("velocity", "m/s"), ("attitude", "rad")):
        yield from _along(f"deviation.{name}", unit, f"Standard deviation of the sensed {name}")
    for name in "pqr":
        yield Column(f"deviation.rate.{name}", "rad/s", f"Standard deviation of the sensed rate {name}, body frame")


def _command_columns(scenario: Scenario) -> Iterator[Column]:
    if not scenario.commands.enabled:
        return
    yield Column("commands.armed", "", "Armed: the thrusters may give force")
    yield Column("commands.mode", "", f"Control mode: {', '.join(f'{i} {mode}' for i, mode in enumerate(MODES))}")
    yield Column("commands.item", "", "Item of the mission, from 0; -1 for none")
    yield from _along("target", "m", "Center of the target region")
    yield Column("target.radius", "m", "Radius of the target region if it is a sphere of its own, 0 if it is the goal")


def _along(name: str, unit: str, what: str) -> Iterator[Column]:
    """Yield the columns of a vector's components north, east and down."""
    for axis, where in zip("xyz", ("north", "east", "down"), strict=True):
        yield Column(f"{name}.{axis}", unit, f"{what}, {where}")


def _as_columns(channels: Sequence[Channel]) -> list[Column]:
    return [Column(channel.name, channel.unit, channel.description) for channel in channels]
