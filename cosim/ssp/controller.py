"""Sensing, regions and law of a scenario as a component for FMUs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from controller import CompiledLaw, LawError
from controller.navigation.measurements import SENSORS
from controller.regions import Region
from controller.regions.region_set import of_attitude
from cosim.scenario.keys import comments, unit_of_gain
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array
from cosim.ssp.c_sources import c_files, under_own_names
from cosim.ssp.controller_code import translate_controller
from cosim.ssp.documentation import contents
from cosim.ssp.loop import Loop
from plant_fmu import quantities as q
from plant_fmu.compiling.sources import plant_sources
from plant_fmu.component import Component
from plant_fmu.quantities import UNITS, Quantity
from plant_fmu.variables import AXES, FORCES, VELOCITIES, Role, Variable, variables

_WORDS = """What the vehicle does and the weights of the criteria go in; the forces of the law, and to what degree each
criterion asks for attention, come out. A region's value g is at most 0 where it is satisfied. The functions are those
of the Python package, translated to C.

Everything is worked out in a step, from the inputs at its beginning; before the first step all outputs are 0.
The law runs once in each time.control, counted from the start, and its forces hold until it runs again;
memberships, values and clearances are those of each step, at the pose that the arbiter decides by. While position,
quaternion and velocity are all 0, as some masters leave them in their first step, the controller takes the initial
state of its parameters; a quaternion of zeros alone is read as identity. Noise of what is sensed, and failures of
thrusters, are those of the scenario; they are no parameters.

Numbers of shapes are those that the shape works with: unit vectors and rotation matrices must stay such."""

_OF_LAW = ("wrench.", "thrust[", "estimate.", "law.gains.")  # beginnings of the names of variables of a law
_MIN_GAIN, _MAX_GAIN = 1e-9, 1e9  # bounds of gains
_PERIOD = Quantity("s", 1e-6, 1e6)  # period of the law
# units of gains by the unit of the goal's g; the gains are documented for m2
_UNITS_BY_GOAL = {
    "N/m3": {"m2": "N/m3", "m": "N/m", "": "N.m"},
    "1/(m2.s)": {"m2": "1/(m2.s)", "m": "1/s", "": "m2/s"},
}
_GAIN_UNITS = {"m2": "N/m2", "m": "N/m", "": "N", "rad": "N/rad"}


def controller_component(scenario: Scenario, has_law: bool = True) -> Component:
    """Make the component of a scenario's controller; one that has no law senses and evaluates regions alone."""
    regions = [scenario.goal_region, *(secondary.region for secondary in scenario.regions)]
    loop = Loop(scenario)
    files = translate_controller(loop, scenario, regions, prefixes(regions))
    rows = tuple(v for v in _variables(scenario, regions, loop) if has_law or not v.name.startswith(_OF_LAW))
    return Component(
        name="controller",
        description=f"{f'Law {scenario.law.name}' if has_law else 'Regions'} of the scenario: {scenario.title}",
        variables=rows,
        sources=_sources(files),
        contents=lambda fmi: contents("Controller", _WORDS, rows, fmi),
        constants=loop.constants | loop.memory.sizes(),
        stop_time=scenario.time.duration,
        step=scenario.time.step,
    )


def prefixes(regions: Sequence[Region]) -> list[str]:
    """Return the prefix of each region's variables."""
    names = ["goal"]
    for region in regions[1:]:
        name = re.sub(r"\W", "_", region.name, flags=re.ASCII)
        name = f"regions.{name if not name[0].isdigit() else '_' + name}"
        while name in names:
            name += "_"
        names.append(name)
    return names


def _sources(files: Mapping[str, str]) -> dict[str, bytes]:
    plant = plant_sources()
    return {
        **c_files("cosim.ssp", "csrc/controller"),
        **under_own_names({name: text.encode() for name, text in files.items()}),
        "ticks.h": c_files("cosim.ssp", "csrc")["ticks.h"],
        **{name: plant[name] for name in ("random.c", "random.h", "elementary.c", "elementary.h")},
    }


def _variables(scenario: Scenario, regions: Sequence[Region], loop: Loop) -> Iterator[Variable]:
    yield Variable("time", "time", "time", q.TIME, "Simulated time")
    yield from _motion("", "input", loop, loop.inputs.motion, [0.0] * 13, "The vehicle's")
    if scenario.sensing.through == "sensors":
        yield from _samples(scenario, loop)
    for i, name in enumerate(scenario.criterion_names):
        yield Variable(
            f"weight.{name}", "input", loop.member(loop.data.by_criterion, i), q.FRACTION, f"Weight of criterion {name}"
        )
    yield from _outputs(scenario, regions, loop)
    yield from _parameters(scenario, loop)
    yield from _region_parameters(regions, loop)


def _samples(scenario: Scenario, loop: Loop) -> Iterator[Variable]:
    """Yield an input for each sensor output of the plant."""
    sensor_outputs = [v for v in variables(scenario.vehicle) if v.name.startswith("measured.")]
    values = [v for v in sensor_outputs if not v.name.startswith("measured.time.")]
    for array, rows in ((loop.inputs.samples, values), (loop.inputs.sample_times, sensor_outputs[len(values) :])):
        for i, v in enumerate(rows):
            quantity = Quantity(v.quantity.unit, -1e15, 1e15)
            yield Variable(v.name, "input", loop.member(array, i), quantity, v.description)


def _motion(
    prefix: str, role: Role, loop: Loop, array: Array, start: Sequence[float], whose: str
) -> Iterator[Variable]:
    where = ("north", "east", "down")
    names = [
        *((f"position.{AXES[i]}", q.LENGTH, f"position, {where[i]}, world frame NED") for i in range(3)),
        *((f"quaternion.e{i}", q.QUATERNION, f"unit quaternion from body to world, part {i}") for i in range(4)),
        *(
            (f"velocity.{name}", q.SPEED if i < 3 else q.ANGULAR_SPEED, f"velocity {name} over ground, body frame")
            for i, name in enumerate(VELOCITIES)
        ),
    ]
    for i, (name, quantity, description) in enumerate(names):
        yield Variable(f"{prefix}{name}", role, loop.member(array, i), quantity, f"{whose} {description}", start[i])


def _outputs(scenario: Scenario, regions: Sequence[Region], loop: Loop) -> Iterator[Variable]:
    data, out = loop.data, loop.out

    def output(name: str, array: Array, i: int, unit: str, description: str) -> Variable:
        return Variable(name, "output", loop.member(array, i), q.unbounded(unit), description)

    if scenario.actuation.through != "thrusters":  # with thrusters, the wrench would act in addition to their forces
        for i, name in enumerate(FORCES):
            what = f"{'Force along' if i < 3 else 'Moment about'} body {AXES[i % 3]} that the law asks for"
            yield output(f"wrench.{name}", data.command, i, "N" if i < 3 else "N.m", what)
    else:
        for i in range(scenario.vehicle.n_thrusters):
            yield output(f"thrust[{i + 1}]", out.thrusts, i, "N", f"Commanded force of thruster {i + 1}")
    for j in sorted({failure.thruster for failure in scenario.failures if not failure.stuck}):
        what = f"Part of the force of thruster {j} that is lost"
        yield output(f"thrust_failure[{j}]", out.lost, j - 1, "", what)
    for sensor in sorted({outage.sensor for outage in scenario.outages}):
        what = "1 in an outage, in which no samples are given, else 0"
        yield output(f"{sensor}.outage", out.outages, SENSORS.index(sensor), "", what)
    for i, name in enumerate(scenario.criterion_names):
        what = f"Degree to which criterion {name} asks for attention"
        yield output(f"membership.{name}", data.signals.memberships, i, "", what)
    for i, signal in enumerate(scenario.rules.signals):
        unit = signal.unit if signal.unit in UNITS else ""
        yield output(f"arbiter.{signal.name}", data.signals.inputs, i, unit, f"Of the arbiter's rules: {signal.what}")
    for i in range(4):
        what = f"Estimate of phi {i + 1} in (12), with which the forces were made"
        yield output(f"estimate.phi{i + 1}", data.estimate, i, "N.m" if i else "N", what)
    for i, (region, prefix) in enumerate(zip(regions, prefixes(regions), strict=True)):
        what = f"g of {region.name}, above 0 where violated"
        yield output(f"{prefix}.value", out.values, i, region.shape.unit, what)
        unit, kind = ("rad", "Angle left within") if of_attitude(region.shape) else ("m", "Distance to the surface of")
        yield output(f"{prefix}.clearance", out.clearances, i, unit, f"{kind} {region.name}, below 0 where violated")


def _parameter(name: str, member: str, quantity: Quantity, description: str, start: float) -> Variable:
    return Variable(name, "parameter", member, quantity, description, float(start))


def _parameters(scenario: Scenario, loop: Loop) -> Iterator[Variable]:
    law, key_comments = law_of(scenario), comments(scenario.law.name, scenario.vehicle)
    for i, (name, start) in enumerate(law.gains._asdict().items()):
        unit = unit_of_gain(law.name, name).replace(" ", ".")
        unit = _UNITS_BY_GOAL.get(unit, {}).get(scenario.goal.unit, unit)
        minimum = 0.0 if _accepts(law, name, 0.0) else _MIN_GAIN
        maximum = next((x for x in (_MAX_GAIN, 1.0) if _accepts(law, name, x)), max(float(start), minimum))
        quantity = Quantity(unit if unit in UNITS else "", minimum, maximum, is_gain=True)
        description = _without_unit(key_comments.get(f"law.gains.{name}", "")) or f"Gain {name} of the law"
        yield _parameter(f"law.gains.{name}", f"gains[{i}]", quantity, description, start)
    kept = not loop.is_of_mission(loop.desired_quaternion)
    for i, start in enumerate(scenario.law.desired_quaternion if kept else ()):
        description = f"Attitude to be kept, as unit quaternion from body to world, part {i}"
        member = loop.member(loop.desired_quaternion, i)
        yield _parameter(f"law.desired_quaternion.e{i}", member, q.QUATERNION, description, start)
    description = "Width over which a membership falls from 1 to 0 outside a region [m], rad for regions of attitude"
    ramp = Quantity("", 0.0, 1e6)
    yield _parameter("arbiter.ramp", loop.member(loop.ramp), ramp, description, scenario.arbiter.ramp)
    yield _parameter("time.control", loop.member(loop.period), _PERIOD, "Period of the law", scenario.time.control)
    initial = scenario.initial
    numbers = [*initial.position, *initial.quaternion, *initial.velocity]
    yield from _motion("start.", "parameter", loop, loop.inputs.start, numbers, "At the start:")


def _accepts(law: CompiledLaw, gain: str, value: float) -> bool:
    """Return True if a law accepts the value of a gain."""
    try:
        law.validate(law.gains._replace(**{gain: value}))
    except LawError:
        return False
    return True


def _without_unit(comment: str) -> str:
    """Return the comment on a gain without its unit, as a description."""
    words = comment.split(", ", 1)[-1]
    return words[:1].upper() + words[1:]


def _region_parameters(regions: Sequence[Region], loop: Loop) -> Iterator[Variable]:
    for i, (region, prefix) in enumerate(zip(regions, prefixes(regions), strict=True)):
        packed, k = (loop.data.regions, i - 1) if i else (loop.data.goal, 0)
        if i:
            quantity = Quantity(_GAIN_UNITS[region.shape.unit], 0.0, _MAX_GAIN)
            member = loop.member(packed.gains, k)
            yield _parameter(f"{prefix}.gain", member, quantity, f"Gain of {region.name}", region.gain)
        for j, axis in enumerate("" if loop.is_of_mission(packed.velocities) else AXES):
            description = f"How fast {region.name} moves, {('north', 'east', 'down')[j]}"
            member = loop.member(packed.velocities[k], j)
            yield _parameter(f"{prefix}.velocity.{axis}", member, q.SPEED, description, region.velocity[j])
        numbers, first = zip(region.shape.numbers(), region.shape.packed(), strict=True), int(packed.offsets[k])
        for j, ((name, unit, low, high, _), start) in enumerate(
            () if loop.is_of_mission(packed.numbers) else numbers, first
        ):
            description, quantity = f"Of the shape of {region.name}, where it is at time 0", Quantity(unit, low, high)
            yield _parameter(f"{prefix}.shape.{name}", loop.member(packed.numbers, j), quantity, description, start)
