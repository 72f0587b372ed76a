"""Settings: numbers of a scenario that can be changed during a run, such as gains, regions and limits."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from controller import LAWS, ControllerError
from controller.regions import Region
from controller.regions.shape import Shape
from cosim.errors import CommandError
from cosim.scenario.scenario import Scenario
from cosim.scenario.toml_file import current_name
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
    """A setting and its present value."""

    key: str  # key of the scenario, as for `cosim run --set`
    unit: str
    value: float


class LiveSettings:
    """The present settings; each change is checked before it is applied."""

    # They depend on the scenario and the sequence of changes alone.

    def __init__(self, scenario: Scenario) -> None:
        self._law = scenario.law.name
        self.gains: Any = scenario.law.gains  # none of a custom law
        known = [secondary.region for secondary in scenario.regions if not secondary.is_dynamic]
        self._regions: dict[str, Region] = {region.name: region for region in known}
        self.shapes: dict[str, Shape] = {"goal": scenario.goal, **{region.name: region.shape for region in known}}
        self._numbers: dict[str, float] = {f"regions.{region.name}.gain": region.gain for region in known}
        self._units: dict[str, str] = {}
        self._ranges: dict[str, tuple[float, float]] = {}
        self._add("arbiter.ramp", "m", scenario.arbiter.ramp, 0.0, _GREATEST_RAMP)
        self._add_limits(scenario)
        if scenario.commands.enabled:
            for name, (unit, minimum, maximum) in _COMMAND_SETTINGS.items():
                self._add(f"commands.{name}", unit, getattr(scenario.commands, name), minimum, maximum)

    def _add(self, key: str, unit: str, value: float, minimum: float, maximum: float) -> None:
        self._numbers[key] = min(max(value, minimum), maximum)
        self._units[key], self._ranges[key] = unit, (minimum, maximum)

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
        for key, value in self._numbers.items():
            yield Setting(key, self._units.get(key, ""), value)
        for name, shape in self.shapes.items():
            where = "goal" if name == "goal" else f"regions.{name}.shape"
            for field in dataclasses.fields(shape):  # type: ignore[arg-type]
                value = getattr(shape, field.name)
                if isinstance(value, tuple):
                    for i, number in enumerate(value):
                        if isinstance(number, float):
                            yield Setting(f"{where}.{field.name}.{i}", "", number)
                else:
                    yield Setting(f"{where}.{field.name}", "", float(value))

    def __getitem__(self, key: str) -> float:
        """Return the present value of a setting that is neither a law's gain nor part of a shape."""
        return self._numbers[key]

    def change(self, key: str, value: float) -> None:
        """Change the value of a setting."""
        try:
            if key.startswith("law.gains."):
                name = key.removeprefix("law.gains.")
                if name not in self.gains._fields:
                    raise CommandError(f"{key} is no setting")
                self.gains = LAWS[self._law].validate(self.gains._replace(**{name: value}))
            elif key in self._numbers:
                self._change_number(key, value)
            else:
                self._change_shape(key, value)
        except ControllerError as error:
            raise CommandError(f"{key}: {error}") from error

    def _change_number(self, key: str, value: float) -> None:
        if key in self._ranges:
            minimum, maximum = self._ranges[key]
            if not minimum <= value <= maximum:
                raise CommandError(f"{key} is {value:g}, expected {minimum:g} to {maximum:g}")
        else:  # regions.NAME.gain, which the region itself checks
            name = key.removeprefix("regions.").removesuffix(".gain")
            self._regions[name] = dataclasses.replace(self._regions[name], gain=value)
        self._numbers[key] = value

    def _change_shape(self, key: str, value: float) -> None:
        name, field, index = self._part(key)
        shape = self.shapes[name]
        new: Any = value
        if index is not None:
            numbers = list(getattr(shape, field))
            numbers[index] = value
            new = tuple(numbers)
        self.shapes[name] = dataclasses.replace(shape, **{field: new})  # type: ignore[type-var]

    def region_of(self, key: str) -> str | None:
        """Return the region, or ``"goal"``, that the setting `key` belongs to; None if it belongs to none."""
        if key.startswith("regions.") and key.endswith(".gain") and key in self._numbers:
            return key.removeprefix("regions.").removesuffix(".gain")
        try:
            return self._part(key)[0]
        except CommandError:
            return None

    def _part(self, key: str) -> tuple[str, str, int | None]:
        """Split a key of a shape into region, field of the shape, and index in that field (None for a scalar)."""
        for name, shape in self.shapes.items():
            where = "goal." if name == "goal" else f"regions.{name}.shape."
            if not key.startswith(where):
                continue
            field, _, rest = key.removeprefix(where).partition(".")
            field = current_name(dict.fromkeys(_fields(shape)), field)
            value = getattr(shape, field, None) if field in _fields(shape) else None
            if isinstance(value, float) and not rest:
                return name, field, None
            numbers = value if isinstance(value, tuple) else ()
            if rest in map(str, range(len(numbers))) and isinstance(numbers[int(rest)], float):
                return name, field, int(rest)
        raise CommandError(f"{key} is no setting")


def _fields(shape: Shape) -> set[str]:
    return {field.name for field in dataclasses.fields(shape)}  # type: ignore[arg-type]
