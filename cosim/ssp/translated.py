"""C code of a scenario's controller: translated functions, their arguments, and constants of the scenario."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from controller.regions import Region
from controller.regions.numbers import constraints
from controller.translator.operands import number
from controller.translator.program import Program
from controller.translator.types import type_of
from cosim.scenario.scenario import Scenario
from cosim.ssp.controller_step import step_controller
from cosim.ssp.loop import Loop
from cosim.ssp.memory import Named
from cosim.step.step_model import N_CALLS


def translate_controller(loop: Loop, scenario: Scenario, regions: Sequence[Region], names: Sequence[str]) -> bytes:
    """Return the C code of a controller whose parameters and inputs are the numbers that have a place already."""
    law, data, memory, program = loop.law, loop.data, loop.memory, Program()
    scene = {"N_GIVEN": str(memory.size)} | _scene(loop, scenario, regions, names)
    loop.place_arrays()
    forces = data.command if loop.model.law_gives_wrench else data.thrusts
    decided = data.state, data.goal, data.regions, data.weights, law.gains, law.memory, forces
    # addresses are no part of the model, which FMU states copy
    memory.name(data.calls, f"(int64_t[{N_CALLS}]){{(intptr_t)call_law, (intptr_t)m}}")
    calls = []
    stepped = loop.model, data, loop.inputs, loop.out
    for name, function, arguments in (("law", type(law).function, decided), ("step", step_controller, stepped)):
        program.export(f"translated_{name}", function, tuple(map(type_of, arguments)))
        given = tuple(Named(a, "gains") if a is law.gains else a for a in arguments)
        calls.append(f"static {memory.call(program, name, given)}")
    return "\n".join([
        '/* The controller of a scenario: generated. */\n#include "model.h"\n\nstatic int call_law(void *model);\n',
        program.text(),
        *memory.definitions,
        *memory.starts(),
        *calls,
        *(f"#define {key} {value}" for key, value in scene.items()),
    ]).encode()  # fmt: skip


def _scene(loop: Loop, scenario: Scenario, regions: Sequence[Region], names: Sequence[str]) -> dict[str, str]:
    """Return the constants of the scenario that component.c uses, as C macros."""
    keep, memberships, sensing = loop.memory.keep, loop.model.inputs.memberships, scenario.sensing
    ramps = keep(memberships.ramps) + np.flatnonzero(memberships.follows)
    deviations = [sensing.position_noise] * 3 + [sensing.velocity_noise] * 3
    return {
        "AT_PERIOD": str(keep(loop.period)),
        "AT_RAMP": str(keep(loop.ramp)),
        "AT_NOW": str(keep(loop.data.now)),
        "AT_END": str(keep(loop.inputs.end)),
        "AT_CONTROLS": str(keep(loop.inputs.controls)),
        "AT_NOISE": str(keep(loop.data.noise)),
        "SCENE_CONSTRAINTS": _braced([*_constraints(loop, regions, names), "{HOLDS_UNIT, 0, 0, NULL}"]),
        "SCENE_RAMPS": _braced([*ramps, -1]),
        "SCENE_COUNTERS": _braced(map(_braced, loop.counters())),
        "SCENE_SEED": str(sensing.seed % 2**31),
        "SCENE_DEVIATIONS": _braced(map(number, deviations)),
    }


def _constraints(loop: Loop, regions: Sequence[Region], names: Sequence[str]) -> Iterator[str]:
    """Yield the constraints among the parameters, as C initializers of ``Constraint``."""
    keep, (goal, packed) = loop.memory.keep, (loop.data.goal, loop.data.regions)
    yield f'{{HOLDS_UNIT, {keep(loop.law.desired_quaternion)}, 4, "law.desired_quaternion is not of length 1"}}'
    yield f'{{HOLDS_UNIT, {keep(loop.inputs.start) + 3}, 4, "initial.quaternion is not of length 1"}}'
    for i, (region, name) in enumerate(zip(regions, names, strict=True)):
        first = keep(packed.numbers) + int(packed.offsets[i - 1]) if i else keep(goal.numbers)
        for what, index, other, fault in constraints(region.shape.numbers()):
            more = other + first if what == "above" else other
            yield f'{{HOLDS_{what.upper()}, {first + index}, {more}, "{name}: {fault}"}}'


def _braced(values: Iterable[object]) -> str:
    return f"{{{', '.join(map(str, values))}}}"
