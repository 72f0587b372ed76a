"""The choice of variants, missing requirements, verification, and the report of results."""

import json
import subprocess
import sys
from collections import Counter

import pytest

from tests.portability import running
from tests.portability.kernels import features_of
from tests.portability.running import BrokenError, NotToBeHadError, counted, environment_of, run
from tests.portability.variants import NUMPY, VARIANTS, Machine, Result, by_turns, chosen, table

BY_NAME = {variant.name: variant for variant in VARIANTS}
AVX2 = frozenset({"sse3", "avx2", "fma3"})
AVX512 = AVX2 | {"avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl"}
OLD = Machine({"numpy": "Haswell", "scipy": "Haswell"}, AVX2, ("AVX2",))
NEW = Machine({"numpy": "SkylakeX", "scipy": "SkylakeX"}, AVX512, ("X86_V3", "X86_V4"))


def test_a_list_of_names_chooses_variants():
    assert [variant.name for variant in chosen(" py313, haswell,haswell")] == ["py313", "haswell"]
    assert chosen("") == list(VARIANTS)
    with pytest.raises(ValueError, match="--only west: expected one of haswell, "):
        chosen("haswell,west")


def test_variants_are_rotated_evenly_by_commit():
    commits = [f"{i * 2654435761 % 2**160:040x}" for i in range(20 * len(VARIANTS))]
    first = Counter(by_turns(commit, VARIANTS)[0].name for commit in commits)
    assert set(first.values()) == {20}
    order = by_turns(commits[7], VARIANTS)
    assert sorted(order, key=VARIANTS.index) == list(VARIANTS)


def test_missing_processor_features_are_named():
    assert BY_NAME["skylakex"].reason_to_skip(NEW) == ""
    assert BY_NAME["skylakex"].reason_to_skip(OLD).startswith("the processor lacks avx512f, avx512cd")
    assert BY_NAME["zen"].reason_to_skip(OLD) == ""
    apple = Machine({}, frozenset({"neon"}), ())
    assert BY_NAME["haswell"].reason_to_skip(apple) == "neither NumPy nor SciPy brings an OpenBLAS along"
    assert "beyond the least" in BY_NAME[NUMPY].reason_to_skip(apple)
    assert BY_NAME["py312"].reason_to_skip(apple) == ""


def test_features_are_read_from_linux():
    text = "processor : 0\nflags\t\t: fpu pni fma avx2\nbugs : none\n\nprocessor : 1\nflags : fpu\n"
    assert features_of(text) == {"fpu", "sse3", "fma3", "avx2"}
    assert features_of("Processor : ARMv8\nFeatures : fp asimd\n") == {"fp", "asimd"}
    assert features_of("nothing") == set()


def test_variant_needs_its_kernel_in_every_package():
    half = Machine({"numpy": "Haswell", "scipy": "SkylakeX"}, AVX512, ())
    assert BY_NAME["haswell"].not_taken(half) == "OpenBLAS of scipy runs its kernels for SkylakeX"
    assert BY_NAME["zen"].not_taken(OLD) == ""
    assert BY_NAME["py311"].not_taken(half) == ""
    assert BY_NAME[NUMPY].not_taken(NEW) == "NumPy still takes its code for X86_V3, X86_V4"


def test_variant_environment_excludes_inherited_variables(monkeypatch):
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Zen")
    there = environment_of(BY_NAME[NUMPY], NEW)
    assert there["NPY_DISABLE_CPU_FEATURES"] == "X86_V3,X86_V4"
    assert "OPENBLAS_CORETYPE" not in there


REPORT = """<testsuites><testsuite tests="4">
<testcase classname="a" name="one"/><testcase classname="a" name="two"><skipped/></testcase>
<testcase classname="b" name="three"><failure>no</failure></testcase>
<testcase classname="b" name="four"><error>no</error></testcase></testsuite></testsuites>"""


def test_results_are_counted():
    assert counted("zen", REPORT, 3.0) == Result("zen", 1, 2, 1, 3.0, "failed: b.three, b.four")
    assert not counted("zen", "<testsuites><testsuite/></testsuites>", 3.0).good


def test_skipped_variants_pass_and_are_reported():
    results = [
        Result("haswell", 5, 0, 1, 12.4, kernels=("Haswell",)),
        Result("skylakex", remark="the processor lacks avx512f", run=False),
        Result("zen", 4, 1, 1, 11.0, "failed: a.one"),
        Result("prescott", seconds=9.0, remark="ended after 9 s"),
    ]
    assert [result.good for result in results] == [True, True, False, False]
    assert table(results).splitlines() == [
        "variant          passed  failed skipped  seconds  kernels",
        "haswell               5       0       1       12  Haswell",
        "skylakex        not run: the processor lacks avx512f",
        "zen                   4       1       1       11  failed: a.one",
        "prescott              0       0       0        9  ended after 9 s",
    ]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Variants work in a folder of the test's own, and are taken to be what they are to be."""
    monkeypatch.setattr(running, "FOLDER", tmp_path)
    monkeypatch.setattr(running, "ROOT", tmp_path)
    monkeypatch.setattr(running, "look", lambda python, environment: OLD)
    return tmp_path


@pytest.mark.slow
def test_variant_runs_its_tests_and_names_failures(here):
    (here / "test_two.py").write_text("import os\ndef test_a(): pass\ndef test_b(): assert 'CORE' in os.environ\n")
    result = run(BY_NAME["haswell"], OLD, ["-p", "no:randomly", "test_two.py"], 60.0)
    assert (result.passed, result.failed, result.kernels) == (1, 1, ("Haswell",))
    assert result.remark == "failed: test_two.test_b"


@pytest.mark.slow
def test_variant_that_hangs_is_ended_and_reported(here):
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

    monkeypatch.setattr(running, "_python_of", python_of)
    result = run(BY_NAME["py314"], OLD, [], 60.0)
    assert (result.good, result.remark) == (good, "no Python 3.14: none")


def test_reason_is_the_error_and_its_first_cause():
    said = "error: No solution found\n  cause: numba has no usable wheels\n  cause: more\n\nhint: build it\n"
    assert running.reason_of(said) == "No solution found; numba has no usable wheels"
    assert running.reason_of("pip: not found\n\n") == "pip: not found"


@pytest.mark.slow
def test_active_blas_kernels_are_queried():
    pytest.importorskip("threadpoolctl")
    command = [sys.executable, "-m", "tests.portability.kernels"]
    about = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert about["features"]
    assert all(about["kernels"].values())
