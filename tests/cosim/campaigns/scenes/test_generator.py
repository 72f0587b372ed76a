"""``cosim scenes`` against the generator that defines the scored scenes (tests/data/ORIGIN.md)."""

import errno
import hashlib
import json
from pathlib import Path

import pytest

from cosim.campaigns.scenes.scene_file import read_scenes
from cosim.command_line.cli import main

SCENES = Path(__file__).parents[3] / "data" / "scenes"
DIGESTS = json.loads((SCENES / "digests.json").read_text())


def printed(capsys, *flags):
    assert main(["scenes", *map(str, flags)]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    return said.out


@pytest.mark.parametrize("kind", DIGESTS)
def test_scenes_are_those_of_the_reference_to_the_last_digit(kind, capsys):
    came = printed(capsys, "--seed", 20_000, "--count", 6, "--kind", kind).splitlines()
    for line, expected in zip(came, (SCENES / f"{kind}.jsonl").read_text().splitlines(), strict=True):
        scene, reference = json.loads(line), json.loads(expected)
        # NumPy's sine and cosine may differ in the last digit from one processor to another
        assert list(scene) == list(reference) and json.dumps(scene) == line
        assert scene.pop("current") == pytest.approx(reference.pop("current"), rel=1e-14, abs=0.0)
        assert json.dumps(scene) == json.dumps(reference)


def test_scenes_of_another_vehicle_scale_its_restoring_forces_and_fail_its_thrusters(capsys):
    ours, theirs = (
        [json.loads(line) for line in printed(capsys, "--kind", "hard", "--count", 30, *flags).splitlines()]
        for flags in ((), ("--vehicle", "bluerov2"))
    )
    for odin, rov in zip(ours, theirs, strict=True):
        assert rov["vehicle"] == "bluerov2" and "vehicle" not in odin
        assert rov["weight_minus_buoyancy"] == pytest.approx(odin["weight_minus_buoyancy"] * 111.83 / 1226.25, rel=0.01)
        assert 1 <= rov["failed_thruster"]["index"] <= 6
        assert rov["obstacles"] == odin["obstacles"]
    assert main(["scenes", "--kind", "tour", "--vehicle", "bluerov2"]) == 2
    assert "kind is 'tour', whose scenes draw their vehicles" in capsys.readouterr().err


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize(("kind", "first"), [(kind, first) for kind, of in DIGESTS.items() for first in of])
def test_two_hundred_scenes_are_those_of_the_reference(kind, first, capsys):
    expected, digest = DIGESTS[kind][first], hashlib.sha256()
    for line in printed(capsys, "--seed", first, "--count", expected["count"], "--kind", kind).splitlines():
        scene = json.loads(line)
        del scene["current"]
        digest.update(json.dumps(scene).encode() + b"\n")
    assert digest.hexdigest() == expected["sha256"]


def test_scene_file_equals_standard_output_and_is_readable(tmp_path, capsys):
    file = tmp_path / "scenes.jsonl"
    file.write_text("older\n")
    assert printed(capsys, "--kind", "hard", "--count", 3, "--seed", 7, "--out", file) == f"{file}\n"
    assert file.read_text() == printed(capsys, "--kind", "hard", "--count", 3, "--seed", 7)
    assert [scene.seed for scene in read_scenes(file)] == [7, 8, 9]
    assert list(tmp_path.iterdir()) == [file]


def test_a_hundred_plain_scenes_from_seed_0_are_the_default(capsys):
    assert printed(capsys) == printed(capsys, "--count", 100, "--seed", 0, "--kind", "plain")


@pytest.mark.parametrize("flags", [["--count", "0"], ["--seed", "-1"], ["--count", "9" * 5000], ["--kind", "soft"]])
def test_invalid_generator_arguments_are_rejected(flags, capsys):
    with pytest.raises(SystemExit) as left:
        main(["scenes", *flags])
    assert left.value.code == 2
    said = capsys.readouterr()
    assert said.out == "" and flags[0] in said.err and len(said.err) < 500


def test_unwritable_file_gives_one_line_error_and_no_file(tmp_path, capsys, monkeypatch):
    assert main(["scenes", "--out", str(tmp_path / "nowhere" / "s.jsonl")]) == 2
    assert main(["scenes", "--out", str(tmp_path)]) == 2

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("cosim.campaigns.scenes.generator.json.dumps", full)  # in the middle of the file
    assert main(["scenes", "--out", str(tmp_path / "s.jsonl")]) == 2
    said = capsys.readouterr()
    lines = said.err.splitlines()
    assert said.out == "" and len(lines) == 3 and "No space left on device" in lines[2]
    assert all(line.startswith(f"cosim: {tmp_path}") for line in lines)
    assert list(tmp_path.iterdir()) == []
