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
    BrokenError,
    Machine,
    NotToBeHadError,
    Result,
    chosen,
    counted,
    look,
    reason_of,
    run,
    table,
)  # fmt: skip

BY_NAME = {variant.name: variant for variant in VARIANTS}
AVX2 = frozenset({"sse3", "avx2", "fma3"})
AVX512 = AVX2 | {"avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl"}
OLD = Machine({"numpy": "Haswell", "scipy": "Haswell"}, AVX2, ("AVX2",))
NEW = Machine({"numpy": "SkylakeX", "scipy": "SkylakeX"}, AVX512, ("X86_V3", "X86_V4"))
HALF = Machine({"numpy": "Haswell", "scipy": "SkylakeX"}, AVX512, ())
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
    ("name", "machine", "reason"),
    [
        ("skylakex", NEW, ""),
        ("skylakex", OLD, "the processor lacks avx512f, avx512cd, avx512bw, avx512dq, avx512vl"),
        ("zen", OLD, ""),
        ("haswell", APPLE, "neither NumPy nor SciPy brings an OpenBLAS along"),
        (NUMPY, APPLE, "NumPy has no code for what this processor has beyond the least"),
        ("py312", APPLE, ""),
    ],
)
def test_missing_processor_features_are_named(name, machine, reason):
    assert BY_NAME[name].reason_to_skip(machine) == reason


@pytest.mark.parametrize(
    ("name", "seen", "fault"),
    [
        ("haswell", HALF, "OpenBLAS of scipy runs its kernels for SkylakeX"),
        ("zen", OLD, ""),
        ("py311", HALF, ""),
        (NUMPY, NEW, "NumPy still takes its code for X86_V3, X86_V4"),
    ],
)
def test_variant_needs_its_kernel_in_every_package(name, seen, fault):
    assert BY_NAME[name].not_taken(seen) == fault


def test_variant_environment_excludes_inherited_variables(monkeypatch):
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Zen")
    there = BY_NAME[NUMPY].environment(NEW)
    assert there["NPY_DISABLE_CPU_FEATURES"] == "X86_V3,X86_V4" and "OPENBLAS_CORETYPE" not in there
    assert BY_NAME["haswell"].environment(NEW)["OPENBLAS_CORETYPE"] == "Haswell"


REPORT = """<testsuites><testsuite tests="4">
<testcase classname="a" name="one"/><testcase classname="a" name="two"><skipped/></testcase>
<testcase classname="b" name="three"><failure>no</failure></testcase>
<testcase classname="b" name="four"><error>no</error></testcase></testsuite></testsuites>"""


def test_results_are_counted_and_skipped_variants_pass():
    assert counted("zen", REPORT, 3.0) == Result("zen", 1, 2, 1, 3.0, "failed: b.three, b.four")
    assert not counted("zen", "<testsuites><testsuite/></testsuites>", 3.0).good
    results = [
        Result("haswell", 5, 0, 1, 12.4, kernels=("Haswell",)),
        Result("skylakex", remark="the processor lacks avx512f", run=False),
        Result("zen", 4, 1, 1, 11.0, "failed: a.one"),
        Result("prescott", seconds=9.0, remark="ended after 9 s"),
    ]
    assert [result.good for result in results] == [True, True, False, False]
    assert [line.split() for line in table(results).splitlines()] == [
        ["variant", "passed", "failed", "skipped", "seconds", "kernels"],
        ["haswell", "5", "0", "1", "12", "Haswell"],
        ["skylakex", "not", "run:", "the", "processor", "lacks", "avx512f"],
        ["zen", "4", "1", "1", "11", "failed:", "a.one"],
        ["prescott", "0", "0", "0", "9", "ended", "after", "9", "s"],
    ]


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


@pytest.mark.parametrize(("error", "good"), [(NotToBeHadError, True), (BrokenError, False)])
def test_missing_python_is_not_a_failure(here, monkeypatch, error, good):
    def python_of(version, extras):
        raise error(f"no Python {version}: none")

    monkeypatch.setattr(variants, "_python_of", python_of)
    result = run(BY_NAME["py314"], OLD, [], 60.0)
    assert (result.good, result.remark) == (good, "no Python 3.14: none")


def test_reason_is_the_error_and_its_first_cause():
    said = "error: No solution found\n  cause: numba has no usable wheels\n  cause: more\n\nhint: build it\n"
    assert reason_of(said) == "No solution found; numba has no usable wheels"
    assert reason_of("pip: not found\n\n") == "pip: not found"


@pytest.mark.slow
def test_active_blas_kernels_and_features_are_queried():
    pytest.importorskip("threadpoolctl")
    seen = look(Path(sys.executable), dict(os.environ))
    assert seen.features and all(seen.kernels.values())
    assert not Path("/proc/cpuinfo").exists() or not seen.features & {"pni", "fma"}  # by NumPy's names
