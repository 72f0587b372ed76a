"""C code of a scenario's loop: translated functions, places of their arrays, and constants of the scene."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from controller import LawError
from controller.law import CompiledLaw
from controller.quaternion import from_axis_angle
from controller.regions import Region
from controller.regions.numbers import constraints
from controller.translator.operands import number
from controller.translator.program import Program
from controller.translator.types import type_of
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import Scenario
from cosim.ssp.loop import Loop
from cosim.ssp.memory import Memory, Named, arrays_of

_AXIS = np.array([0.48, 0.6, 0.64])  # rotation axis of an attitude that no law has initially
_NONE = -1  # place of an array that a law does not have


@dataclass(frozen=True)
class Translated:
    """C files, with the constants of their header."""

    files: dict[str, str]  # C files and headers by name
    constants: dict[str, int]  # sizes, and as AT_ the index of each array in the model's numbers


def translate_loop(scenario: Scenario, regions: Sequence[Region], names: Sequence[str]) -> Translated:
    """Translate the loop of a scenario."""
    loop = Loop(scenario)
    memory = Memory()
    indices = _index_arrays(loop, memory, scenario)
    program, declared, calls = Program(), [], []
    for name, (function, arguments) in loop.functions.items():
        program.export(f"translated_{name}", function, tuple(map(type_of, arguments)))
        given = tuple(Named(a, "parameters.gains") if a is loop.law.gains else a for a in arguments)
        calls.append(memory.call(program, name, given))
        declared.append(f"void translated_{name}(const void *words);\nvoid control_{name}(Model *m);\n")
    code = "\n".join([
        '#include "model.h"\n#include "loop.h"\n',
        program.text(),
        *memory.definitions,
        *memory.starts(),
        _REWIND,
        *calls,
    ])  # fmt: skip
    header = "\n".join([
        "/* The loop of a scenario: generated. */",
        "#ifndef LOOP_H",
        "#define LOOP_H",
        "",
        '#include "model.h"',
        "",
        "/* Puts all but parameters to what it is at the beginning. */\nvoid control_rewind(Model *m);\n",
        *declared,
        *(f"#define {key} {value}" for key, value in _scene(loop, memory, scenario, regions, names).items()),
        "",
        "#endif",
        "",
    ])  # fmt: skip
    constants = {
        **indices,
        **memory.sizes(),
        "N_GAINS": max(len(loop.law.gains), 1),
        "N_THRUSTERS": scenario.vehicle.n_thrusters,
        "N_REGIONS": len(scenario.regions),
        "N_CRITERIA": len(scenario.criteria),
        "N_RULE_INPUTS": loop.signals.inputs.size,
    }
    return Translated({"loop.c": code, "loop.h": header}, constants)


_REWIND = """\
void control_rewind(Model *m)
{
    memcpy(m->numbers + N_PARAMETERS, FIRST_NUMBERS + N_PARAMETERS, sizeof m->numbers - N_PARAMETERS * sizeof(double));
    memcpy(m->integers, FIRST_INTEGERS, sizeof m->integers);
    memcpy(m->words, FIRST_WORDS, sizeof m->words);
    memcpy(m->flags, FIRST_FLAGS, sizeof m->flags);
}
"""


def _index_arrays(loop: Loop, memory: Memory, scenario: Scenario) -> dict[str, int]:
    """Index all arrays: parameters, then variables; other arrays of regions, inputs and allocation are constants."""
    keep, (goal, regions), law = memory.keep, (loop.setup.goal, loop.setup.regions), loop.law
    desired, period = _desired(law, scenario), getattr(law.memory, "period", None)
    ramps, state, inputs = loop.setup.inputs.memberships.ramps, loop.state, loop.setup.inputs
    expects = law.expected if any(law.expected is array for array in arrays_of(law.memory)) else None
    navigates = loop.setup.through_sensors
    indices = {
        "AT_GOAL_NUMBERS": keep(goal.numbers),
        "AT_REGION_NUMBERS": keep(regions.numbers),
        "AT_REGION_GAINS": keep(regions.gains),
        "AT_GOAL_VELOCITIES": keep(goal.velocities),
        "AT_REGION_VELOCITIES": keep(regions.velocities),
        "AT_DESIRED": keep(desired),
        "N_PARAMETERS": memory.size,  # before any variable
        "AT_PERIOD": _NONE if period is None else keep(period),
        "AT_RAMPS": keep(ramps),
        "AT_POSITION": keep(state.position),
        "AT_QUATERNION": keep(state.quaternion),
        "AT_VELOCITY": keep(state.velocity_body),
        "AT_HEALTH": keep(state.thruster_health),
        "AT_EXPECTED": keep(loop.expected),
        "AT_LAW_EXPECTED": _NONE if expects is None else keep(expects),
        "AT_ESTIMATE": keep(law.estimate),
        "AT_NOW": keep(loop.now),
        "AT_STAGE": keep(loop.stage),
        "AT_WEIGHTS": keep(loop.weights),
        "AT_WRENCH": keep(loop.wrench),
        "AT_THRUSTS": keep(loop.thrusts),
        "AT_GOAL_SHIFTS": keep(goal.shifts),
        "AT_REGION_SHIFTS": keep(regions.shifts),
        "AT_VALUES": keep(loop.evaluation.values),
        "AT_CLEARANCES": keep(loop.evaluation.clearances),
        "AT_MEMBERSHIPS": keep(loop.signals.memberships),
        "AT_RULE_INPUTS": keep(loop.signals.inputs),
        "AT_TRUE_POSITION": keep(loop.true_position),
        "AT_TRUE_QUATERNION": keep(loop.true_quaternion),
        "AT_GOAL_CLEARANCE": keep(loop.goal_clearance),
        "AT_STARTED": keep(loop.navigation.started) if navigates else _NONE,
        "AT_SAMPLES": keep(loop.measurements.values) if navigates else _NONE,
        "AT_SAMPLE_TIMES": keep(loop.measurements.times) if navigates else _NONE,
    }
    for array in arrays_of((law.memory, state)):
        keep(array)
    memory.fix(goal, regions, inputs, loop.allocator)
    return indices


def _desired(law: CompiledLaw, scenario: Scenario) -> np.ndarray:
    """Return the array in a law's memory that `set_attitude` writes."""
    other = law_of(scenario)
    before = [array.copy() for array in arrays_of(other.memory)]
    other.set_attitude(from_axis_angle(_AXIS, 2.0))
    for old, new, own in zip(before, arrays_of(other.memory), arrays_of(law.memory), strict=True):
        if not np.array_equal(old, new, equal_nan=old.dtype == float):
            return own
    raise LawError(f"law {law.name} keeps no attitude that could be another, expected one that `set_attitude` sets")


def _scene(
    loop: Loop, memory: Memory, scenario: Scenario, regions: Sequence[Region], names: Sequence[str]
) -> dict[str, str]:
    """Return the constants of the scene that are not parameters, as C macros."""
    setup, sensing = loop.setup, scenario.sensing
    follows = setup.inputs.memberships.follows
    ramps = memory.keep(setup.inputs.memberships.ramps)
    failures = zip(setup.failed, setup.failure_steps, setup.remaining, strict=True)
    outages = zip(setup.outage_steps, setup.outage_sensors, setup.outage_losses, strict=True)
    goal_places = [[0.0, 0.0, 0.0], *setup.goal_places.tolist()]
    deviations = [sensing.position_noise] * 3 + [sensing.velocity_noise] * 3
    return {
        "REGION_OFFSETS": _braced([0, *setup.regions.offsets]),
        "REGION_CRITERIA": _braced([0, *scenario.criterion_places]),
        "REGION_NAMES": _braced(f'"{name}"' for name in names),
        "REGION_CONSTRAINTS": _braced([*_constraints(regions), "{HOLDS_UNIT, 0, 0, 0, NULL}"]),
        "RAMP_PLACES": _braced([*(ramps + int(i) for i in np.flatnonzero(follows)), -1]),
        "SCENE_STEP": number(scenario.time.step),
        "SCENE_FAILURES": _braced([
            *(_braced([number(at * setup.step), thruster, number(left)]) for thruster, at, left in failures),
            "{0.0, -1, 0.0}",
        ]),
        "SCENE_REPORTS_FAILURES": str(int(setup.report_failures)),
        "SCENE_STAGES": str(len(loop.allocator.lower)),
        "SCENE_OUTAGES": _braced([
            *(_braced([number(at * setup.step), sensor, number(float(loss == 1.0))]) for at, sensor, loss in outages),
            "{INFINITY, 0, 0.0}",
        ]),
        "SCENE_GOAL_PLACES": _braced(_braced(map(number, place)) for place in goal_places),
        "SCENE_N_PLACES": str(len(goal_places) - 1),
        "SCENE_STAY": number(scenario.goal_stay if math.isfinite(scenario.goal_stay) else 0.0),
        "SCENE_SEED": str(sensing.seed % 2**31),
        "SCENE_DEVIATIONS": _braced(map(number, deviations)),
        "SCENE_DEAD_FROM": number(setup.dead_from),
        "SCENE_DEAD_UNTIL": number(setup.dead_until),
        "SCENE_FROZEN": str(int(setup.frozen)),
        "SCENE_EXPECTS": str(int(not setup.exact)),
        "SCENE_SENSORS": str(int(setup.through_sensors)),
        "SCENE_ALLOCATES": str(int(loop.allocates)),
    }  # fmt: skip


def _constraints(regions: Sequence[Region]) -> Iterator[str]:
    """Yield the constraints among the numbers of shapes, as C initializers of ``Constraint``."""
    for i, region in enumerate(regions):
        for what, place, other, fault in constraints(region.shape.numbers()):
            yield f'{{HOLDS_{what.upper()}, {i}, {place}, {other}, "{fault}"}}'


def _braced(values: object) -> str:
    return f"{{{', '.join(map(str, values))}}}"  # type: ignore[call-overload]
