"""The columns of a run's row, in its order."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence

from controller import LAWS, Law
from controller.law import Diagnostic
from controller.regions import of_attitude
from cosim.errors import RunError
from cosim.helm.orders import MODES
from cosim.lyapunov import lyapunov_columns
from cosim.record import Record
from cosim.scenario import CRITERIA, Scenario
from cosim.signals import Column
from plant_fmu import Channel, Plant
from plant_fmu.variables import variables

log = logging.getLogger(__name__)

_FORCE_UNITS = ("N",) * 3 + ("N.m",) * 3
_TAKEN_ALONG = ("law.", "sensed.", "water_velocity.")  # beginnings of names of what is exported, and nothing is made of
_OF_REGIONS = (".clearance", ".shift.x", ".shift.y", ".shift.z")  # a region may have any of those names
_NAMED = 3  # columns in a message


def columns_of(scenario: Scenario, plant: Plant, law: Law) -> list[Column]:
    """Return the columns of a run.

    Parameters
    ----------
    scenario : Scenario
        What is run.
    plant : Plant
        Its outputs, flags and inputs are columns.
    law : Law
        Its diagnostics are columns.

    Returns
    -------
    list of Column
        In the order of the row.
    """
    channels = (plant.outputs.channels, plant.flags.channels, plant.inputs.channels)
    return _columns(scenario, *channels, law.diagnostics)


def require_columns(scenario: Scenario, record: Record) -> None:
    """Refuse a record that lacks what its scenario calls for; warn where nothing is made of what it lacks.

    Parameters
    ----------
    scenario : Scenario
        What was run.
    record : Record
        What it left; it may have more columns.

    Raises
    ------
    RunError
        With the names of some columns that are missing, or stand in another order.
    """
    expected, found = names_of(scenario), list(record.units)
    missing = [name for name in expected if name not in record.units]
    needed = [name for name in missing if not _is_taken_along(name)]
    if needed:
        raise RunError(f"{record.file}: has no {_listed(needed)}, which its scenario calls for")
    # what is read side by side, or as the first one, counts on the order
    here = [found[0], *(name for name in found if name in expected)]
    there = [expected[0], *(name for name in expected if name in record.units)]
    odd = next((name for name, other in zip(here, there, strict=True) if name != other), None)
    if odd is not None:
        raise RunError(f"{record.file}: column {odd!r} stands elsewhere, expected the order that its scenario has")
    if missing:
        log.warning("%s: has no %s: what is made of it does without", record.file, _listed(missing))


def names_of(scenario: Scenario) -> list[str]:
    """Return the names of the columns of a run, without the reports of a law that is not shipped.

    Parameters
    ----------
    scenario : Scenario
        What is run.

    Returns
    -------
    list of str
        In the order of the row.
    """
    table = [v for v in variables(scenario.vehicle) if not v.local]
    outputs, flags, inputs = (
        [Channel(v.name, v.quantity.unit, v.description) for v in table if v.role in roles and v.type == kind]
        for roles, kind in ((("state", "output"), "real"), (("output",), "boolean"), (("input",), "real"))
    )
    law = LAWS.get(scenario.law.name)
    return [column.name for column in _columns(scenario, outputs, flags, inputs, law.diagnostics if law else ())]


def _is_taken_along(name: str) -> bool:
    return name.endswith(".value") or (name.startswith(_TAKEN_ALONG) and not name.endswith(_OF_REGIONS))


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"column{'s' * (len(names) > 1)} {', '.join(map(repr, names[:_NAMED]))}{more}"


def _columns(
    scenario: Scenario,
    outputs: Sequence[Channel],
    flags: Sequence[Channel],
    inputs: Sequence[Channel],
    diagnostics: Sequence[Diagnostic],
) -> list[Column]:
    regions = [("goal", scenario.goal), *((r.region.name, r.region.shape) for r in scenario.regions)]
    return [
        Column("time", "s", "Simulated time at the beginning of the step"),
        *_of(outputs),
        *_of(flags),
        *(Column(f"{name}.value", shape.unit, f"g of {name}, above 0 where violated") for name, shape in regions),
        *(
            Column(f"{name}.clearance", "rad", f"Angle left within {name}, below 0 where violated")
            if of_attitude(shape)
            else Column(f"{name}.clearance", "m", f"Distance to the surface of {name}, below 0 where violated")
            for name, shape in regions
        ),
        *(
            Column(f"membership.{name}", "", f"Degree to which criterion {name} asks for attention")
            for name in CRITERIA
        ),
        *(Column(f"weight.{name}", "", f"Weight of the criterion {name} from the arbiter") for name in CRITERIA),
        *(Column(f"estimate.phi{i + 1}", "N.m" if i else "N", f"Estimate of phi {i + 1} in (12)") for i in range(4)),
        *(
            Column(f"command.{name}", unit, "Wrench that the law asks for, body frame")
            for name, unit in zip("XYZKMN", _FORCE_UNITS, strict=True)
        ),
        Column("allocation_saturated", "", "The thrusters' limits cut the wrench that the law asks for"),
        *_of(inputs),
        *(
            Column(f"{name}.shift.{axis}", "m", f"How far {name} has moved {where} from where the scenario has it")
            for name in scenario.moving
            for axis, where in zip("xyz", ("north", "east", "down"), strict=True)
        ),
        *_sensed(scenario),
        *_ordered(scenario),
        *(Column(f"law.{d.name}", d.unit, d.description) for d in diagnostics),
        *lyapunov_columns(scenario),
    ]


def _sensed(scenario: Scenario) -> Iterator[Column]:
    if scenario.sensing.exact:
        return
    for axis, where in zip("xyz", ("north", "east", "down"), strict=True):
        yield Column(f"sensed.{axis}", "m", f"Position {where} that the law is told")
    for i, name in enumerate("uvwpqr"):
        yield Column(f"sensed.{name}", "m/s" if i < 3 else "rad/s", f"Velocity {name} that the law is told, body frame")


def _ordered(scenario: Scenario) -> Iterator[Column]:
    if not scenario.commands.enabled:
        return
    yield Column("helm.armed", "", "The thrusters may work")
    yield Column("helm.mode", "", f"Who steers: {', '.join(f'{i} {mode}' for i, mode in enumerate(MODES))}")
    yield Column("helm.item", "", "Item of the mission, from 0; -1 for none")
    for axis, where in zip("xyz", ("north", "east", "down"), strict=True):
        yield Column(f"target.{axis}", "m", f"Middle of the target region, {where}")
    yield Column("target.radius", "m", "Radius of the target region if it is a sphere of its own, 0 if it is the goal")


def _of(channels: Sequence[Channel]) -> list[Column]:
    return [Column(channel.name, channel.unit, channel.description) for channel in channels]
