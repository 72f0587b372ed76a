"""Interface of a plant that the master steps: an FMU, or a vehicle behind a link."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, NoReturn, Protocol

import numpy as np

from controller.navigation.measurements import SENSORS
from cosim.errors import RunError
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array
from cosim.step.plant_calls import PlantCalls
from plant_fmu import Plant, Vehicle
from plant_fmu.running.channels import Channel, Channels
from plant_fmu.running.native import Native
from plant_fmu.variables import variables

LOSSES = tuple(f"{sensor}.loss_probability" for sensor in SENSORS)  # parameters of the plant
_FATAL = 3  # FMI status
_POINTER, _SIZE = ctypes.c_void_p, ctypes.c_size_t
_TRANSFER = (_POINTER, _POINTER, _SIZE, _POINTER, _SIZE)  # arguments of fmi3SetFloat64
_DO_STEP = (_POINTER, ctypes.c_double, ctypes.c_double, ctypes.c_bool, *(_POINTER,) * 4)  # of fmi3DoStep


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


class BoundPlant:
    """The calls by which a step exchanges values with a plant: an FMU's own, or of Python functions."""

    def __init__(self, scenario: Scenario, plant: SteppedPlant, native: bool) -> None:
        self._plant = plant
        n = scenario.vehicle.n_thrusters
        self._raised: BaseException | None = None
        self._kept: list[Any] = []
        effectiveness = tuple(f"thrust_effectiveness[{i + 1}]" for i in range(n))
        self.native = native and isinstance(plant, Plant) and plant.fmi == 3
        if self.native:
            assert isinstance(plant, Plant)
            parts = plant.native_channels(), plant.native(effectiveness, ()), plant.native(LOSSES, ())
            self.calls = PlantCalls(*parts)
        else:
            channels = plant.inputs.values, plant.outputs.values, np.zeros(len(plant.flags), np.bool_)
            own = self._python(*channels, do_step=self._call(_DO_STEP, self._step))
            self.calls = PlantCalls(own, self._setter(effectiveness, 1.0), self._setter(LOSSES, 0.0))
        if isinstance(plant, Plant):
            for call, names, needed in (
                (self.calls.effectiveness, effectiveness, scenario.failures),
                (self.calls.losses, LOSSES, scenario.outages),
            ):
                if needed:
                    call.inputs[:] = [plant[name] for name in names]

    def _setter(self, names: Sequence[str], start: float) -> Native:
        """Return calls that set parameters by name, one at a time as they change."""
        values = np.full(len(names), start)
        sent = values.copy()

        def write(*_: object) -> None:
            changed = np.flatnonzero(values != sent).tolist()
            sent[:] = values
            self._plant.set({names[i]: float(values[i]) for i in changed})

        return self._python(values, np.zeros(0), np.zeros(0, np.bool_), set_values=self._call(_TRANSFER, write))

    @staticmethod
    def _python(inputs: Array, outputs: Array, flags: Any, set_values: int = 0, do_step: int = 0) -> Native:
        none = np.zeros(0, np.uint32)
        return Native(0, set_values, 0, do_step, none, inputs, none, outputs, np.zeros(4, np.int64), 0, none, flags)

    def _call(self, kinds: tuple[Any, ...], function: Callable[..., None]) -> int:
        """Return the address of a C function that calls a Python one, and reports its error as an FMU's."""

        def guarded(*arguments: object) -> int:
            try:
                function(*arguments)
            except BaseException as error:  # noqa: BLE001 -- C cannot pass it on; `raise_failure` does
                self._raised = error
                return _FATAL
            return 0

        callback = ctypes.PYFUNCTYPE(ctypes.c_int, *kinds)(guarded)
        self._kept.append(callback)
        return ctypes.cast(callback, ctypes.c_void_p).value or 0

    def _step(self, _: object, __: object, step: float, *___: object) -> None:
        self._plant.step(step)
        if len(self._plant.flags):
            self.calls.native.flags[:] = self._plant.read_flags()

    def prepare_steps(self, step: float) -> None:
        """Raise an error if an FMU cannot make steps of `step` seconds, for example because it is closed."""
        if self.native:
            self._plant.prepare_steps(step)  # type: ignore[attr-defined]

    def count_steps(self, n: int) -> None:
        """Tell an FMU how many steps were done."""
        if self.native:
            self._plant.count_steps(n)  # type: ignore[attr-defined]

    def raise_failure(self) -> NoReturn:
        """Raise the error of the step that failed."""
        if self._raised is not None:
            raise self._raised
        assert isinstance(self._plant, Plant)
        self._plant.raise_failure(ended=bool(self.calls.native.results[1]))


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
