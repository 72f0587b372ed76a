"""The choice of variants, missing requirements, verification, and the report of results."""

import os
import sys
from collections import Counter
from pathlib import Path

import pytest

from tests.portability import variants
from tests.portability.variants import (
    NUMPY,
    VARIANTS,
    Machine,
    Result,
    chosen,
    counted,
    look,
    run,
    table,
)  # fmt: skip

BY_NAME = {variant.name: variant for variant in VARIANTS}
AVX2 = frozenset({"sse3", "avx2", "fma3"})
AVX512 = BY_NAME["skylakex"].needs
OLD = Machine({"numpy": "Haswell", "scipy": "Haswell"}, AVX2, ("AVX2",))
NEW = Machine({"numpy": "SkylakeX", "scipy": "SkylakeX"}, AVX2 | {*AVX512}, ("X86_V3", "X86_V4"))
HALF = Machine({"numpy": "Haswell", "scipy": "SkylakeX"}, AVX2 | {*AVX512}, ())
KERNELS = "OpenBLAS of {} runs its kernels for"
APPLE = Machine({}, frozenset({"neon"}), ())


def test_names_and_commits_choose_variants():
    """Commits choose evenly which is the first."""
    assert [variant.name for variant in chosen(" py313, haswell,haswell")] == ["py313", "haswell"]
    assert chosen("") == list(VARIANTS)
    with pytest.raises(ValueError, match="--only west: expected one of haswell, "):
        chosen("haswell,west")
    commits = [f"{i * 2654435761 % 2**160:040x}" for i in range(20 * len(VARIANTS))]
    assert set(Counter(chosen("", commit)[0].name for commit in commits).values()) == {20}
    assert sorted(chosen("", commits[7]), key=VARIANTS.index) == list(VARIANTS)


@pytest.mark.parametrize(
    ("name", "machine", "reason_to_skip", "fault"),
    [
        ("skylakex", NEW, "", ""),
        ("skylakex", OLD, f"the processor lacks {', '.join(AVX512)}", f"{KERNELS.format('numpy')} Haswell"),
        ("zen", OLD, "", ""), ("haswell", HALF, "", f"{KERNELS.format('scipy')} SkylakeX"),
        ("haswell", APPLE, "neither NumPy nor SciPy brings an OpenBLAS along", ""), ("py311", HALF, "", ""),
        (NUMPY, APPLE, "NumPy has no code for what this processor has beyond the least", ""),
        (NUMPY, NEW, "", "NumPy still takes its code for X86_V3, X86_V4"), ("py312", APPLE, "", ""),
    ],
)  # fmt: skip
def test_missing_features_and_kernels_that_are_not_taken_are_named(name, machine, reason_to_skip, fault):
    assert (BY_NAME[name].reason_to_skip(machine), BY_NAME[name].not_taken(machine)) == (reason_to_skip, fault)


REPORT = """<testsuites><testsuite tests="4">
<testcase classname="a" name="one"/><testcase classname="a" name="two"><skipped/></testcase>
<testcase classname="b" name="three"><failure>no</failure></testcase>
<testcase classname="b" name="four"><error>no</error></testcase></testsuite></testsuites>"""


def test_results_are_counted_and_skipped_variants_pass():
    assert counted("zen", REPORT, 3.0) == Result("zen", 1, 2, 1, 3.0, "failed: b.three, b.four")
    assert not counted("zen", "<testsuites><testsuite/></testsuites>", 3.0).good
    results = [
        Result("haswell", 5, 0, 1, 12.4, kernels=("Haswell",)), Result("skylakex", remark="it lacks it", run=False),
        Result("zen", 4, 1, 1, 11.0, "failed: a.one"), Result("prescott", seconds=9.0, remark="ended after 9 s"),
    ]  # fmt: skip
    assert [result.good for result in results] == [True, True, False, False]
    assert [" ".join(line.split()) for line in table(results).splitlines()[1:]] == [
        "haswell 5 0 1 12 Haswell", "skylakex not run: it lacks it", "zen 4 1 1 11 failed: a.one",
        "prescott 0 0 0 9 ended after 9 s",
    ]  # fmt: skip


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Variants work in a folder of the test's own, and are taken to be what they are to be."""
    monkeypatch.setattr(variants, "FOLDER", tmp_path)
    monkeypatch.setattr(variants, "ROOT", tmp_path)
    monkeypatch.setattr(variants, "look", lambda python, environment: OLD)
    return tmp_path


@pytest.mark.slow
def test_variant_runs_its_tests_and_names_failures_or_a_hang(here):
    (here / "test_two.py").write_text("import os\ndef test_a(): pass\ndef test_b(): assert 'CORE' in os.environ\n")
    result = run(BY_NAME["haswell"], OLD, ["-p", "no:randomly", "test_two.py"], 60.0)
    assert (result.passed, result.failed, result.kernels) == (1, 1, ("Haswell",))
    assert result.remark == "failed: test_two.test_b"
    (here / "test_one.py").write_text("import time\ndef test_a(): time.sleep(300)\n")
    result = run(BY_NAME["haswell"], OLD, ["-p", "no:randomly", "test_one.py"], 1.0)
    assert not result.good and result.remark.startswith("ended after 1 s; last in haswell/output.txt: ")


def test_ineffective_variant_fails_before_any_test(here):
    result = run(BY_NAME["skylakex"], NEW, ["never.py"], 60.0)
    assert result.run and not result.good
    assert result.remark == "OpenBLAS of numpy runs its kernels for Haswell"


@pytest.mark.slow
def test_active_blas_kernels_and_features_are_queried():
    pytest.importorskip("threadpoolctl")
    seen = look(Path(sys.executable), dict(os.environ))
    assert seen.features and all(seen.kernels.values())
    assert not Path("/proc/cpuinfo").exists() or not seen.features & {"pni", "fma"}  # by NumPy's names
