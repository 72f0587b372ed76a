"""Interface of a plant that the master steps: an FMU, or a vehicle behind a link."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, NoReturn, Protocol

import numpy as np

from controller.compiling.function import BoundCall
from controller.navigation.measurements import SENSORS
from cosim.errors import RunError
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array
from cosim.step.plant_calls import PlantCalls
from cosim.step.step_model import PLANT_SET, PLANT_STEP, StepData, set_call
from plant_fmu import Plant, Vehicle
from plant_fmu.running.channels import Channel, Channels
from plant_fmu.running.native import Native
from plant_fmu.variables import variables

_NONE: Array = np.zeros(0)
_NO_FLAGS, _NO_REFERENCES = np.zeros(0, np.bool_), np.zeros(0, np.uint32)

LOSSES = tuple(f"{sensor}.loss_probability" for sensor in SENSORS)  # parameters of the plant


class SteppedPlant(Protocol):
    """Plant with named variables that advances in steps."""

    # buffers that change in place
    inputs: Channels  # `step` sends them
    outputs: Channels  # `initialize` and `step` update them
    flags: Channels  # `read_flags` updates them

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


class BoundPlant:
    """Binds a plant to the arrays of a step: an FMU by its C functions, any other plant by Python functions."""

    def __init__(
        self, scenario: Scenario, plant: SteppedPlant, data: StepData, native: bool, inputs: Sequence[str]
    ) -> None:
        self._plant, self._step = plant, scenario.time.step
        self.native = native and isinstance(plant, Plant) and plant.fmi == 3
        self._calls: list[BoundCall] = []
        if self.native:
            assert isinstance(plant, Plant)
            own, sent = plant.native_channels(), plant.native(inputs, ())
            if len(inputs) < len(plant.inputs):  # those that nothing sets keep their start values
                own = own._replace(input_references=sent.input_references, inputs=sent.inputs)
            self.calls = plant_calls(scenario.vehicle, own, plant.native)
        else:
            own = _buffers(plant.inputs.values, plant.outputs.values, np.zeros(len(plant.flags), np.bool_))
            self.calls = plant_calls(scenario.vehicle, own, lambda names, _: _buffers(np.full(len(names), np.nan)))
            self._calls = [BoundCall(self._send_parameters, ()), BoundCall(self._make_step, ())]
            for which, bound in zip((PLANT_SET, PLANT_STEP), self._calls, strict=True):
                set_call(data, which, bound)
        # names and values to be sent; NaN: none
        names, calls = _effectiveness_names(scenario.vehicle), self.calls
        self._parameters = (names, calls.effectiveness.inputs), (LOSSES, calls.losses.inputs)

    def _send_parameters(self) -> None:
        for names, values in self._parameters:
            changed = {name: value for name, value in zip(names, values.tolist(), strict=True) if value == value}
            if changed:
                values[:] = np.nan
                self._plant.set(changed)

    def _make_step(self) -> None:
        self._plant.step(self._step)
        if len(self._plant.flags):
            self.calls.native.flags[:] = self._plant.read_flags()

    def prepare_steps(self) -> None:
        """Raise an error if an FMU cannot make steps, for example because it is closed."""
        if self.native:
            self._plant.prepare_steps(self._step)  # type: ignore[attr-defined]

    def count_steps(self, n: int) -> None:
        """Tell an FMU how many steps were done."""
        if self.native:
            self._plant.count_steps(n)  # type: ignore[attr-defined]

    def raise_error(self) -> None:
        """Raise the error of a plant in Python, if it raised one."""
        for call in self._calls:
            call.raise_error()

    def raise_failure(self) -> NoReturn:
        """Raise the error of an FMU's step that failed."""
        assert isinstance(self._plant, Plant)
        self._plant.raise_failure(self.calls.native)


def plant_calls(
    vehicle: Vehicle, channels: Native, native: Callable[[Sequence[str], Sequence[str]], Native]
) -> PlantCalls:
    """Return the calls of a plant by its channels, and by a function that makes calls for some inputs and outputs."""
    return PlantCalls(channels, native(_effectiveness_names(vehicle), ()), native(LOSSES, ()))


def _effectiveness_names(vehicle: Vehicle) -> tuple[str, ...]:
    """Return the names of the parameters by which thrusters fail."""
    return tuple(f"thrust_effectiveness[{i + 1}]" for i in range(vehicle.n_thrusters))


def _buffers(inputs: Array, outputs: Array = _NONE, flags: Any = _NO_FLAGS) -> Native:
    """Return buffers without C functions."""
    results = np.zeros(5, np.int64), np.full(1, np.nan)
    return Native(0, 0, 0, 0, _NO_REFERENCES, inputs, _NO_REFERENCES, outputs, *results, flags=flags)


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
        values = getattr(plant, kind).values
        if kind != "flags" and not (values.dtype == np.float64 and values.flags.c_contiguous):
            what = "strided" if values.dtype == np.float64 else f"of {values.dtype}"
            raise RunError(f"plant.{kind}.values is {what}, expected a contiguous array of float64")
        names, remaining = [channel.name for channel in expected], iter(given)
        first = {"inputs": len(names), "outputs": _STATES}.get(kind, 0)  # these stand side by side in the row
        for i, name in enumerate(names):
            if (i < first and name not in given[i : i + 1]) or name not in remaining:
                where = f"the channel {i + 1}" if i < first else "a channel in that order"
                raise RunError(f"plant.{kind}: {name!r} is not {where}, expected those of vehicle {vehicle.name!r}")
