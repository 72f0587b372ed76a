"""The arbiter: section VI, normalization, definitions, threads, memory, imports."""

import copy
import gc
import math
import pickle
import subprocess
import sys
import threading
import tracemalloc
from fractions import Fraction

import numpy as np
import pytest

from fuzzy_arbiter import Arbiter, rising
from fuzzy_arbiter.criteria import SECTION_VI, Criterion, prioritized, ramp
from fuzzy_arbiter.errors import DefinitionError, EngineError, InputError

ENGINES = ("closed", "exact", "grid", "skfuzzy")

# the paper's rules on crisp inputs: (obstacle exists, shape is complex, depth is not maintained) -> alpha
CRISP = {
    (1, 1, 1): (1, 0, 0), (1, 1, 0): (1, 0, 0), (1, 0, 1): (1, 0, 0), (1, 0, 0): (1, 0, 0),
    (0, 1, 1): (0, 1, 0), (0, 1, 0): (0, 1, 0), (0, 0, 1): (0, 0, 1), (0, 0, 0): (0, 0, 0),
}  # fmt: skip


@pytest.fixture(scope="module", params=ENGINES)
def arbiter(request):
    return Arbiter(engine=request.param)


@pytest.mark.parametrize(("inputs", "outputs"), CRISP.items())
def test_the_crisp_table_is_exact(inputs, outputs, arbiter):
    assert arbiter(inputs) == outputs
    assert arbiter.batch([inputs])[0].tolist() == list(outputs)


def test_the_eight_rules_read_as_in_the_paper():
    assert str(Arbiter()).splitlines() == [
        "R1: if obstacle is exist then alpha_1 is high",
        "R2: if obstacle is not_exist then alpha_1 is low",
        "R3: if obstacle is exist then alpha_2 is low",
        "R4: if shape is simple then alpha_2 is low",
        "R5: if obstacle is not_exist and shape is complex then alpha_2 is high",
        "R6: if obstacle is exist or shape is complex then alpha_3 is low",
        "R7: if depth is maintain then alpha_3 is low",
        "R8: if obstacle is not_exist and shape is simple and depth is not_maintain then alpha_3 is high",
    ]


def test_one_sample_and_many_agree(arbiter):
    inputs = np.random.default_rng(2).random((40, 3))
    one_by_one = [arbiter(row) for row in inputs.tolist()]
    if arbiter.engine in ("closed", "exact"):
        assert arbiter.batch(inputs).tolist() == list(map(list, one_by_one))
    assert arbiter.batch(inputs) == pytest.approx(np.array(one_by_one), abs=1e-13)
    assert arbiter.batch(np.empty((0, 3))).shape == (0, 3)
    assert arbiter.batch(inputs[:, ::-1][:, ::-1]) == pytest.approx(np.array(one_by_one), abs=1e-13)


@pytest.mark.parametrize(
    "value", [np.float32(0.1), np.float16(0.1), np.float64(0.1), Fraction(1, 10), np.True_, True, np.int8(1)]
)
def test_other_numeric_types_are_converted_to_float(arbiter, value):
    for inputs in ([value, 0.5, 0.0], {"obstacle": value, "shape": 0.5, "depth": 0.0}):
        weights = arbiter(inputs)
        assert weights == arbiter([float(value), 0.5, 0.0])
        assert all(type(w) is float for w in weights)


def test_inputs_outside_may_be_clipped():
    arbiter = Arbiter([Criterion("wall", membership=rising(2.0, 4.0))], outside="clip")
    assert arbiter([-7.0]) == (0.0,)
    assert arbiter.batch([[math.inf], [1e9], [-1.0]])[:, 0].tolist() == [1.0, 1.0, 0.0]
    assert arbiter([10**400]) == arbiter([np.float32(5)]) == (1.0,)
    for bad in (math.nan, "near", None):
        with pytest.raises(InputError, match="wall"):
            arbiter([bad])
    with pytest.raises(InputError, match="row 1: wall is nan"):
        arbiter.batch([[3.0], [math.nan]])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"criteria": []}, "at least one"),
        ({"criteria": [SECTION_VI[0], SECTION_VI[0]]}, "'obstacle'"),
        ({"criteria": [], "system": prioritized()}, "got a system and criteria, expected one of the two"),
        ({"system": 3}, "system is 3, expected a System"),
        ({"form": "short"}, "hierarchical, minimal, conjunctive, complete"),
        ({"criteria": [Criterion(f"c{i}") for i in range(17)], "form": "complete"}, "at most 16"),
        ({"engine": "fast"}, "auto, closed, exact, grid, skfuzzy"),
        ({"points": 2}, "points is 2, expected a whole number, 3 or more"),
        ({"normalization": "sun"}, "normalization is 'sun', expected one of none, range, sum, max"),
        ({"outside": "wrap"}, "refuse, clip"),
        ({"system": prioritized(), "points": 11}, "got a System with form"),
        ({"engine": "closed", "form": "complete"}, "engine 'closed'"),
        ({"engine": ""}, "engine is ''"),
    ],
)
def test_invalid_definitions_are_rejected(arguments, words):
    with pytest.raises(DefinitionError, match=words):
        Arbiter(**arguments)


def test_normalizations_match_their_formulas(arbiter):
    inputs = [0.5, 0.25, 0.75]  # h = 1/2, 1/4, 1/2
    assert Arbiter(normalization="none")(inputs) == pytest.approx([1 / 2, (1 + 5 / 32) / 3, 1 / 2])
    assert Arbiter()(inputs) == pytest.approx([1 / 2, 5 / 32, 1 / 2])
    for normalization, shares in (("sum", [16 / 37, 5 / 37, 16 / 37]), ("max", [1, 5 / 16, 1])):
        assert Arbiter(normalization=normalization)(inputs) == pytest.approx(shares)
        resting = Arbiter(normalization=normalization, engine=arbiter.engine)
        assert resting([0, 0, 0]) == tuple(resting.batch([[0, 0, 0]])[0]) == (0, 0, 0)  # not 0/0


def test_arbiter_reports_its_engine_the_reason_and_a_missing_library(monkeypatch):
    assert (Arbiter().engine, Arbiter(form="complete").engine) == ("closed", "exact")
    assert "closed form" in Arbiter().engine_reason
    assert "there is no closed form" in Arbiter(form="complete").engine_reason
    assert Arbiter(engine="grid").engine_reason == "requested"
    monkeypatch.delitem(sys.modules, "fuzzy_arbiter.engines.scikit", raising=False)
    monkeypatch.setitem(sys.modules, "skfuzzy", None)
    with pytest.raises(EngineError, match="skfuzzy is not installed"):
        Arbiter(engine="skfuzzy")


def test_arbiter_is_immutable_and_copyable(arbiter):
    with pytest.raises(AttributeError):
        arbiter.system = prioritized()
    with pytest.raises(AttributeError):
        arbiter.system.points = 5
    for other in (copy.copy(arbiter), copy.deepcopy(arbiter), pickle.loads(pickle.dumps(arbiter))):
        assert other == arbiter and hash(other) == hash(arbiter)
        assert other([0.3, 0.6, 0.2]) == arbiter([0.3, 0.6, 0.2])
    assert arbiter != Arbiter(normalization="max")
    assert pickle.loads(b"cfuzzy_arbiter.arbiter\n_rebuilt\n(cfuzzy_arbiter.hierarchy\nprioritized\n(tRVgrid\ntR.") == (
        Arbiter(engine="grid")
    )  # of an installed version


@pytest.mark.slow
def test_threads_do_not_disturb_each_other(arbiter):
    inputs = np.random.default_rng(0).random((4, 40, 3)).tolist()
    expected = [[Arbiter(engine=arbiter.engine)(x) for x in rows] for rows in inputs]
    wrong = []

    def work(rows, answers):
        wrong.extend(x for x, answer in zip(rows, answers, strict=True) if arbiter(x) != answer)

    threads = [threading.Thread(target=work, args=pair) for pair in zip(inputs, expected, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


@pytest.mark.medium
def test_arbiters_leak_no_memory():
    def memory_after(count):
        for _ in range(count):
            Arbiter()([0.3, 0.6, 0.2])
        gc.collect()
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        assert -memory_after(10) + memory_after(30) < 20_000  # bytes; one arbiter takes more
    finally:
        tracemalloc.stop()


def test_ramp_is_one_up_to_the_boundary_and_falls_outside():
    assert [ramp(c, 0.2) for c in (-1.0, 0.0, 0.05, 0.2, 3.0)] == pytest.approx([1.0, 1.0, 0.75, 0.0, 0.0])
    assert [ramp(c, 0.0) for c in (-1e-9, 1e-9)] == [1.0, 0.0]
    assert math.isnan(ramp(math.nan, 0.2))
    assert math.isnan(ramp(math.nan, 0.0))


@pytest.mark.medium
def test_arbiter_imports_no_optional_library():
    code = (
        "import sys, fuzzy_arbiter; a = fuzzy_arbiter.Arbiter();"
        "a([0, 1, 0]); a.batch([[0, 1, 0]]); a.explain([0, 1, 0]); a.verify();"
        "print({'matplotlib', 'fmpy', 'numba', 'networkx', 'scipy', 'cosim', 'controller', 'plant_fmu', 'skfuzzy'}"
        " & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_a_name_is_imported_without_those_that_it_does_not_need():
    code = "import sys; from fuzzy_arbiter import ArbiterError; print(*(m for m in sys.modules if 'fuzzy_ar' in m))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["fuzzy_arbiter", "fuzzy_arbiter.errors"]
