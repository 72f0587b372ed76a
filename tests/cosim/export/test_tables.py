"""CSV, NPZ and MAT, read back by pandas, NumPy and SciPy: the record to the last bit."""

import json
import re
from keyword import iskeyword

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import loadmat

from cosim.export import export_run
from cosim.export.names import group_columns, valid_names
from cosim.results.record import load_record
from cosim.scenario.scenario import load_scenario


def bits(array):
    return np.asarray(array, dtype=float).view(np.uint64)


def same(a, b):
    """Whether two signals are equal to the last bit, but for which NaN it is."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return a.shape == b.shape and bool(((bits(a) == bits(b)) | (np.isnan(a) & np.isnan(b))).all())


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
    assert all(same(table[name], record[name]) for name in record.units)
    assert about["unit"].fillna("").to_dict() == record.units
    assert list(about["description"]) == [column.description for column in record.columns]


@pytest.mark.parametrize("which", ["run", "killed"])
def test_numpy_reads_the_record_to_the_last_bit(which, request, tmp_path):
    folder = request.getfixturevalue(which)
    (path,) = export_run(folder, "npz", tmp_path / "out.npz")
    record = load_record(folder)
    with np.load(path, allow_pickle=False) as data:
        assert dict(zip(data["names"].tolist(), data["units"].tolist(), strict=True)) == record.units
        assert all(same(data[name], record[name]) for name in record.units)
        assert str(data["scenario"]) == (folder / "scenario.toml").read_text()
        assert json.loads(str(data["summary"]))["status"] == ("completed" if which == "run" else "killed")


def test_the_scenario_in_a_file_is_one_that_runs(run, tmp_path):
    (path,) = export_run(run, "npz", tmp_path / "out.npz", signals=["time"])
    with np.load(path) as data:
        (tmp_path / "again.toml").write_text(str(data["scenario"]))
    assert load_scenario(tmp_path / "again.toml").goal == load_scenario(run / "scenario.toml").goal


@pytest.mark.parametrize("which", ["run", "killed"])
def test_scipy_reads_the_record_to_the_last_bit(which, request, tmp_path):
    folder = request.getfixturevalue(which)
    (path,) = export_run(folder, "mat", tmp_path / "out.mat")
    data, record = loadmat(path, simplify_cells=True), load_record(folder)
    units = [unit if isinstance(unit, str) else "" for unit in data["units"]]  # an empty text comes back as no letters
    assert dict(zip(data["names"].tolist(), units, strict=True)) == record.units
    fields = list(data["signals"])
    assert fields[:2] == ["time", "position_x"]
    assert all(re.fullmatch(r"[A-Za-z]\w{0,62}", field, re.ASCII) for field in fields)
    for field, name in zip(fields, record.units, strict=True):
        assert same(data["signals"][field], record[name]), name
    raw = loadmat(path)
    assert raw["signals"].dtype.names == tuple(fields)
    assert raw["signals"][0, 0]["time"].shape == (len(record["time"]), 1)  # a column, as tables want it
    assert {cell.dtype.kind for cell in raw["units"][0]} == {"U"}
    assert raw["units"].shape == raw["names"].shape == (1, len(fields))  # a row of cells, as VariableUnits wants it


def test_more_than_a_mat_file_holds_is_refused(run, tmp_path, monkeypatch):
    from cosim.errors import ExportError
    from cosim.export.formats import mat

    monkeypatch.setattr(mat, "_GREATEST", 1000)
    with pytest.raises(ExportError, match=r"expected 0\.0 at most"):
        export_run(run, "mat", tmp_path / "out.mat")
    assert not list(tmp_path.iterdir())


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
