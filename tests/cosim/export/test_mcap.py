"""MCAP read back by its own library: bit-identical signals and the orientation of the scene."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cosim.export import export_run
from cosim.export.names import valid_names
from cosim.results.record import load_record
from cosim.results.run_result import load_run
from cosim.simulation.commands.commands import AddObstacle, ChangeSetting, SetTarget
from tests.cosim.export.conftest import assert_same_bits
from tests.cosim.records import steered_run

mcap_reader = pytest.importorskip("mcap.reader")
decoder = pytest.importorskip("mcap_protobuf.decoder")

WELL_KNOWN = {
    "/tf": "foxglove.FrameTransforms",
    "/tf_static": "foxglove.FrameTransforms",
    "/vehicle/pose": "foxglove.PoseInFrame",
    "/vehicle/model": "foxglove.SceneUpdate",
    "/scene": "foxglove.SceneUpdate",
    "/log": "foxglove.Log",
}


class Read:
    """All of a file."""

    def __init__(self, path):
        self.messages = {}
        with path.open("rb") as file:
            reader = mcap_reader.make_reader(file, decoder_factories=[decoder.DecoderFactory()])
            self.summary = reader.get_summary()
            self.attached = {a.name: a.data.decode() for a in reader.iter_attachments()}
            for schema, channel, message, decoded in reader.iter_decoded_messages():
                assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
                self.messages.setdefault(channel.topic, []).append((message.log_time, decoded))

    def signal(self, group, field):
        return np.array([getattr(decoded, field) for _, decoded in self.messages[f"/signals/{group}"]])


def exported(run, folder, **choice):
    return Read(*export_run(run, "mcap", folder / "out.mcap", **choice))


@pytest.fixture(scope="module")
def read(run, tmp_path_factory):
    return exported(run, tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def read_killed(killed, tmp_path_factory):
    return exported(killed, tmp_path_factory.mktemp("killed"))


def channels_of_signals(read):
    """Return the group and the field of each signal by name, from the channel metadata."""
    return {
        re.match(r"(.+?) \[[^]]*]: ", text)[1]: (channel.topic.removeprefix("/signals/"), field)
        for channel in read.summary.channels.values()
        if channel.topic.startswith("/signals/")
        for field, text in channel.metadata.items()
    }


@pytest.mark.parametrize("which", ["run", "killed"])
def test_every_signal_is_there_to_the_last_bit(which, request):
    read = request.getfixturevalue("read" if which == "run" else "read_killed")
    record, where = load_record(request.getfixturevalue(which)), channels_of_signals(read)
    assert where.keys() == record.units.keys()
    assert "timestamp" not in {field for _, field in where.values()}  # PlotJuggler takes it for a time stamp
    (position,) = (c for c in read.summary.channels.values() if c.topic == "/signals/position")
    assert position.metadata["x"].startswith("position.x [m]: ")
    for name, (group, field) in where.items():
        assert_same_bits(read.signal(group, field), record[name], name)


def test_times_are_simulated_nanoseconds_in_order(read, run):
    time = load_record(run)["time"]
    logged = [at for at, _ in read.messages["/signals/position"]]
    assert logged == [round(t * 1e9) for t in time]
    assert read.summary.statistics.message_start_time == 0
    assert [at for at, _ in read.messages["/tf"]] == logged


def test_scene_uses_foxglove_message_schemas(read, run):
    schemas = read.summary.schemas
    topics = {c.topic: schemas[c.schema_id].name for c in read.summary.channels.values()}
    assert {topic: name for topic, name in topics.items() if not topic.startswith("/signals/")} == WELL_KNOWN
    assert read.messages.keys() == topics.keys()
    assert read.attached["scenario.toml"] == (run / "scenario.toml").read_text()
    assert '"status": "completed"' in read.attached["summary.json"]


def turn(message):
    return Rotation.from_quat([message.x, message.y, message.z, message.w])


def vector(message):
    return np.array([message.x, message.y, message.z])


def test_map_frame_converts_ned_to_z_up(read):
    ((at, static),) = read.messages["/tf_static"]
    (upright,) = static.transforms
    assert (at, upright.parent_frame_id, upright.child_frame_id) == (0, "map", "ned")
    north, east, down = np.eye(3)
    assert turn(upright.rotation).apply([north, east, down]) == pytest.approx(
        np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    )


def test_frames_lead_from_the_world_to_the_vehicle(read, run):
    record = load_record(run)
    for k in (0, 50, 100):
        _, message = read.messages["/tf"][k]
        place, body = message.transforms
        assert (place.parent_frame_id, place.child_frame_id) == ("ned", "place")
        assert (body.parent_frame_id, body.child_frame_id) == ("place", "body")
        assert vector(place.translation).tolist() == [record[f"position.{axis}"][k] for axis in "xyz"]
        e = [record[f"quaternion.e{i}"][k] for i in range(4)]
        assert [body.rotation.w, *vector(body.rotation)] == e
        _, pose = read.messages["/vehicle/pose"][k]
        assert pose.frame_id == "ned"
        assert vector(pose.pose.position).tolist() == vector(place.translation).tolist()


def test_vehicle_keeps_its_last_pose_while_pose_is_unknown(read_killed, killed):
    record = load_record(killed)
    unknown = {round(t * 1e9) for t in record["time"][np.isnan(record["position.x"])]}
    assert len(unknown) == 20
    assert not unknown & {at for at, _ in read_killed.messages["/tf"]}
    assert len(read_killed.messages["/tf"]) == len(record["time"]) - 20


def test_every_message_of_the_scene_has_all_regions_and_one_is_active(read, run):
    flown = load_run(run)
    names = ["goal", *(secondary.region.name for secondary in flown.scenario.regions)]
    assert len(read.messages["/scene"]) >= 1
    for _, message in read.messages["/scene"]:
        assert [entity.id for entity in message.entities] == names
        active = [entity for entity in message.entities if entity.metadata[0].value == "true"]
        assert len(active) == 1
        assert active[0].texts[0].text.endswith("(active)")


def test_the_active_region_is_the_one_that_the_log_names(read):
    first = next(decoded for _, decoded in read.messages["/log"] if decoded.name == "active")
    _, scene = read.messages["/scene"][0]
    (active,) = (entity.id for entity in scene.entities if entity.metadata[0].value == "true")
    assert active in first.message


def test_shapes_use_foxglove_primitives(read):
    _, scene = read.messages["/scene"][0]
    drawn = {entity.id: entity for entity in scene.entities}
    assert vector(drawn["goal"].spheres[0].size).tolist() == [0.6, 0.6, 0.6]
    assert vector(drawn["port wall"].cubes[0].size) == pytest.approx([2.7, 0.7, 2.4])
    assert vector(drawn["port wall"].cubes[0].pose.position) == pytest.approx([7.05, -0.85, 4.0])
    heading = drawn["heading"]
    assert heading.frame_id == "place"
    assert len(heading.triangles[0].indices) % 3 == 0
    assert max(heading.triangles[0].indices) < len(heading.triangles[0].points)


def test_regions_that_move_have_frames_of_their_own(moving_run, tmp_path):
    read, record = exported(moving_run, tmp_path), load_record(moving_run)
    _, message = read.messages["/tf"][-1]
    moved = {t.child_frame_id: vector(t.translation) for t in message.transforms}
    shift = [record[f"crossing buoy.shift.{axis}"][-1] for axis in "xyz"]
    assert np.linalg.norm(shift) > 0.0
    assert moved["region crossing buoy"].tolist() == shift
    _, scene = read.messages["/scene"][0]
    assert {e.id: e.frame_id for e in scene.entities}["crossing buoy"] == "region crossing buoy"


def test_signal_selection_keeps_the_scene_complete(run, tmp_path):
    read = exported(run, tmp_path, signals=["*.clearance"], every=10)
    assert [t for t in read.messages if t.startswith("/signals/")] == ["/signals/step", "/signals/clearance"]
    assert (
        read.signal("clearance", valid_names(["port wall"])[0]).tolist()
        == load_record(run)["port wall.clearance"][::10].tolist()
    )
    assert WELL_KNOWN.keys() <= read.messages.keys()
    assert read.messages["/log"][-1][1].message == "End of the run"


@pytest.fixture(scope="module")
def steered(tmp_path_factory):
    """Return the folder of a run with an added, growing obstacle and a changed target."""
    commands = {
        20: [AddObstacle(7, (5.0, 0.0, 2.0), 0.4)],
        40: [SetTarget((4.0, -1.0, 2.0), 0.6)],
        60: [AddObstacle(7, (5.0, 0.3, 2.0), 0.8)],
        70: [ChangeSetting("regions.ship.shape.semi_axes.0", 3.5)],
    }
    return steered_run(tmp_path_factory.mktemp("steered"), ["time.duration=1"], commands).folder


@pytest.fixture(scope="module")
def read_steered(steered, tmp_path_factory):
    return exported(steered, tmp_path_factory.mktemp("steered"))


def test_spheres_as_they_are_drawn_give_the_recorded_clearances(read_steered, steered):
    """Through commands that bring them, move them and change their size."""
    read, record = read_steered, load_record(steered)
    scenes, sizes = dict(read.messages["/scene"]), set()
    scene = scenes[0]
    for k, (at, frames) in enumerate(read.messages["/tf"]):
        scene = scenes.get(at, scene)
        shifts = {t.child_frame_id: vector(t.translation) for t in frames.transforms}
        for entity in scene.entities:
            for ball in entity.spheres:
                if set(vector(ball.size)) == {ball.size.x}:
                    center = vector(ball.pose.position) + shifts.get(entity.frame_id, 0.0)
                    gap = np.linalg.norm(shifts["place"] - center) - ball.size.x / 2.0
                    sign = -1.0 if entity.id == "goal" else 1.0
                    clearance = record[f"{entity.id}.clearance"][k]
                    # while an obstacle waits, it is a hundred kilometers up
                    assert sign * gap == pytest.approx(clearance, abs=1e-6 if clearance < 1e3 else 10.0)
                    sizes.add((entity.id, round(ball.size.x, 6)))
    assert {size for name, size in sizes if name != "goal"} >= {0.8, 1.6}
    assert ("goal", 1.2) in sizes


def test_parked_obstacle_does_not_widen_the_scene(read_steered):
    _, scene = read_steered.messages["/scene"][0]
    planes = [vector(p) for e in scene.entities for drawn in e.triangles for p in drawn.points]
    assert planes
    assert np.abs(planes).max() < 200.0
