"""Interface of a plant that the master steps: an FMU, or a vehicle behind a link."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

from cosim.errors import RunError
from plant_fmu import Vehicle
from plant_fmu.running.channels import Channel, Channels
from plant_fmu.variables import variables


class SteppedPlant(Protocol):
    """Plant with named variables that advances in steps."""

    inputs: Channels  # buffers that change in place: `step` sends the inputs and updates the outputs
    outputs: Channels  # buffers that change in place: `step` sends the inputs and updates the outputs
    flags: Channels  # buffers that change in place: `step` sends the inputs and updates the outputs

    def set(self, values: Mapping[str, Any]) -> None:
        """Set parameters and start values by name."""
        ...

    def initialize(self) -> None:
        """Initialize the plant before the first step."""
        ...

    def step(self, step: float) -> None:
        """Advance the plant by `step` seconds."""
        ...

    def read_flags(self) -> Any:
        """Return the present Boolean outputs, shape (n,)."""
        ...

    def close(self) -> None:
        """Release the plant. May be called twice."""
        ...


_STATES = 13  # outputs of pose and velocity, the first ones


class VehicleChannels(NamedTuple):
    """Channels of a vehicle's FMU, each in the order of the model description."""

    outputs: tuple[Channel, ...]
    flags: tuple[Channel, ...]
    inputs: tuple[Channel, ...]


def vehicle_channels(vehicle: Vehicle) -> VehicleChannels:
    """Return the channels of a vehicle's FMU from its table of variables."""
    table = [v for v in variables(vehicle) if not v.local]
    kinds = ((("state", "output"), "real"), (("output",), "boolean"), (("input",), "real"))
    return VehicleChannels(*(
        tuple(Channel(v.name, v.quantity.unit, v.description) for v in table if v.role in roles and v.type == kind)
        for roles, kind in kinds
    ))  # fmt: skip


def validate_plant(plant: SteppedPlant, vehicle: Vehicle) -> None:
    """Raise `RunError` unless a plant has the channels of a vehicle's FMU; it may have more of them."""
    for kind, expected in vehicle_channels(vehicle)._asdict().items():
        given = getattr(getattr(plant, kind, None), "names", None)
        if given is None:
            raise RunError(f"plant is {type(plant).__name__} without {kind}, expected a plant such as plant_fmu.Plant")
        names, remaining = [channel.name for channel in expected], iter(given)
        first = {"inputs": len(names), "outputs": _STATES}.get(kind, 0)  # these stand side by side in the row
        for i, name in enumerate(names):
            if (i < first and name not in given[i : i + 1]) or name not in remaining:
                where = f"the channel {i + 1}" if i < first else "a channel in that order"
                raise RunError(f"plant.{kind}: {name!r} is not {where}, expected those of vehicle {vehicle.name!r}")
