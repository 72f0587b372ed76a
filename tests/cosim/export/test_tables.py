"""CSV, read back by pandas: the record to the last bit; groups of signals."""

import re
from keyword import iskeyword

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.export import export_run
from cosim.export.names import group_columns, valid_names
from cosim.results.record import load_record
from tests.cosim.export.conftest import assert_same_bits


@pytest.mark.parametrize("which", ["run", "killed"])
def test_pandas_reads_the_record_to_the_last_bit(which, request, tmp_path):
    pandas = pytest.importorskip("pandas")
    folder = request.getfixturevalue(which)
    path, units = export_run(folder, "csv", tmp_path / "out.csv")
    # the reader that is exact is the only one since pandas 3
    exact = {} if int(pandas.__version__.partition(".")[0]) >= 3 else {"float_precision": "round_trip"}
    table, about, record = pandas.read_csv(path, **exact), pandas.read_csv(units, index_col="name"), load_record(folder)
    assert list(table) == list(record.units)
    assert set(table.dtypes) == {np.dtype(float)}
    for name in record.units:
        assert_same_bits(table[name].to_numpy(), record[name], name)
    assert about["unit"].fillna("").to_dict() == record.units
    assert list(about["description"]) == [column.description for column in record.columns]


@pytest.mark.medium
@given(st.lists(st.text(min_size=1), unique=True))
def test_sanitized_names_are_unique_identifiers(names):
    made = valid_names(names)
    assert len(set(made)) == len(names)
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,62}", name, re.ASCII) for name in made)


def test_sanitized_names_resemble_the_originals():
    assert valid_names(["position.x", "thrust[1]", "port wall.clearance", "position_x", "1"]) == [
        "position_x", "thrust_1", "port_wall_clearance", "position_x_2", "n1",
    ]  # fmt: skip
    assert not any(map(iskeyword, valid_names(["goal.value"])))


def test_groups_hold_each_signal_once(run):
    columns = load_record(run).columns
    groups = group_columns(columns)
    assert sorted(i for members in groups.values() for i in members.values()) == list(range(len(columns)))
    assert groups["clearance"].keys() >= {"goal", "port wall", "back wall"}
    assert list(groups["position"]) == ["x", "y", "z"]
    assert "time" in groups["step"]
