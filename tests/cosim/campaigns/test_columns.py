"""Columns built from buffers equal those of pyarrow."""

import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest

from cosim.campaigns.store.columns import of_numbers, of_texts, to_array
from cosim.campaigns.sweeps.rows import schema_of

N = 37  # no multiple of the eight facts in a byte


@pytest.mark.parametrize("dtype", [np.float64, np.int64, np.bool_])
@pytest.mark.parametrize("share", [None, 0.0, 0.3, 1.0])
def test_numeric_and_boolean_columns_match_pyarrow(dtype, share):
    rng = np.random.default_rng(3)
    values = (rng.normal(size=(N, 3)) * 3.0).astype(dtype)[:, 1]  # a column lies in steps
    absent = None if share is None else rng.random(N) < share
    column = of_numbers(values, absent)
    column.validate(full=True)
    assert column.equals(pa.array(values.copy(), mask=absent))
    assert column.null_count == (0 if absent is None else absent.sum())


@pytest.mark.parametrize("texts", [[], [None, None], ["", "ab", None, "tiefe ö", "x" * 1000], ["only"]])
def test_text_columns_match_pyarrow(texts):
    column = of_texts(texts)
    column.validate(full=True)
    assert column.equals(pa.array(texts, pa.string()))


COLUMNS = [
    pa.chunked_array([[1.0, None], [], [float("inf"), -0.0]]),
    pa.chunked_array([[3, -(2**62)], [7]]),
    pa.chunked_array([[True, False], [True] * 9]),
    pa.chunked_array([[True, None]]),
    pa.chunked_array([["a", None], ["b"]]),
    pa.chunked_array([], pa.float64()),
    pa.chunked_array([], pa.bool_()),
]


@pytest.mark.parametrize("column", COLUMNS, ids=str)
def test_array_columns_match_pyarrow(column):
    array, expected = to_array(column), column.to_numpy()
    assert array.dtype == expected.dtype
    np.testing.assert_array_equal(array, expected)


SWEEP = """
import sys
from pathlib import Path
from cosim.campaigns.sweeps.design import Design, vary_from
from cosim.campaigns.sweep import run_sweep
from cosim.scenario.scenario import load_scenario

scenario = load_scenario("paper", ["arbiter.engine=closed", "time.duration=0.1"])
design = Design(vary_from(["initial.position.1=-2:2"]), "random", 3, 0)
assert run_sweep(scenario, design, Path(sys.argv[1]) / "sweep").flown == 3
assert "pandas" not in sys.modules
"""


@pytest.mark.slow
def test_sweep_does_not_import_pandas(tmp_path):
    pytest.importorskip("pandas")
    done = subprocess.run([sys.executable, "-c", SWEEP, tmp_path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("key", ["row", "seed", "reached", "refused"])
def test_no_key_of_a_sweep_has_the_name_of_another_column(key):
    with pytest.raises(ValueError, match=f"'{key}' varies"):
        schema_of(("limit.force", key))
