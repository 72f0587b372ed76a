"""Stick inputs for identification: what they are made of, and that runs of them determine what was promised."""

import csv
import json
import re

import numpy as np
import pytest

from cosim.command_line.cli import main
from cosim.identification import excitation
from cosim.identification.excitation import (
    AXES,
    BEGIN,
    PERIOD,
    RETURN,
    ROW,
    SECONDS,
    candidate_segments,
    choose_segments,
    excitation_scenario,
    excursions_of,
    information,
    keep_inside,
    rehearse,
    schedule,
)  # fmt: skip
from cosim.identification.parameters import free_parameters
from cosim.simulation.commands.commands import SetMode, validate_command
from plant_fmu import Plant, load_vehicle

FREE = ("hydrodynamics.quadratic_damping.1", "hydrodynamics.added_mass.1.1", "hydrostatics.buoyancy")


VEHICLE = load_vehicle("bluerov2_heavy")


def candidates(axes=(True,) * 6):
    return list(candidate_segments(np.array(axes), np.random.default_rng(0)))


def test_sticks_are_within_range_with_zero_mean_on_actuated_axes():
    for segment in candidates():
        assert segment.sticks.shape == (round(SECONDS / PERIOD), 6)
        assert np.abs(segment.sticks).max() <= 1.0
        assert segment.sticks.mean(axis=0) == pytest.approx(np.zeros(6), abs=1e-12)
    axes = (True, False, True, False, False, True)
    assert all(not segment.sticks[:, [1, 3, 4]].any() for segment in candidates(axes))


def test_schedule_returns_between_segments_with_valid_commands():
    segments = [s for s in candidates() if s.mode == "stabilize"][:2]
    commands = schedule(segments)
    for _, command in commands:
        validate_command(command)
    modes = [(k * ROW, command.mode) for k, command in commands if isinstance(command, SetMode)]
    again = BEGIN + SECONDS + RETURN
    expected = [(BEGIN, "stabilize"), (BEGIN + SECONDS, "reach"), (again, "stabilize"), (again + SECONDS, "reach")]
    assert [mode for _, mode in modes] == [mode for _, mode in expected]
    assert [time for time, _ in modes] == pytest.approx([time for time, _ in expected])


@pytest.mark.slow  # compiles the prediction
def test_surge_segment_informs_its_damping_and_rest_does_not():
    steps = next(s for s in candidates() if s.mode == "depth_hold" and s.title.startswith("surge: steps"))
    parameters = free_parameters(VEHICLE, FREE)
    scenario = excitation_scenario("bluerov2_heavy", VEHICLE, 4.0, BEGIN + SECONDS)
    moving, resting = (
        information(rehearse(scenario, schedule([s])).log(), VEHICLE, parameters) for s in (steps, steps.scaled(0, 0))
    )
    scale = np.array([p.deviation for p in parameters[:2]])
    assert moving[1, 1] > 0.0
    assert (np.diag(moving)[:2] * scale**2 > 1e3 * np.diag(resting)[:2] * scale**2).all()


def test_segment_choice_complements_known_information():
    """Two of three candidates are alike: the third is taken second."""
    parameters = free_parameters(VEHICLE, FREE)[:2]
    scale = np.array([p.deviation for p in parameters])
    first, second = np.diag([100.0, 0.0]), np.diag([0.0, 80.0])
    matrices = [m / np.outer(scale, scale) for m in (first, 0.99 * first, second)]
    assert sorted(choose_segments(matrices, parameters, 2)) == [0, 2]


@pytest.mark.medium
def test_segment_is_made_smaller_until_other_vehicles_stay_inside():
    """Steps of full surge, and vehicles with half the damping in a current: forces become smaller, moments stay."""
    full = next(s for s in candidates() if s.mode == "manual" and s.title.startswith("all axes: steps of 2"))
    box, scenario = (6.0, 6.0, 4.0), excitation_scenario("bluerov2_heavy", VEHICLE, 4.0, BEGIN + SECONDS + RETURN)
    halved = {f"quadratic_damping[{i}]": 0.5 * float(x) for i, x in enumerate(scenario.vehicle.quadratic_damping, 1)}
    other = scenario.replace({"plant.current": [0.05, 0.05, 0.0], "plant.parameters": halved})
    before = excursions_of(rehearse(other, schedule([full])), scenario, box, 1)
    (reduced,) = keep_inside([full], scenario, box, [other])
    after = excursions_of(rehearse(other, schedule([reduced])), scenario, box, 1)
    assert before[0] > 1.0 >= after[0]
    assert np.abs(reduced.sticks[:, :3]).max() < np.abs(full.sticks[:, :3]).max()
    assert (reduced.sticks[:, 3:] == full.sticks[:, 3:]).all()


def test_nonempty_folder_is_rejected(tmp_path, capsys):
    (tmp_path / "mine").write_text("")
    assert main(["identify", "--excite", "--vehicle", "bluerov2_heavy", "--out", str(tmp_path)]) == 2
    assert "is not empty" in capsys.readouterr().err


@pytest.mark.slow
def test_identification_recovers_the_plant_from_an_excitation_run(tmp_path, monkeypatch, capsys):
    """The run of another plant than the one that the sticks were chosen for becomes the numbers of that plant."""
    segments = candidates()[10:60:4]
    monkeypatch.setattr(excitation, "candidate_segments", lambda axes, rng: segments)
    pool, run, mine = tmp_path / "pool", tmp_path / "run", tmp_path / "mine.toml"
    box = ["--box", "8", "8", "4", "--depth", "4"]
    start = ["--vehicle", "bluerov2_heavy"]
    assert main(["identify", "--excite", *start, *box, "--time", "55", "--free", *FREE, "--out", str(pool)]) == 0
    assert "they determine all 3 free numbers" in capsys.readouterr().out
    page = (pool / "excite.html").read_text()
    assert "What to expect" in page and "<svg" in page

    with (pool / "sticks.csv").open() as file:
        rows = list(csv.DictReader(file))
    times = [float(row["time_s"]) for row in rows]
    assert times == sorted(times) and {row["mode"] for row in rows} <= {"return", "manual", "stabilize", "depth_hold"}
    changes = np.array([time for time, row in zip(times, rows, strict=True) if row["mode"] != "return"])
    for rate in (2.0, 4.0, 5.0, 10.0, 20.0, 25.0, 50.0):  # Hz, of logs: no step with any
        assert np.histogram(changes * rate % 1.0, 4, (0.0, 1.0))[0] == pytest.approx(len(changes) / 4, rel=0.1), rate
    log = [json.loads(line)["command"] for line in (pool / "commands.jsonl").read_text().splitlines()]
    wrenches = [command["wrench"] for command in log if command["command"] == "manual_control"]
    played = [[float(row[a]) for a in AXES]
              for row in rows if row["mode"] != "return"]  # fmt: skip
    assert np.array(played) == pytest.approx(np.array(wrenches), abs=1e-4)

    truth = ["--set", "plant.parameters.buoyancy=130.5", "--set", "plant.parameters.quadratic_damping[1]=100.0"]
    replay = ["--replay-commands", str(pool / "commands.jsonl"), "--no-report", "--out", str(run), "-q"]
    assert main(["run", str(pool / "excite.toml"), *replay, *truth]) == 0
    assert main(["identify", str(run), *start, "--free", *FREE, "--out", str(mine)]) == 0
    assert "chi² is" in capsys.readouterr().out
    text, page = mine.read_text(), mine.with_suffix(".html").read_text()
    assert text.startswith("# Identified by cosim identify from run") and " ± " in text
    assert not re.search(r'(src|href)="https?:', page) and "Hold the start velocity" in page
    found = load_vehicle(mine)
    assert found.name == "mine" and found.linear_damping == pytest.approx(VEHICLE.linear_damping)
    assert found.quadratic_damping[0] == pytest.approx(100.0, rel=0.01)
    assert found.added_mass[0, 0] == pytest.approx(VEHICLE.added_mass[0, 0], rel=0.02)
    assert found.buoyancy == pytest.approx(130.5, abs=0.02)
    with Plant(found) as plant:
        plant.initialize()
        plant.step(0.1)
