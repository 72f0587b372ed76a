"""The C of a flight: translated functions, their arrays, and the start values of the plant."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

from controller.translator.operands import number
from controller.translator.program import Program
from controller.translator.types import type_of
from cosim.replay.interactive.flight import Flight
from cosim.replay.interactive.normal_numbers import normal_numbers
from cosim.simulation.make_step import STREAM
from cosim.ssp.c_sources import c_files
from cosim.ssp.memory import Memory, Named
from cosim.step.score import fly
from cosim.step.step_model import ARBITER, LAW
from fuzzy_arbiter import Constant, Output, Rule, System, Term
from fuzzy_arbiter.export import to_c

_MODEL = """\
typedef struct {
    double numbers[N_NUMBERS], gains[N_GAINS];
    int64_t integers[N_INTEGERS];
    uint64_t words[N_WORDS];
    bool flags[N_FLAGS];
    int64_t exact; /* nothing but the true state is measured */
} Model;

static double NOISE[6 * N_NOISE + 1], ROWS[N_ROWS * N_COLUMNS];
static int64_t CALLS[N_CALLS]; /* addresses of the law's and the arbiter's function, and of their arguments */
int rules_evaluate(const double inputs[], double outputs[]);
int strengths_evaluate(const double inputs[], double outputs[]);
static int call_law(void *model), call_rules(void *model);
"""

_CALLS = """\
static int call_law(void *model)
{
    control_law(model);
    return 0;
}

static int call_rules(void *model)
{
    const Model *m = model;

    return rules_evaluate(m->numbers + AT_RULE_INPUTS, (double *)m->numbers + AT_WEIGHTS);
}

static void rewind_model(Model *m)
{
    CALLS[LAW] = (intptr_t)call_law;
    CALLS[ARBITER] = (intptr_t)call_rules;
    CALLS[LAW + 1] = CALLS[ARBITER + 1] = (intptr_t)m;
    memcpy(m->numbers, FIRST_NUMBERS, sizeof FIRST_NUMBERS);
    memcpy(m->integers, FIRST_INTEGERS, sizeof FIRST_INTEGERS);
    memcpy(m->words, FIRST_WORDS, sizeof FIRST_WORDS);
    memcpy(m->flags, FIRST_FLAGS, sizeof FIRST_FLAGS);
    memcpy(m->gains, FIRST_GAINS, sizeof FIRST_GAINS);
}
"""


def flight_sources(flight: Flight, memory: Memory, token: str) -> dict[str, bytes]:
    """Return the C files of a flight, to be compiled with those of the plant's FMU."""
    program, calls, law, data = Program(), [], flight.law, flight.data
    for array, name in ((flight.noise, "NOISE"), (flight.rows, "ROWS"), (data.calls, "CALLS")):
        memory.name(array, name)
    for native in flight.plant:
        memory.fix(native.input_references, native.output_references, native.flag_references)
    for name, function, arguments in (("law", type(law).function, flight.control), ("fly", fly, flight.fly)):
        program.export(f"translated_{name}", function, tuple(map(type_of, arguments)))
        given = (Named(a, "gains") if a is law.gains else a for a in arguments)
        calls.append(f"static {memory.call(program, name, tuple(given))}")
    system = flight.scenario.rules.system
    gains = ", ".join(map(number, law.gains)) or "0.0"
    row, rule_inputs = memory.keep(data.row), memory.keep(data.signals.inputs)
    sizes = memory.sizes() | {
        "N_GAINS": max(len(law.gains), 1), "N_NOISE": len(flight.noise), "N_ROWS": len(flight.rows),
        "N_COLUMNS": data.row.size, "N_CALLS": data.calls.size, "LAW": LAW, "ARBITER": ARBITER,
        "AT_RULE_INPUTS": rule_inputs, "AT_WEIGHTS": memory.keep(data.by_criterion),
        "RULE_INPUTS": rule_inputs - row, "RULES": flight.columns.get("rule.R1", 0),
    }  # fmt: skip
    text = "\n".join([
        "/* A scenario's flight: generated. */",
        *(f"#define {key} {value}" for key, value in sizes.items()),
        _MODEL,
        program.text(),
        *memory.definitions,
        *memory.starts(),
        f"static const double FIRST_GAINS[] = {{{gains}}};",
        *calls,
        *_scene(flight, token),
        _CALLS,
    ])  # fmt: skip
    return {
        **c_files("cosim.replay.interactive", "csrc"),
        "loop.h": text.encode(),
        "rules.c": to_c(dataclasses.replace(system, name="rules")).encode(),
        "strengths.c": to_c(_strengths(system)).encode(),
    }


def _strengths(system: System) -> System:
    """Return a system of the same conditions, whose outputs are the strengths of the rules."""
    one = (Term("one", Constant(1.0)),)
    outputs = tuple(Output(f"r{i}", (0.0, 1.0), one, 0.0, "sum") for i in range(len(system.rules)))
    rules = (
        Rule(rule.condition, (output["one"],), rule.weight, rule.operators)
        for rule, output in zip(system.rules, outputs, strict=True)
    )
    return System(
        system.inputs, outputs, tuple(rules), name="strengths", conjunction=system.conjunction,
        disjunction=system.disjunction, implication=system.implication, outside="clip",
    )  # fmt: skip


def _scene(flight: Flight, token: str) -> Iterator[str]:
    """Yield the plant's start values, and the random numbers of the noise, as C."""
    scenario = flight.scenario
    yield f'#define PLANT_TOKEN "{token}"'
    for kind, prefix, names, c in (
        ("real", "START", "STARTS", "fmi3Float64"),
        ("integer", "WHOLE", "WHOLE_STARTS", "fmi3Int32"),
        ("boolean", "FLAG", "FLAG_STARTS", "fmi3Boolean"),
    ):
        given = [(flight.reference(name), x) for name, x in flight.start.items() if flight.variables[name].type == kind]
        values = [number(float(value)) if kind == "real" else str(int(value)) for _, value in given]
        yield f"#define N_{names} {len(given)}"
        references = [str(at) for at, _ in given] or ["0"]
        yield f"static const fmi3ValueReference {prefix}_REFERENCES[] = {_c_list(references)};"
        yield f"static const {c} {prefix}_VALUES[] = {_c_list(values or ['0'])};"
    yield from normal_numbers((scenario.sensing.seed, STREAM), 6 * len(flight.noise))


def _c_list(values: Sequence[str]) -> str:
    return f"{{{', '.join(values)}}}"
