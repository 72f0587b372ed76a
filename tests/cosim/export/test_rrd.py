"""RRD, read back by Rerun's own reader."""

import numpy as np
import pytest

from cosim.export import export_run
from cosim.results.record import load_record
from tests.cosim.export.conftest import assert_same_bits

pytest.importorskip("rerun", reason="rerun-sdk is not installed")
chunks_of = pytest.importorskip("rerun.chunk", reason="rerun-sdk is too old to read its files in Python").RrdReader


class Read:
    """All of a file: for each entity and component, times and values."""

    def __init__(self, path):
        self.columns = {}
        for chunk in chunks_of(path).stream():
            batch = chunk.to_record_batch()
            names = batch.schema.names
            times = batch["sim_time"].cast("int64").to_numpy() if "sim_time" in names else np.full(batch.num_rows, -1)
            for name in names:
                if ":" in name:
                    column = self.columns.setdefault((str(chunk.entity_path), name.partition(":")[2]), [])
                    column += [*zip(times.tolist(), batch[name].to_pylist(), strict=True)]
        for column in self.columns.values():
            column.sort(key=lambda row: row[0])

    def __getitem__(self, at):
        return [(time, value) for time, value in self.columns[at] if value is not None]

    def path_of(self, name):
        """Return the entity path of a recorded signal, which contains its name."""
        for path, component in self.columns:
            if component == "names" and self[path, "names"][0][1][0].startswith(f"{name} ["):
                return path
        raise KeyError(name)


@pytest.fixture(scope="module")
def read(run, tmp_path_factory):
    (path,) = export_run(run, "rrd", tmp_path_factory.mktemp("rrd") / "out.rrd")
    return Read(path)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("which", ["run", "killed"])
def test_every_signal_is_a_series_to_the_last_bit(which, read, request, tmp_path):
    record = load_record(request.getfixturevalue(which))
    if which == "killed":
        (path,) = export_run(request.getfixturevalue(which), "rrd", tmp_path / "out.rrd")
        read = Read(path)
    for name in record.units:
        rows = read[read.path_of(name), "scalars"]
        assert np.allclose([time for time, _ in rows], record["time"] * 1e9, rtol=0.0, atol=1.0)
        assert_same_bits(np.array([value for _, (value,) in rows]), record[name], name)


def test_the_pose_is_that_of_the_record_in_single_precision(read, run):
    record = load_record(run)
    places = [value[0] for _, value in read["/world/place", "translation"]]
    assert np.array_equal(places, record.stack([f"position.{axis}" for axis in "xyz"]).astype(np.float32))
    turns = [value[0] for _, value in read["/world/place/body", "quaternion"]]
    assert np.array_equal(turns, record.stack([f"quaternion.e{i}" for i in (1, 2, 3, 0)]).astype(np.float32))


def test_the_world_is_north_east_down(read):
    ((_, ((x, y, z),)),) = read["/world", "xyz"]
    forward, right, down = 5, 3, 2  # Rerun's numbers of directions
    assert (x, y, z) == (forward, right, down)


def test_regions_use_rerun_primitives_of_their_shape(read):
    assert read["/world/regions/goal/Ellipsoids3D", "half_sizes"][0][1] == [pytest.approx([0.3] * 3)]
    assert read[r"/world/regions/port\ wall/Boxes3D", "half_sizes"][0][1] == [pytest.approx([1.35, 0.35, 1.2])]
    assert ("/world/place/heading/Mesh3D", "triangle_indices") in read.columns


def test_events_are_logged_as_text(read):
    said = [value[0] for _, value in read["/events", "text"]]
    assert said[-1] == "End of the run"
    assert any(text.startswith("Gives way to") for text in said)


def test_commanded_change_is_drawn_from_its_time(run, tmp_path, monkeypatch):
    changes = [
        {"time": 0.5, "region": 0, "shape": {"kind": "sphere", "center": (7.0, 0.0, 4.0), "radius": 0.9}},
        {"time": 0.8, "region": 0, "shape": {"kind": "box", "center": (7.0, 0.0, 4.0), "size": (1.0, 1.0, 1.0)}},
    ]
    monkeypatch.setattr("cosim.export.viewer_scene.list_region_changes", lambda *_: changes)
    (path,) = export_run(run, "rrd", tmp_path / "out.rrd")
    read = Read(path)
    sizes = [(time, value[0][0]) for time, value in read["/world/regions/goal/Ellipsoids3D", "half_sizes"]]
    assert sizes == [(0, pytest.approx(0.3)), (500_000_000, pytest.approx(0.9))]
    assert read["/world/regions/goal/Boxes3D", "half_sizes"][0][0] == 800_000_000
    assert read["/world/regions/goal/Ellipsoids3D", "is_recursive"][0][0] == 800_000_000
