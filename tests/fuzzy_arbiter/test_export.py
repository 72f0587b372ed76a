"""Exported code gives the arbiter's own bits: C, plain Python, and what Numba makes of it."""

import ctypes
import os
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from fuzzy_arbiter import (
    Arbiter,
    Criterion,
    Output,
    Shape,
    System,
    Term,
    Variable,
    falling,
    prioritised,
    rising,
    trapezoid,
    triangle,
)
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.export import to_c, to_python


def compiler():
    """Return the command of a C compiler, by the ziglang package where the machine has none."""
    command = os.environ.get("CC") or shutil.which("cc") or shutil.which("gcc")
    if command is None:
        pytest.importorskip("ziglang", reason="there is no C compiler")
        return [sys.executable, "-m", "ziglang", "cc"]
    return shlex.split(command)


WIDE = System(
    (
        Variable("a", (0, 10), (Term("x", triangle(0, 0, 6)), Term("y", triangle(2, 5, 9)), Term("z", rising(5, 8)))),
        Variable("b", (-1, 1), (Term("n", falling(-0.5, 0.7)), Term("p", Shape(((0, 0), (0, 1), (0.5, 0.3)))))),
    ),
    (
        Output(
            "o",
            (0, 25),
            (
                Term("l", triangle(0, 0, 13)),
                Term("m", trapezoid(0, 13, 13, 25)),
                Term("h", Shape(((13, 0), (13, 0.4), (20, 1), (25, 0.2)))),
            ),
            default=3.0,
        ),
        Output("q", (-1, 1), (Term("u", falling(-1, 0)), Term("*/ v\\", rising(0, 1)))),
    ),
    (
        "if a is x or b is n then o is l and q is u",
        "if a is y and b is not p then o is m with 0.7",
        "if not (a is z & b is p) | a is y then o is h with 0.3",
        'if a is z and b is p then q is "*/ v\\"',
    ),
    name="3 odd */*/ systems ???/\\",
    normalization="none",
)
PAIR = Output("w", (0, 1), (Term("low", falling(0.2, 0.55)), Term("high", rising(0.37, 0.83))))
DIP = Output(
    "w",
    (0, 1),
    (Term("low", Shape(((0, 0.2), (0.5, 0.2), (0.5, 1), (0.6, 1), (0.6, 0)))), Term("high", triangle(0.89, 0.9, 0.91))),
)
SYSTEMS = {
    "section VI": prioritised(),
    "raw": prioritised(normalization="none"),
    "complete table": prioritised(form="complete"),
    "rational": prioritised(weight=PAIR, normalization="sum"),
    "measured": prioritised([Criterion("d", membership=falling(0.1, 0.7)), Criterion("e")], outside="clip"),
    "beyond its ends": prioritised(weight=DIP),
    "one": prioritised([Criterion("only")], normalization="max"),
    "wide": WIDE,
    "wide, scaled": replace(WIDE, normalization="range"),
    "wide, shared": replace(WIDE, normalization="sum", outside="clip"),
    "wide, greatest": replace(WIDE, normalization="max", implication="prod"),
    "coding: of no file": prioritised([Criterion("é")], name="coding: of no file"),
    "long": System(
        tuple(Variable(f"v{i}", (0, 1), (Term("t", rising(0, 1)), Term("u", falling(0, 1)))) for i in range(250)),
        (Output("o", (0, 1), (Term("l", falling(0, 1)), Term("h", rising(0, 1)))),),
        (
            *(f"if v{i} is t then o is l" for i in range(250)),
            f"if {' and '.join(f'v{i} is not u' for i in range(250))} or v0 is t then o is h",
        ),
        conjunction="prod",
        normalization="none",
    ),
    "many points": System(
        (Variable("v", (0, 10), (Term("t", Shape(tuple((i / 10, i % 7 / 7) for i in range(100)))),)),),
        (Output("o", (0, 1), (Term("h", rising(0, 1)),), default=0.0),),
        ("if v is t then o is h",),
        normalization="none",
    ),
    "wide, products": replace(WIDE, conjunction="prod", disjunction="probor", implication="prod"),
}


@pytest.fixture(params=SYSTEMS)
def system(request):
    return SYSTEMS[request.param]


def samples(system):
    """Random samples, some of them on whole numbers, where the terms have their knots."""
    rng = np.random.default_rng(0)
    low, high = np.array([v.universe for v in system.inputs]).T
    x = rng.uniform(low, high, (150, len(low)))
    x[:50] = np.where(rng.random((50, len(low))) < 0.5, np.round(x[:50]), x[:50])
    x[:3] = low, high, (low + high) / 2
    return x


def expected(system):
    """Weights of the arbiter, or the number of the output that is undefined."""
    arbiter = Arbiter(system=system)
    for x in samples(system).tolist():
        undefined = np.flatnonzero(np.isnan(arbiter(x)))
        yield x, int(undefined[0]) + 1 if len(undefined) else arbiter(x)


def bad(system):
    """Samples that are refused, and by which input."""
    good = [v.universe[0] for v in system.inputs]
    for i, variable in enumerate(system.inputs):
        values = [float("nan")]
        if system.outside == "refuse":
            values += [np.nextafter(variable.universe[0], -np.inf), variable.universe[1] + 1, float("inf")]
        yield from (([*good[:i], value, *good[i + 1 :]], -i - 1) for value in values)


@pytest.mark.parametrize(
    "system",
    [pytest.param(name, marks=pytest.mark.slow) if name == "long" else name for name in SYSTEMS],
    indirect=True,
)
def test_c(system, tmp_path):
    source = tmp_path / "arbiter.c"
    source.write_text(to_c(system))
    name = re.search(r"int (\w+)\(", source.read_text()).group(1)
    library = tmp_path / "arbiter.so"
    flags = ["-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fPIC", "-shared"]
    flags += ["-Wconversion", "-Wshadow"]
    subprocess.run([*compiler(), *flags, "-o", library, source], check=True)
    evaluate = getattr(ctypes.CDLL(str(library)), name)
    inputs = (ctypes.c_double * len(system.inputs))()
    outputs = (ctypes.c_double * len(system.outputs))()
    for x, weights in expected(system):
        inputs[:] = x
        status = evaluate(inputs, outputs)
        assert status == (weights if isinstance(weights, int) else 0)
        assert isinstance(weights, int) or tuple(outputs) == weights
    for x, status in bad(system):
        inputs[:] = x
        assert evaluate(inputs, outputs) == status


def test_systems_of_several_files_go_into_one_program(tmp_path):
    sources = []
    for i, system in enumerate((SYSTEMS["one"], WIDE, replace(WIDE, name="日本"))):
        sources.append(tmp_path / f"{i}.c")
        sources[-1].write_text(to_c(replace(system, name=f"{system.name}{i}")))
    flags = ["-std=c99", "-fPIC", "-shared", "-o", tmp_path / "all.so"]
    subprocess.run([*compiler(), *flags, *sources], check=True)


def test_python(system):
    module = {}
    exec(compile(to_python(system).encode(), "<arbiter>", "exec"), module)  # from bytes, as of a file
    for x, weights in expected(system):
        if isinstance(weights, int):
            with pytest.raises(ValueError, match=f"output {weights} is undefined"):
                module["weights"](x)
        else:
            assert module["weights"](x) == weights
    for x, status in bad(system):
        with pytest.raises(ValueError, match=f"input {-status} is"):
            module["weights"](x)


@pytest.mark.parametrize(
    "name", ["section VI", *(pytest.param(name, marks=pytest.mark.slow) for name in ("rational", "wide, shared"))]
)
def test_from_a_compiled_loop(name):
    numba = pytest.importorskip("numba")
    system = SYSTEMS[name]
    evaluate = Arbiter(system=system).compiled()

    @numba.njit
    def loop(rows, results):
        status = np.zeros(len(rows), np.int64)
        for i in range(len(rows)):
            status[i] = evaluate(rows[i], results[i])
        return status

    x = samples(system)
    results = np.zeros((len(x), len(system.outputs)))
    status = loop(x, results)
    for (_, weights), row, fault in zip(expected(system), results.tolist(), status.tolist(), strict=True):
        assert fault == (weights if isinstance(weights, int) else 0)
        assert isinstance(weights, int) or tuple(row) == weights
    assert all(evaluate(np.array(x), results[0]) == fault for x, fault in bad(system))


def test_forty_criteria_in_python():
    system = prioritised([Criterion(f"c{i}") for i in range(40)])
    module = {}
    exec(to_python(system), module)
    x = np.random.default_rng(0).random(40).tolist()
    assert module["weights"](x) == Arbiter(system=system)(x)


def test_the_python_module_needs_nothing(tmp_path):
    (tmp_path / "mine.py").write_text(to_python(WIDE))
    code = (
        "import sys; n = set(sys.modules); import mine; mine.weights([1.0, 0.5]); print(sorted(set(sys.modules) - n))"
    )
    done = subprocess.run([sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {code}"],
                          capture_output=True, text=True, check=True)  # fmt: skip
    assert done.stdout.strip() == "['__future__', 'mine']"


def test_without_numba_it_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(EngineError, match="Numba is not installed"):
        Arbiter().compiled()
