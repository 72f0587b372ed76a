"""Settings: numbers of a scenario that can be changed during a run, such as gains, regions and limits."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from controller import LAWS, ControllerError
from controller.regions.shape import Shape
from cosim.errors import CommandError
from cosim.scenario.scenario import Scenario
from plant_fmu.variables import variables

_GREATEST_RAMP = 1e3  # m, maximum value of ``arbiter.ramp``
_LEAST_RADIUS = 1e-2  # m, minimum radius of obstacles and of the target while holding
_COMMAND_SETTINGS = {  # unit, minimum, maximum
    "obstacle_radius": ("m", _LEAST_RADIUS, 1e3),
    "hold_radius": ("m", _LEAST_RADIUS, 1e3),
    "surface_depth": ("m", 0.0, 1e3),
    "pilot_gain": ("", 0.0, 1.0),
}


@dataclass(frozen=True)
class Setting:
    """A setting, its present value and its range."""

    key: str  # key of the scenario, as for `cosim run --set`
    unit: str
    value: float
    minimum: float = -math.inf
    maximum: float = math.inf


class LiveSettings:
    """The present settings; each change is checked before it is applied."""

    # They depend on the scenario and the sequence of changes alone.

    def __init__(self, scenario: Scenario) -> None:
        self._law = scenario.law.name
        self.gains: Any = scenario.law.gains  # none of a custom law
        known = [secondary.region for secondary in scenario.regions if not secondary.is_dynamic]
        self.shapes: dict[str, Shape] = {"goal": scenario.goal, **{region.name: region.shape for region in known}}
        self._numbers: dict[str, Setting] = {}
        for region in known:
            self._add(f"regions.{region.name}.gain", "", region.gain, 0.0, math.inf)
        self._add("arbiter.ramp", "m", scenario.arbiter.ramp, 0.0, _GREATEST_RAMP)
        self._add_limits(scenario)
        if scenario.commands.enabled:
            for name, (unit, minimum, maximum) in _COMMAND_SETTINGS.items():
                self._add(f"commands.{name}", unit, getattr(scenario.commands, name), minimum, maximum)
        # region, field of its shape, and index in that field, None for a scalar, of each key of a shape
        self._of_shapes = {key: item for name, shape in self.shapes.items() for key, item in _keys_of(name, shape)}

    def _add(self, key: str, unit: str, value: float, minimum: float, maximum: float) -> None:
        self._numbers[key] = Setting(key, unit, min(max(value, minimum), maximum), minimum, maximum)

    def _add_limits(self, scenario: Scenario) -> None:
        """Add the limits of the actuation: of the direct wrench, or of each thruster."""
        table = {v.name: v for v in variables(scenario.vehicle)}
        wrench = {"wrench_force_limit": scenario.limit.force, "wrench_time_constant": scenario.limit.time_constant}
        keys = {"limit.force": "wrench_force_limit", "limit.time_constant": "wrench_time_constant"}
        if scenario.actuation.through == "thrusters":
            each = range(1, scenario.vehicle.n_thrusters + 1)
            names = [f"thrust_{end}[{i}]" for end in ("min", "max") for i in each]
            keys = {f"plant.parameters.{name}": name for name in names}
        for key, name in keys.items():
            variable = table[name]
            value = float(scenario.plant.parameters.get(name, wrench.get(name, variable.start)))
            minimum, maximum = variable.quantity.minimum, variable.quantity.maximum
            # 0 stays between a thruster's limits
            minimum = 0.0 if name.startswith("thrust_max") else minimum
            maximum = 0.0 if name.startswith("thrust_min") else maximum
            self._add(key, variable.quantity.unit, value, minimum, maximum)
        self.of_plant = keys  # parameter of the FMU for each key

    def __iter__(self) -> Iterator[Setting]:
        """Iterate over all settings, always in the same order."""
        for name in self.gains._fields:
            yield Setting(f"law.gains.{name}", "", float(getattr(self.gains, name)))
        yield from self._numbers.values()
        for key, (name, field, index) in self._of_shapes.items():
            value = getattr(self.shapes[name], field)
            yield Setting(key, "", float(value if index is None else value[index]))

    def __getitem__(self, key: str) -> float:
        """Return the present value of a setting that is neither a law's gain nor part of a shape."""
        return self._numbers[key].value

    def change(self, key: str, value: float) -> None:
        """Change the value of a setting."""
        name = key.removeprefix("law.gains.")
        try:
            if name != key and name in self.gains._fields:
                self.gains = LAWS[self._law].validate(self.gains._replace(**{name: value}))
            elif key in self._numbers:
                setting = self._numbers[key]
                if not setting.minimum <= value <= setting.maximum:
                    raise CommandError(f"{key} is {value:g}, expected {setting.minimum:g} to {setting.maximum:g}")
                self._numbers[key] = dataclasses.replace(setting, value=value)
            else:
                self._change_shape(key, value)
        except ControllerError as error:
            raise CommandError(f"{key}: {error}") from error

    def _change_shape(self, key: str, value: float) -> None:
        item = self._item_of_shape(key)
        if item is None:
            raise CommandError(f"{key} is no setting")
        name, field, index = item
        new: Any = value
        if index is not None:
            numbers = getattr(self.shapes[name], field)
            new = (*numbers[:index], value, *numbers[index + 1 :])
        self.shapes[name] = dataclasses.replace(self.shapes[name], **{field: new})  # type: ignore[type-var]

    def region_of(self, key: str) -> str | None:
        """Return the region, or ``"goal"``, that the setting `key` belongs to; None if it belongs to none."""
        if key.startswith("regions.") and key in self._numbers:
            return key.removeprefix("regions.").removesuffix(".gain")
        item = self._item_of_shape(key)
        return item[0] if item else None

    def _item_of_shape(self, key: str) -> tuple[str, str, int | None] | None:
        return self._of_shapes.get(key) or self._of_shapes.get(re.sub(r"\.centre(\.\d)$", r".center\1", key))


def _keys_of(name: str, shape: Shape) -> Iterator[tuple[str, tuple[str, str, int | None]]]:
    """Yield the key of each number of a region's shape, with the region, the field and the index in it."""
    where = "goal" if name == "goal" else f"regions.{name}.shape"
    for field in dataclasses.fields(shape):  # type: ignore[arg-type]
        value = getattr(shape, field.name)
        if isinstance(value, tuple):
            numbers = (i for i, number in enumerate(value) if isinstance(number, float))
            yield from ((f"{where}.{field.name}.{i}", (name, field.name, i)) for i in numbers)
        else:
            yield f"{where}.{field.name}", (name, field.name, None)
