"""C code of the controller FMU: the translated law and step, their arguments, and the scenario's constants."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

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

_REWIND = """\
void control_rewind(Model *m)
{
    memcpy(m->numbers + N_SETTABLE, FIRST_NUMBERS + N_SETTABLE, sizeof m->numbers - N_SETTABLE * sizeof(double));
    memcpy(m->integers, FIRST_INTEGERS, sizeof m->integers);
    memcpy(m->words, FIRST_WORDS, sizeof m->words);
    memcpy(m->flags, FIRST_FLAGS, sizeof m->flags);
}
"""

_CALL_LAW = """\
static int call_law(void *model)
{
    control_law(model);
    return 0;
}
"""

_DECLARATIONS = """\
/* Resets all but what the importer sets. */
void control_rewind(Model *m);
void control_law(Model *m);
void control_step(Model *m);
void translated_law(const void *words);
void translated_step(const void *words);
"""


def translate_controller(
    loop: Loop, scenario: Scenario, regions: Sequence[Region], names: Sequence[str]
) -> dict[str, str]:
    """Return the C files and headers of a controller, by name."""
    law, data, memory, program = loop.law, loop.data, loop.memory, Program()
    forces = data.command if loop.model.law_gives_wrench else data.thrusts
    law_arguments = data.state, data.goal, data.regions, data.weights, law.gains, law.memory, forces
    # addresses are not stored in the model, which FMU states copy
    memory.name(data.calls, f"(int64_t[{N_CALLS}]){{(intptr_t)call_law, (intptr_t)m}}")
    step_arguments = loop.model, data, loop.inputs, loop.out
    calls = []
    for name, function, arguments in (
        ("law", type(law).function, law_arguments),
        ("step", step_controller, step_arguments),
    ):
        program.export(f"translated_{name}", function, tuple(map(type_of, arguments)))
        members = tuple(Named(a, "gains") if a is law.gains else a for a in arguments)
        calls.append(memory.call(program, name, members))
    code = "\n".join([
        '#include "model.h"\n#include "loop.h"\n',
        program.text(),
        *memory.definitions,
        *memory.starts(),
        _REWIND,
        calls[0],
        _CALL_LAW,
        calls[1],
    ])  # fmt: skip
    header = "\n".join([
        "/* The controller of a scenario: generated. */",
        "#ifndef LOOP_H",
        "#define LOOP_H",
        "",
        '#include "model.h"',
        "",
        _DECLARATIONS,
        *(f"#define {key} {value}" for key, value in _scene(loop, scenario, regions, names).items()),
        "",
        "#endif",
        "",
    ])  # fmt: skip
    return {"loop.c": code, "loop.h": header}


def _scene(loop: Loop, scenario: Scenario, regions: Sequence[Region], names: Sequence[str]) -> dict[str, str]:
    """Return the constants of the scenario that component.c uses, as C macros."""
    memberships, sensing = loop.model.inputs.memberships, scenario.sensing
    ramps = loop.memory.keep(memberships.ramps)
    return {
        "SCENE_CONSTRAINTS": _braced([*_constraints(loop, regions, names), "{HOLDS_UNIT, 0, 0, NULL}"]),
        "SCENE_RAMPS": _braced([*(ramps + int(i) for i in np.flatnonzero(memberships.follows)), -1]),
        "SCENE_COUNTERS": _braced(_braced(item) for item in loop.counters().items()),
        "SCENE_SEED": str(sensing.seed % 2**31),
        "SCENE_DEVIATIONS": _braced(
            number(deviation) for deviation in [sensing.position_noise] * 3 + [sensing.velocity_noise] * 3
        ),
    }


def _constraints(loop: Loop, regions: Sequence[Region], names: Sequence[str]) -> Iterator[str]:
    """Yield the constraints among the parameters, as C initializers of ``Constraint``."""
    keep, (goal, packed) = loop.memory.keep, (loop.data.goal, loop.data.regions)
    if not loop.is_of_mission(loop.desired_quaternion):
        yield f'{{HOLDS_UNIT, {keep(loop.desired_quaternion)}, 4, "law.desired_quaternion is not of length 1"}}'
    yield f'{{HOLDS_UNIT, {keep(loop.inputs.start) + 3}, 4, "start.quaternion is not of length 1"}}'
    for i, (region, name) in enumerate(zip(regions, names, strict=True)):
        first = keep(packed.numbers) + int(packed.offsets[i - 1]) if i else keep(goal.numbers)
        for what, index, other, fault in constraints(region.shape.numbers()):
            more = other + first if what == "above" else other
            yield f'{{HOLDS_{what.upper()}, {first + index}, {more}, "{name}: {fault}"}}'


def _braced(values: object) -> str:
    return f"{{{', '.join(map(str, values))}}}"  # type: ignore[call-overload]
