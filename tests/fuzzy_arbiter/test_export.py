"""Exported code equals the arbiter bit for bit: C, plain Python, and Numba."""

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

from benchmarks.fuzzy_accuracy import BOUND as ACCURACY
from benchmarks.fuzzy_accuracy import Reference, random_cases, strengths_system
from fuzzy_arbiter import (
    Arbiter,
    Output,
    Rule,
    Shape,
    System,
    Variable,
    auto_terms,
    falling,
    rising,
    trapezoid,
    triangle,
)
from fuzzy_arbiter.criteria import Criterion, prioritized
from fuzzy_arbiter.definition import variable_names
from fuzzy_arbiter.errors import EngineError, UnsupportedError
from fuzzy_arbiter.export import to_c, to_python
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.terms import Constant, Formula, Linear, curve
from fuzzy_arbiter.terms.functions import FUNCTIONS
from fuzzy_arbiter.terms.norms import T_NORMS


def compiler():
    """Return the command of a C compiler, by the ziglang package where the machine has none."""
    command = os.environ.get("CC") or shutil.which("cc") or shutil.which("gcc")
    if command is None:
        pytest.importorskip("ziglang", reason="there is no C compiler")
        return [sys.executable, "-m", "ziglang", "cc"]
    return shlex.split(command)


WIDE = System(
    (
        Variable("a", (0, 10), {"x": triangle(0, 0, 6), "y": triangle(2, 5, 9), "z": rising(5, 8)}),
        Variable("b", (-1, 1), {"n": falling(-0.5, 0.7), "p": Shape(((0, 0), (0, 1), (0.5, 0.3)))}),
    ),
    (
        Output(
            "o",
            (0, 25),
            {"l": triangle(0, 0, 13), "m": triangle(0, 13, 25), "h": Shape(((13, 0), (13, 0.4), (20, 1), (25, 0.2)))},
            default=3.0,
        ),
        Output("q", (-1, 1), {"u": falling(-1, 0), "*/ v\\": rising(0, 1)}),
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
PAIR = Output("w", (0, 1), {"low": falling(0.2, 0.55), "high": rising(0.37, 0.83)})
BOX = Shape(((0, 0.2), (0.5, 0.2), (0.5, 1), (0.6, 1), (0.6, 0)))
DIP = Output("w", (0, 1), {"low": BOX, "high": triangle(0.89, 0.9, 0.91)})
UNIT = {"t": rising(0, 1), "u": falling(0, 1)}
SYSTEMS = {
    "section VI": prioritized(),
    "raw": prioritized(normalization="none"),
    "complete table": prioritized(form="complete"),
    "rational": prioritized(weight=PAIR, normalization="sum"),
    "measured": prioritized([Criterion("d", membership=falling(0.1, 0.7)), Criterion("e")], outside="clip"),
    "beyond its ends": prioritized(weight=DIP),
    "one": prioritized([Criterion("only")], normalization="max"),
    "wide": WIDE,
    "wide, scaled": replace(WIDE, normalization="range"),
    "wide, shared": replace(WIDE, normalization="sum", outside="clip"),
    "wide, greatest": replace(WIDE, normalization="max", implication="prod"),
    "coding: of no file": prioritized([Criterion("é")], name="coding: of no file"),
    "constant": System(
        (Variable("v", (0, 1), UNIT),),
        (Output("o", (0, 10), {"c": Shape(((0, 0.5),))}, defuzzifier="lom"),),
        ("if v is t then o is c",),
        normalization="none",
    ),
    "long": System(
        tuple(Variable(f"v{i}", (0, 1), UNIT) for i in range(250)),
        (Output("o", (0, 1), UNIT),),
        (
            *(f"if v{i} is t then o is u" for i in range(250)),
            f"if {' and '.join(f'v{i} is not u' for i in range(250))} or v0 is t then o is t",
        ),
        conjunction="prod",
        normalization="none",
    ),
    "forty criteria": prioritized([Criterion(f"c{i}") for i in range(40)]),
    "many points": System(
        (Variable("v", (0, 10), {"t": Shape(tuple((i / 10, i % 7 / 7) for i in range(100)))}),),
        (Output("o", (0, 1), UNIT, default=0.0),),
        ("if v is t then o is t",),
        normalization="none",
    ),
    "wide, products": replace(WIDE, conjunction="prod", disjunction="probor", implication="prod"),
}


# each function of an expression once, where it is defined
EVERY = " + ".join(
    f"{name}({', '.join(['a / 11', 'a / 7 + 1'][: function.arguments])})" for name, function in FUNCTIONS.items()
)
# each function of a / b and c / d, and its inverse, which tells infinity from NaN
CALLS = [f"{name}({', '.join(['a / b', 'c / d'][: function.arguments])})" for name, function in FUNCTIONS.items()]
ENDLESS = System(
    tuple(Variable(name, (-1e20, 1e20), {"t": Shape(((0, 1), (1, 1)))}) for name in "abcd"),
    tuple(
        Output(f"o{i}", (-9, 9), {"v": Formula(text)}, default=-7.25, defuzzifier="average")
        for i, text in enumerate(text for call in CALLS for text in (call, f"1 / {call}"))
    ),
    (Rule(Is("a", "t"), tuple(Is(f"o{i}", "v") for i in range(2 * len(CALLS)))),),
    normalization="none",
)
EXTREMES = [(-2.5, 1.0), (3.0, 1.0), (1e20, 1.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 0.0), (0.0, 1.0)]
CURVED = System(
    (
        Variable(
            "a",
            (0, 10),
            {
                "g": curve("gaussian", 4, 2), "b": curve("bell", 5, 2, 1.5, height=0.75), "c": curve("cosine", 5, 6),
                "s": curve("sigmoid", 6, -400), "p": curve("pi_shape", 1, 3, 5, 9), "k": curve("spike", 3, 4),
                "v": curve("concave", 2, 6), "e": curve("arc", 2, 6), "o": curve("singleton", 5),
                "t": triangle(0, 5, 10),
                "f": Formula("lt(x, 5) * x / 5 + ge(x, 5) * (1 - 0.1 * (x - 5)^2 * abs(sin(x))) ^ 2"),
            },
        ),
    ),
    (
        Output(
            "y",
            (-5, 5),
            {
                "l": Constant(-9), "m": Linear((0.5,), 1), "h": Formula("exp(a / 4) - 3 / (a - 5) + a % 3"),
                "f": Formula(EVERY),
            },
            default=-1.0, defuzzifier="average", aggregation="hamacher_sum", lock_range=True,
        ),
        Output("z", (0, 1), {"u": falling(0, 1), "w": rising(0, 1)}),
    ),
    (
        "if a is g and a is b or a is not s then y is l and z is u",
        Rule(
            (Is("a", "p") & Is("a", "c")) | Is("a", "k"),
            (Is("y", "m"),), 0.8, Operators("hamacher_product", "einstein_sum"),
        ),
        "if a is very v or somewhat (a is e and a is t) or a is o then y is h and z is w",
        "if a is extremely f and not (a is seldom t) then y is l",
        "if a is any then z is u with 0.25",
        "if a is cubed g and not (a is cube_root s) then y is m",
        "if a is t then y is f",
    ),
    conjunction="einstein_product",
    disjunction="bounded_sum",
    normalization="none",
)  # fmt: skip
BELLS = {"l": curve("gaussian", 2, 1.5), "m": curve("gaussian", 5, 1, height=0.8), "h": curve("s_shape", 6, 9)}
ANY = System(
    (Variable("a", (0, 10), {"low": falling(0, 10), "high": rising(0, 10), "near": curve("singleton", 5)}),),
    (
        *(
            Output(f"o{i}", (0, 10), {**BELLS, "point": curve("singleton", 8)}, 1.5, *words, lock_range=True)
            for i, words in enumerate(
                [("centroid", "max"), ("bisector", "probor"), ("mom", "sum"), ("som", "max"), ("lom", "einstein_sum")]
            )
        ),
        Output("ramps", (0, 10), {"l": falling(2, 9), "m": curve("sigmoid", 4, 2), "h": curve("s_shape", 1, 8)}, 0.0,
               "average"),
        Output("last", (0, 10), {"l": Formula("a + 2 * o0 - ramps"), "h": Constant(4)}, 0.0, "sum"),
    ),
    (
        *(f"if a is {x} then {', '.join(f'o{i} is {y}' for i in range(5))}" for x, y in (("low", "l"), ("high", "m"))),
        Rule.parse("if a is very high then o0 is h and o1 is h and o2 is h", Operators(implication="prod")),
        "if a is near then o0 is point and o1 is point and o2 is point with 0.9",
        "if a is low then ramps is l", "if a is high then ramps is m with 0.7", "if a is high then ramps is h",
        "if o0 is l and not (ramps is m) then last is l", "if o1 is h or a is near then last is h",
    ),
    implication="hamacher_product",
)  # fmt: skip
JOINED = {
    "any": ANY,
    "any, clipped": replace(ANY, implication="min", rules=[rule for rule in ANY.rules if not rule.operators]),
    "points": replace(ANY, outputs=ANY.outputs[:5], rules=[ANY.rules[3]]),
    "curves and values": CURVED,
    "drastic": replace(CURVED, conjunction="drastic_product", disjunction="drastic_sum"),
    "nilpotent": replace(CURVED, conjunction="nilpotent_minimum", disjunction="nilpotent_maximum", outside="clip"),
    "bounded": replace(CURVED, conjunction="bounded_difference", disjunction="normalized_sum"),
}


def samples(system):
    """Random samples, some of them on whole numbers, where the terms have their knots."""
    rng = np.random.default_rng(0)
    low, high = np.array([v.universe for v in system.inputs]).T
    x = rng.uniform(low, high, (150, len(low)))
    x[:50] = np.where(rng.random((50, len(low))) < 0.5, np.round(x[:50]), x[:50])
    x[:3] = low, high, (low + high) / 2
    return x


def in_c(system, folder):
    """The exported C, compiled without warnings, as a function of a sample: its status and the outputs."""
    source, library = folder / "arbiter.c", folder / "arbiter.so"
    source.write_text(to_c(system))
    flags = ["-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fPIC", "-shared"]
    flags += ["-Wconversion", "-Wshadow"]
    subprocess.run([*compiler(), *flags, "-o", library, source, "-lm"], check=True)
    function = getattr(ctypes.CDLL(str(library)), re.search(r"int (\w+)\(", source.read_text()).group(1))
    inputs, outputs = (ctypes.c_double * len(system.inputs))(), (ctypes.c_double * len(system.outputs))()

    def evaluate(x):
        inputs[:] = x
        status = function(inputs, outputs)
        return status, () if status else tuple(outputs)

    return evaluate


def in_python(system, folder):
    """The exported Python; its errors name the output or input of which the status has the number."""
    module = {}
    exec(compile(to_python(system).encode(), "<arbiter>", "exec"), module)  # from bytes, as of a file
    faults = {f"output {name} is undefined": k + 1 for k, name in enumerate(variable_names(system.outputs))}
    faults |= {f"input {name} is": -k - 1 for k, name in enumerate(variable_names(system.inputs))}

    def evaluate(x):
        try:
            return 0, module["weights" if system.weights_of else "values"](x)
        except ValueError as error:
            (status,) = {status for fault, status in faults.items() if fault in str(error)}
            return status, ()

    return evaluate


def in_numba(system, folder):
    """The compiled arbiter, called from a compiled loop."""
    numba = pytest.importorskip("numba")
    function = Arbiter(system).compiled()

    @numba.njit
    def loop(rows, results):
        return [function(rows[i], results[i]) for i in range(len(rows))]

    def evaluate(x):
        results = np.zeros((1, len(system.outputs)))
        (status,) = loop(np.array([x], dtype=float), results)
        return status, tuple(results[0].tolist())

    return evaluate


COMPILED = ("section VI", "rational", "wide, shared", "curves and values", "any")
SLOW = {(in_c, "long"), *((in_numba, name) for name in COMPILED[1:])}
CASES = [
    pytest.param(make, name, marks=pytest.mark.slow if (make, name) in SLOW else (), id=f"{make.__name__}-{name}")
    for make in (in_c, in_python, in_numba)
    for name in (COMPILED if make is in_numba else {**SYSTEMS, **JOINED})
]


@pytest.mark.medium(fast=9)
@pytest.mark.parametrize(("make", "name"), CASES)
def test_exported_code_matches_the_arbiter(make, name, tmp_path):
    """Bit for bit, but for functions of which libraries differ; refused samples and undefined outputs by number."""
    system = {**SYSTEMS, **JOINED}[name]
    evaluate, arbiter = make(system, tmp_path), Arbiter(system)
    for x in samples(system).tolist():
        expected = tuple(arbiter(x))
        undefined = np.flatnonzero(np.isnan(expected))
        status, outputs = evaluate(x)
        assert status == (undefined[0] + 1 if len(undefined) else 0)
        if not status:
            # the position of a smooth maximum is known to the root of rounding, 1e-8 of the width
            tolerance = {"rel": 0.0, "abs": 1e-7} if name[:3] == "any" else {"rel": 1e-11, "abs": 1e-11}
            assert outputs == (pytest.approx(expected, **tolerance) if name in JOINED else expected)
    good = [v.universe[0] for v in system.inputs]
    for i, variable in enumerate(system.inputs):
        values = [float("nan")]
        if system.outside == "refuse":
            values += [variable.universe[0] - 1e-6, variable.universe[1] + 1, float("inf")]
        rounded = np.nextafter(variable.universe[0], -np.inf)  # counts as the end
        assert evaluate([*good[:i], rounded, *good[i + 1 :]]) == evaluate(good)
        for value in values:
            assert evaluate([*good[:i], value, *good[i + 1 :]])[0] == -i - 1


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("seed", range(6))
def test_joined_terms_of_any_kind_match_the_engine(seed, tmp_path):
    """All implications, aggregations and defuzzifiers but drastic ones; within the bound of the engine's own test."""
    compared = 0
    for i, case in enumerate(random_cases(10, 200 + seed)):
        try:
            (tmp_path / str(i)).mkdir()
            makers = (in_python, in_c) if i < 3 else (in_python,)
            results = [make(case.system, tmp_path / str(i))(list(case.cuts)) for make in makers]
        except UnsupportedError:
            continue
        (expected,) = Arbiter(case.system)(list(case.cuts))
        low, high = case.output.universe
        assert results == [results[0]] * len(results), case
        for status, outputs in results:
            assert (status == 1) == np.isnan(expected), case
            if not status and (error := abs(outputs[0] - expected) / (high - low)) > ACCURACY:
                # only a smooth maximum is flat to rounding near its position
                assert case.output.defuzzifier in ("centroid", "bisector") or error < 1e-4, case
                assert Reference(case).error(case.output.defuzzifier, outputs[0]) <= ACCURACY, case
            compared += not status
    assert compared > 2


LINES = {"low": falling(0, 10), "high": rising(0, 10)}
DIPS = [
    (LINES, (0.6, 0.6)),
    (LINES, (1.0, 1.0)),
    ({"low": Shape(((0, 1), (10, 0.6))), "high": Shape(((0, 0.2), (10, 0.5)))}, (0.5, 1.0)),
    ({"l": triangle(0, 2, 4), "m": trapezoid(3, 5, 6, 8), "e": curve("semi_ellipse", 6, 9),
      "h": curve("s_shape", 7, 10)}, (0.3,) * 4),
    *((auto_terms(5), cuts) for cuts in [(0.5, 0.3, 0.5, 0.2, 0.5), (0.8, 0.8, 0.3, 0.8, 1.0), (0.3,) * 5]),
]  # fmt: skip


@pytest.mark.medium
@pytest.mark.parametrize("implication", ["min", "prod"])
def test_positions_of_all_maxima_count(implication, tmp_path):
    """Also those between which the height dips within a panel, at positions that a grid finds."""
    x = np.linspace(0, 10, 100_001)
    for i, (terms, cuts) in enumerate(DIPS):
        outputs = [
            Output(d + a, (0, 10), terms, None, d, a)
            for a in ("max", "sum", "probor")
            for d in ("som", "lom", "mom", "bisector")
        ]
        inputs = tuple(Variable(f"x{j}", (0, 1), {"on": rising(0, 1)}) for j in range(len(cuts)))
        rules = tuple(
            Rule(Is(v.name, "on"), tuple(Is(o.name, o.term_names[j]) for o in outputs)) for j, v in enumerate(inputs)
        )
        system = System(inputs, tuple(outputs), rules, implication=implication)
        expected = tuple(Arbiter(system)(list(cuts)))
        (tmp_path / str(i)).mkdir()
        for make in (in_python, in_c):
            assert make(system, tmp_path / str(i))(cuts) == (0, pytest.approx(expected, abs=1e-7)), (terms, cuts)
        heights = (
            T_NORMS[implication]
            .array(np.array(cuts)[:, None], [term.membership.of_many(x) for term in outputs[0].terms])
            .max(axis=0)
        )
        top = x[heights >= heights.max() * (1 - 1e-12)]
        assert expected[:2] == pytest.approx((top[0], top[-1]), abs=1e-3), (terms, cuts)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("implication", ["bounded_difference", "nilpotent_minimum"])
@pytest.mark.parametrize("defuzzifier", ["centroid", "bisector"])
def test_exported_code_returns_for_supports_between_its_nodes(implication, defuzzifier, tmp_path):
    terms = {"l": curve("gaussian", 2, 1.5), "h": curve("gaussian", 5.123, 0.3)}
    system = strengths_system(Output("y", (0, 10), terms, None, defuzzifier), implication)
    module = {}
    exec(to_python(system), module)
    height, calls, results = module["height_1"], [], []

    def counted(x, cuts):
        calls.append(x)
        assert len(calls) < 100_000
        return height(x, cuts)

    module["height_1"] = counted
    for strengths in [(10.0**-k, other) for k in range(6, 14) for other in (0.0, 10.0**-k)]:
        calls.clear()
        results.append((strengths, (0, module["values"](strengths))))
        noise = 1e-15 / strengths[0]  # of degrees by rounding, as a fraction of the height
        assert results[-1][1][1] == pytest.approx(Arbiter(system)(list(strengths)), abs=1e-8 + 100 * noise)
    evaluate = in_c(system, tmp_path)
    assert [(strengths, evaluate(strengths)) for strengths, _ in results] == results


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("make", [in_c, in_python, pytest.param(in_numba, marks=pytest.mark.slow)])
def test_functions_take_any_number(make, tmp_path):
    """Of large and infinite numbers and of NaN, NumPy's value alone, in a batch and in exported code."""
    x = np.array([(*first, *second) for first in EXTREMES for second in EXTREMES])
    evaluate, arbiter = make(ENDLESS, tmp_path), Arbiter(ENDLESS)
    for row, expected in zip(x.tolist(), arbiter.batch(x).tolist(), strict=True):
        expected = pytest.approx(expected, rel=1e-11)
        assert tuple(arbiter(row)) == expected
        assert evaluate(row) == (0, expected)


def test_systems_of_several_files_go_into_one_program(tmp_path):
    sources = []
    for i, system in enumerate((SYSTEMS["one"], WIDE, replace(WIDE, name="日本"))):
        sources.append(tmp_path / f"{i}.c")
        sources[-1].write_text(to_c(replace(system, name=f"{system.name}{i}")))
    flags = ["-std=c99", "-fPIC", "-shared", "-o", tmp_path / "all.so"]
    subprocess.run([*compiler(), *flags, *sources], check=True)


def test_exported_python_module_has_no_dependencies(tmp_path):
    (tmp_path / "mine.py").write_text(to_python(WIDE))
    code = "import sys; n = set(sys.modules); import mine; mine.values([1.0, 0.5]); print(sorted(set(sys.modules) - n))"
    done = subprocess.run([sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {code}"],
                          capture_output=True, text=True, check=True)  # fmt: skip
    assert done.stdout.strip() == "['__future__', 'mine']"


def test_missing_numba_is_reported(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(EngineError, match="Numba is not installed"):
        Arbiter().compiled()


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"lock_previous": True}, "output 'z' keeps its previous value, which a function of one sample has not"),
        ({"aggregation": "drastic_sum"}, "output 'z' has the norm drastic_sum, expected none that is drastic"),
    ],
)
def test_unsupported_features_are_rejected_by_name(change, fault):
    changed = replace(CURVED, outputs=(CURVED.outputs[0], replace(CURVED.outputs[1], **change)))
    for export in (to_c, to_python):
        with pytest.raises(UnsupportedError, match=f"export: .*{fault}"):
            export(changed)


def test_exported_c_documents_return_codes_by_name():
    system = Arbiter().system
    (y,) = (Output("y */", (0, 1), {"a": rising(0, 1)}),)
    text = to_c(
        System((system.inputs[0],), (y, replace(y, name="z", default=0.5)), ("if obstacle is exist then z is a",))
    )
    assert (
        " *  -1  obstacle is not in its universe, or no number\n *   1  no rule fires for y * /, which has no default\n"
        in text
    )
    assert "no rule fires for z" not in text
