"""What commands made of goal and regions stands in the page: it gives the recorded clearances again."""

import numpy as np
import pyarrow.parquet as pq
import pytest

from controller.regions import Region
from controller.regions.region_set import SHAPES, clearances_at
from cosim.errors import RunError
from cosim.replay.trace import trace_of
from cosim.results.record import RECORD
from cosim.results.run_result import load_run
from tests.cosim.records import filled


def shape_at(header, index, time):
    found = header["regions"][index]["shape"]
    for change in header["changes"]:
        if change["region"] == index and change["time"] <= time:
            found = change["shape"]
    fields = {key: _tuples(value) for key, value in found.items() if key not in ("kind", "drawing")}
    return SHAPES[found["kind"]](**fields)


def _tuples(value):
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def test_page_shapes_reproduce_recorded_clearances(steered):
    header, record = trace_of(steered).header, steered.record
    time = record["time"]
    positions = record.stack([f"position.{axis}" for axis in "xyz"])
    assert [region["name"] for region in header["regions"]][-2:] == ["seen 1", "seen 2"]
    checked = 0
    for index, region in enumerate(header["regions"]):
        name, points = region["name"], positions
        if f"{name}.shift.x" in record.units:
            points = positions - record.stack([f"{name}.shift.{axis}" for axis in "xyz"])
        times = sorted({0.0, *(c["time"] for c in header["changes"] if c["region"] == index)})
        for begin, end in zip(times, [*times[1:], np.inf], strict=True):
            rows = (time >= begin) & (time < end)
            if region["is_dynamic"]:
                rows &= record.stack([f"{name}.shift.{axis}" for axis in "xyz"]).any(axis=1)
            shape = Region(name, shape_at(header, index, begin), region["keep"])
            found = clearances_at(points[rows], shape)
            assert found == pytest.approx(record[f"{name}.clearance"][rows], abs=1e-9), (name, begin)
            checked += int(rows.sum())
    assert checked > 401 * len(header["regions"]) - 800  # all rows of all, but obstacles that had not come


def test_changes_are_listed_at_their_steps(steered):
    changes = trace_of(steered).header["changes"]
    names = [region["name"] for region in trace_of(steered).header["regions"]]
    told = [(round(c["time"] * 100), names[c["region"]]) for c in changes]
    assert told == [
        (20, "goal"), (40, "goal"), (60, "seen 1"), (60, "seen 2"), (90, "ship"), (140, "seen 1"), (180, "goal"),
        (200, "goal"), (200, "ship"), (200, "pile 1"), (201, "goal"), (202, "goal"), (202, "quay"),  # item by item
        (260, "goal"), (260, "ship"), (260, "pile 1"), (261, "goal"), (261, "quay"),
    ]  # fmt: skip


def test_region_gains_follow_the_commands(steered):
    header = trace_of(steered).header
    ship = [region["name"] for region in header["regions"]].index("ship")
    assert header["regions"][ship]["gain"] == 100.0
    assert [c["gain"] for c in header["changes"] if c["region"] == ship] == [100.0, 55.0, 55.0]


def test_commands_are_listed_as_events(steered):
    texts = [event["text"] for event in trace_of(steered).header["events"] if event["kind"] == "command"]
    assert texts[1] == "Commanded: Target at (4, -1, 2) m, radius 0.6 m"
    assert any("Mission of 4 items; Follows the mission" in text for text in texts)


def test_uncommanded_run_has_no_changes(docking):
    assert trace_of(docking).header["changes"] == []


def test_invalid_log_gives_one_line_error(steered, copy_of):
    folder = copy_of(steered)
    (folder / "commands.jsonl").write_text('{"step": 1}\n{"step": 2}\n')
    with pytest.raises(RunError, match=r"commands\.jsonl, line 1: .*command"):
        trace_of(load_run(folder))


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(("first", "end"), [(50, 70), (50, 401)])
def test_obstacles_added_during_an_unknown_pose_get_their_size_later(steered, copy_of, first, end):
    folder = copy_of(steered)
    table = filled(pq.read_table(folder / RECORD), ("position.x", "seen 2.clearance"), slice(first, end))
    pq.write_table(table, folder / RECORD)
    header = trace_of(load_run(folder)).header
    names = [region["name"] for region in header["regions"]]
    if end < table.num_rows:
        assert shape_at(header, names.index("seen 2"), 2.0).radius == pytest.approx(0.3)
    else:
        assert "seen 2" not in names
