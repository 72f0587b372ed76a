"""The mutation test: found signs, their mutants, and a plan that fits the sources."""

import shutil

import pytest

from tests.mutation.__main__ import run_mutants
from tests.mutation.mutants import ROOT, all_mutants, equivalent_mutants, find_mutants, load_plan

NO_MATHEMATICS = {"controller/errors.py", "controller/stack_array.py"}

C = """
#include <a-b.h>
static const double X[2] = {-1.0, 1e-3}; /* a - b */
static inline double f(const double *p, int n)
{
    n++; // a - b
    if (p->x - n-- > '-')
        return (double)-n + p[n] - 1e+5;
    s -= "a - b"[0];
    s += -p->y;
    return -(s) - 0x1e;
}
"""


def test_c_operators_are_found_and_replaced_one_at_a_time():
    mutants = find_mutants("a.c", C)
    assert [(m.line, m.before) for m in mutants] == [
        (3, "-"), (7, "-"), (8, "-"), (8, "+"), (8, "-"), (9, "-="), (10, "+="), (10, "-"), (11, "-"), (11, "-"),
    ]  # fmt: skip
    assert len({m.key for m in mutants}) == len(mutants)
    for mutant in mutants:
        changed = [(a, b) for a, b in zip(C, mutant.apply(C), strict=True) if a != b]
        assert changed in ([("-", "+")], [("+", "-")])


def test_every_controller_and_plant_source_is_in_the_plan():
    for path in [*(ROOT / "controller").rglob("*.py"), *(ROOT / "controller").rglob("*.c"),
                 *(ROOT / "plant_fmu" / "csrc").glob("*.c")]:  # fmt: skip
        name = path.relative_to(ROOT).as_posix()
        if name not in NO_MATHEMATICS and find_mutants(name, path.read_text(encoding="utf-8")):
            assert name in load_plan()


def test_planned_tests_exist_and_equivalent_mutants_have_reasons():
    assert all((ROOT / "tests" / test).is_file() for part in load_plan().values() for test in part.tests)
    assert all(equivalent_mutants().values())
    assert equivalent_mutants().keys() <= {m.key for m in all_mutants()}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="needs cc")
def test_tested_mutant_is_killed(tmp_path):
    mutants = find_mutants("controller/restoring.py", (ROOT / "controller/restoring.py").read_text())[:2]
    noticed = run_mutants(mutants, 1, tmp_path / "results.jsonl")
    assert len(noticed) == 2 and all(test.startswith("tests/controller/") for test in noticed.values())
    assert run_mutants(mutants, 1, tmp_path / "results.jsonl") == noticed
