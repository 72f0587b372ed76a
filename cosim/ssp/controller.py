"""The paper's law of a scenario, with its regions, as a component for FMUs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from controller.regions import Region, pack
from controller.regions.in_c import c_sources
from controller.regions.numbers import constraints
from controller.regions.region_set import PackedRegions, name_of, of_attitude
from cosim.scenario.scenario import Scenario
from cosim.ssp.c_sources import c_files, under_own_names
from cosim.ssp.documentation import contents
from cosim.ssp.shape_parameters import shape_numbers
from plant_fmu import quantities as q
from plant_fmu.compiling.sources import plant_sources
from plant_fmu.component import Component
from plant_fmu.quantities import Quantity
from plant_fmu.variables import AXES, FORCES, VELOCITIES, Role, Variable

_WORDS = """A pose and the weights of the criteria go in; the body wrench of the paper's law, and to what degree
each criterion asks for attention, come out. The law is that of Ismail and Dunnigan, equations (16) to (29); a
region's value g is at most 0 where it is satisfied.

Everything is worked out in a step, from the inputs at its beginning; before the first step all outputs are 0.
The law runs once in each time.control, counted from the start, and its wrench holds until it runs again;
memberships, values and clearances are those of each step. While position, quaternion and velocity are all 0, as
some masters leave them in their first step, the controller takes the initial state of its parameters; a
quaternion of zeros alone is read as identity.

Numbers of shapes are those that the shape works with: unit vectors and rotation matrices must stay such."""

_POSITIVE = Quantity("", 1e-9, 1e9)
_PERIOD = Quantity("s", 1e-6, 1e6)
# units of k_p1 and sigma_p follow that of g of the goal, with its gradient
_UNITS_BY_GOAL = {"m2": ("N/m3", "1/(m2.s)"), "m": ("N/m", "1/s"), "": ("N.m", "m2/s")}
_GAIN_UNITS = {"m2": "N/m2", "m": "N/m", "": "N", "rad": "N/rad"}


def controller_component(scenario: Scenario) -> Component:
    """Return the controller of a scenario.

    Parameters
    ----------
    scenario : Scenario
        Its law is the printed one; nothing of it is streamed.

    Returns
    -------
    Component
        Without states, for co-simulation.
    """
    regions = [scenario.goal_region, *(secondary.region for secondary in scenario.regions)]
    criteria = [0, *scenario.criterion_places]
    packed = pack(regions)
    rows = tuple(_variables(scenario, regions))
    return Component(
        name="controller",
        description=f"Printed law of the scenario: {scenario.title}",
        variables=rows,
        sources=_sources(_scene(regions, packed, criteria)),
        contents=lambda fmi: contents("Controller", _WORDS, rows, fmi),
        constants={
            "N_REGIONS": len(scenario.regions),
            "N_NUMBERS": packed.numbers.size,
            "N_CRITERIA": len(scenario.criteria),
        },
        stop_time=scenario.time.duration,
        step=scenario.time.step,
    )


def prefixes(regions: Sequence[Region]) -> list[str]:
    """Return what the variables of each region begin with.

    Parameters
    ----------
    regions : sequence of Region
        The goal first.

    Returns
    -------
    list of str
        In FMI's structured naming a name has letters, digits and underscores.
    """
    found = ["goal"]
    for region in regions[1:]:
        name = re.sub(r"\W", "_", region.name, flags=re.ASCII)
        name = f"regions.{name if not name[0].isdigit() else '_' + name}"
        while name in found:
            name += "_"
        found.append(name)
    return found


def _sources(scene: str) -> dict[str, bytes]:
    return {
        **c_files("cosim.ssp", "csrc/controller"),
        **under_own_names(c_sources()),
        "ticks.h": c_files("cosim.ssp", "csrc")["ticks.h"],
        "real.h": plant_sources()["real.h"],
        "scene.h": scene.encode(),
    }


def _scene(regions: Sequence[Region], packed: PackedRegions, criteria: Sequence[int]) -> str:
    """Return ``scene.h``: what of the regions is no parameter."""
    names = [f'"{prefix}"' for prefix in prefixes(regions)]
    rows: dict[str, Sequence[object]] = {
        "KINDS": [f"SHAPE_{name_of(region.shape).upper()}" for region in regions],
        "SIGNS": packed.signs.tolist(),
        "OFFSETS": packed.offsets.tolist(),
        "CRITERIA": criteria,
        "NAMES": names,
        "CONSTRAINTS": [*_constraints(regions, packed), "{0}"],
    }
    lines = (f"#define REGION_{name} {{{', '.join(map(str, values))}}}" for name, values in rows.items())
    return "\n".join(["/* Regions of the scene, the goal first: generated. */", *lines, ""])


def _constraints(regions: Sequence[Region], packed: PackedRegions) -> Iterator[str]:
    """Yield what must hold among the numbers of shapes, a ``Constraint`` of C each."""
    for i, region in enumerate(regions):
        offset = int(packed.offsets[i])
        for what, place, other, fault in constraints(region.shape.numbers()):
            more = offset + other if what == "above" else other
            yield f'{{HOLDS_{what.upper()}, {i}, {offset + place}, {more}, "{fault}"}}'


def _variables(scenario: Scenario, regions: Sequence[Region]) -> Iterator[Variable]:
    yield Variable("time", "time", "time", q.TIME, "Simulated time")
    yield from _motion("", "input", "inputs.motion", [0.0] * 13, "The vehicle's")
    for i, name in enumerate(scenario.criterion_names):
        yield Variable(f"weight.{name}", "input", f"inputs.weights[{i}]", q.FRACTION, f"Weight of criterion {name}")
    yield from _outputs(scenario, regions)
    yield from _parameters(scenario)
    yield from _of_regions(regions)


def _motion(prefix: str, role: Role, member: str, start: Sequence[float], whose: str) -> Iterator[Variable]:
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
        yield Variable(f"{prefix}{name}", role, f"{member}[{i}]", quantity, f"{whose} {description}", start[i])


def _outputs(scenario: Scenario, regions: Sequence[Region]) -> Iterator[Variable]:
    def output(name: str, member: str, unit: str, description: str) -> Variable:
        return Variable(name, "output", f"outputs.{member}", q.unbounded(unit), description)

    for i, name in enumerate(FORCES):
        what = f"{'Force along' if i < 3 else 'Moment about'} body {AXES[i % 3]} that the law asks for"
        yield output(f"wrench.{name}", f"wrench[{i}]", "N" if i < 3 else "N.m", what)
    for i, name in enumerate(scenario.criterion_names):
        what = f"Degree to which criterion {name} asks for attention"
        yield output(f"membership.{name}", f"memberships[{i}]", "", what)
    for i in range(4):
        what = f"Estimate of phi {i + 1} in (12), with which the wrench was made"
        yield output(f"estimate.phi{i + 1}", f"estimate[{i}]", "N.m" if i else "N", what)
    for i, (region, prefix) in enumerate(zip(regions, prefixes(regions), strict=True)):
        what = f"g of {region.name}, above 0 where violated"
        yield output(f"{prefix}.value", f"values[{i}]", region.shape.unit, what)
        unit, kind = ("rad", "Angle left within") if of_attitude(region.shape) else ("m", "Distance to the surface of")
        yield output(f"{prefix}.clearance", f"clearances[{i}]", unit, f"{kind} {region.name}, below 0 where violated")


def _parameter(name: str, member: str, quantity: Quantity, description: str, start: float) -> Variable:
    return Variable(name, "parameter", f"parameters.{member}", quantity, description, float(start))


def _parameters(scenario: Scenario) -> Iterator[Variable]:
    of_p, of_sigma = _UNITS_BY_GOAL[scenario.goal.unit]
    for name, unit, description, positive in (
        ("k_p1", of_p, "Gain on the primary region (16)", True),
        ("k_p2", "N.m", "Gain on attitude (26)", False),
        ("k_q", "", "Gain of (22), (26), which cancels in (25) and (27)", True),
        ("k_v1", "N.s/m", "Gain on linear velocity (26)", False),
        ("k_v2", "N.m.s/rad", "Gain on angular velocity (26)", False),
        ("sigma_p", of_sigma, "Share of position in the adaptation (27)", False),
        ("sigma_a", "rad/s", "Share of attitude in the adaptation (27)", False),
        ("gamma", "s2/kg", "Gamma = gamma I (27): the greater, the slower the adaptation", True),
    ):
        start = getattr(scenario.law.gains, name)
        quantity = Quantity(unit, _POSITIVE.minimum if positive else 0.0, _POSITIVE.maximum, is_gain=True)
        yield _parameter(f"law.gains.{name}", f"gains.{name}", quantity, description, start)
    for i, start in enumerate(scenario.law.desired_quaternion):
        description = f"Attitude to be kept, as unit quaternion from body to world, part {i}"
        yield _parameter(f"law.desired_quaternion.e{i}", f"desired[{i}]", q.QUATERNION, description, start)
    description = "Width over which a membership falls from 1 to 0 outside a region [m], rad for regions of attitude"
    yield _parameter("arbiter.ramp", "ramp", Quantity("", 0.0, 1e6), description, scenario.arbiter.ramp)
    yield _parameter("time.control", "period", _PERIOD, "Period of the law", scenario.time.control)
    initial = scenario.initial
    numbers = [*initial.position, *initial.quaternion, *initial.velocity]
    yield from _motion("initial.", "parameter", "parameters.start", numbers, "At the start:")


def _of_regions(regions: Sequence[Region]) -> Iterator[Variable]:
    number = 0
    for i, (region, prefix) in enumerate(zip(regions, prefixes(regions), strict=True)):
        if i:
            quantity = Quantity(_GAIN_UNITS[region.shape.unit], 0.0, 1e9)
            yield _parameter(f"{prefix}.gain", f"alphas[{i}]", quantity, f"Gain of {region.name}", region.gain)
        for j, axis in enumerate(AXES):
            description = f"How fast {region.name} moves, {('north', 'east', 'down')[j]}"
            yield _parameter(
                f"{prefix}.velocity.{axis}", f"velocities[{i}][{j}]", q.SPEED, description, region.velocity[j]
            )
        for (name, quantity), start in zip(shape_numbers(region.shape), region.shape.packed(), strict=True):
            description = f"Of the shape of {region.name}, where it is at time 0"
            yield _parameter(f"{prefix}.shape.{name}", f"numbers[{number}]", quantity, description, start)
            number += 1
