"""The variables by which other components act on the vehicle."""

from __future__ import annotations

from collections.abc import Iterator

from plant_fmu import quantities as q
from plant_fmu.quantities import Quantity
from plant_fmu.variables.variable import AXES, SENSORS, Variable
from plant_fmu.vehicle import Vehicle


def coupling_inputs(vehicle: Vehicle) -> Iterator[Variable]:
    """Yield the inputs that are off while they are 0."""

    def row(name: str, member: str, quantity: Quantity, description: str) -> Variable:
        return Variable(name, "input", f"coupling.{member}", quantity, description)

    for i, where in enumerate(("north", "east", "down")):
        description = f"Velocity of the water, added to that of the parameters, {where}, world frame NED"
        yield row(f"current_input.{AXES[i]}", f"current[{i}]", q.CURRENT, description)
    for i, where in enumerate(("north", "east", "down")):
        description = f"Rate of that velocity, {where}, which extrapolates it within a step"
        yield row(f"current_input_rate.{AXES[i]}", f"current_rate[{i}]", q.ACCELERATION, description)
    for frame in ("world", "body"):
        for kind, quantity, what in (
            ("force", q.FORCE, "External force, {} frame {}"),
            ("moment", q.MOMENT, "External moment, {} frame {}"),
            ("point", q.LEVER, "Point where the external force of the {} frame acts, body {}"),
        ):
            for i, axis in enumerate(AXES):
                description = what.format(frame, axis)
                yield row(f"load.{frame}.{kind}.{axis}", f"{frame}.{kind}[{i}]", quantity, description)
    for name, quantity, what in (
        ("normalized", q.SHARE, "Command of thruster {} as a fraction of its limits, added to its commanded force"),
        ("pulse", q.PULSE, "Command of thruster {} as a pulse of a T200, added to its commanded force; 0: none"),
        ("rpm", q.RPM, "Command of thruster {} as revolutions of a T200, added to its commanded force"),
        ("failure", q.FRACTION, "Lost fraction of thruster {}'s force"),
    ):
        for i in range(vehicle.n_thrusters):
            yield row(f"thrust_{name}[{i + 1}]", f"thrust_{name}[{i}]", quantity, what.format(i + 1))
    for i, (sensor, what) in enumerate(SENSORS):
        description = f"Probability that a sample of {what} is lost, if above that of the parameter"
        yield row(f"{sensor}.outage", f"outage[{i}]", q.FRACTION, description)


def coupling_parameters() -> Iterator[Variable]:
    """Yield the parameters that belong to the inputs."""
    description = "Supply voltage of thrusters that are commanded by pulses or revolutions"
    yield Variable("supply_voltage", "parameter", "coupling.supply_voltage", q.VOLTAGE, description, 16.0)
