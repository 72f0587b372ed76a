"""The mutation test: found signs, their mutants, and a plan that fits the sources."""

import ast
import shutil

import pytest

from tests.mutation.mutants import mutants_of
from tests.mutation.plan import ROOT, all_mutants, equivalent, part_of, parts
from tests.mutation.running import sample

NO_MATHEMATICS = {"controller/errors.py", "controller/stack_array.py"}

PYTHON = """
x = "a - b" + f"{1 - 2}"  # a - b
def f(a, b=-1):
    return -a - (-b) if a else a[b - 1:] + 1e-3
class C:
    def g(self):
        self.x += 1
        self.x -= 2; λ = -self.x + 1
        return {1} - {2}, not -self.x
"""

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
int g(int h) { return h ? -h : +h; }
"""


def signs(path, source):
    return [(m.function, m.before, m.unary) for m in mutants_of(path, source)]


def test_python_operators_are_found():
    assert signs("a.py", PYTHON) == [
        ("", "+", False), ("f", "-", True), ("f", "-", True), ("f", "-", False), ("f", "-", True), ("f", "-", False),
        ("f", "+", False), ("C.g", "+=", False), ("C.g", "-=", False), ("C.g", "-", True), ("C.g", "+", False),
        ("C.g", "-", False), ("C.g", "-", True),
    ]  # fmt: skip


def test_c_operators_are_found():
    assert signs("a.c", C) == [
        ("", "-", True), ("f", "-", False), ("f", "-", True), ("f", "+", False), ("f", "-", False),
        ("f", "-=", False), ("f", "+=", False), ("f", "-", True), ("f", "-", True), ("f", "-", False),
        ("g", "-", True), ("g", "+", True),
    ]  # fmt: skip


@pytest.mark.parametrize(("path", "source"), [("a.py", PYTHON), ("a.c", C)])
def test_mutants_differ_in_one_operator_and_have_unique_names(path, source):
    found = mutants_of(path, source)
    assert len({m.key for m in found}) == len(found)
    for mutant in found:
        text = mutant.applied(source)
        different = [(a, b) for a, b in zip(source, text, strict=True) if a != b]
        assert different == [(mutant.before[0], mutant.after[0])]
        if path == "a.py":
            ast.parse(text)


def nodes(tree):
    """Walk a tree, without f-strings."""
    yield tree
    for child in ast.iter_child_nodes(tree):
        if not isinstance(child, ast.JoinedStr):
            yield from nodes(child)


@pytest.mark.medium
def test_python_operators_match_the_syntax_tree():
    """Counted once more by Python's own parser, over all sources."""
    kinds = {}
    for mutant in all_mutants():
        if mutant.path.endswith(".py"):
            kind = "unary" if mutant.unary else "binary"
            kinds[mutant.path, kind] = kinds.get((mutant.path, kind), 0) + 1
    expected = {}
    for path in {path for path, _ in kinds}:
        for node in nodes(ast.parse((ROOT / path).read_text(encoding="utf-8"))):
            if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
                expected[path, "unary"] = expected.get((path, "unary"), 0) + 1
            elif isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.Add | ast.Sub):
                expected[path, "binary"] = expected.get((path, "binary"), 0) + 1
    assert kinds == expected


def test_every_controller_and_plant_source_is_in_the_plan():
    for path in [*(ROOT / "controller").rglob("*.py"), *(ROOT / "controller").rglob("*.c")]:
        name = path.relative_to(ROOT).as_posix()
        if name not in NO_MATHEMATICS and mutants_of(name, path.read_text(encoding="utf-8")):
            assert part_of(name)
    for path in (ROOT / "plant_fmu" / "csrc").glob("*.c"):
        assert part_of(path.relative_to(ROOT).as_posix())


def test_planned_tests_exist_and_equivalent_mutants_have_reasons():
    assert all((ROOT / test).is_file() for part in parts() for test in part.tests)
    assert all(reason for reason in equivalent().values())


@pytest.mark.medium
def test_a_sample_repeats_and_has_both_languages():
    mutants = all_mutants()
    one, same, other = (sample(mutants, 40, seed) for seed in (1, 1, 2))
    assert one == same != other and len(one) == 40
    assert {m.path.rpartition(".")[2] for m in one} >= {"py", "c"}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="needs cc")
def test_tested_mutant_is_killed(tmp_path):
    from tests.mutation import running

    mutants = {m.key: m for m in all_mutants() if m.path == "controller/restoring.py"}
    results = running.results_of(list(mutants.values())[:2], 1, tmp_path / "results.jsonl")
    assert all(not r.survived and not r.doubtful and r.by for r in results.values())
    again = running.results_of(list(mutants.values())[:2], 1, tmp_path / "results.jsonl")
    assert again == results
