"""The benchmark that flies a real ArduSub, as far as it goes without one."""

import json
import os
import signal
import subprocess
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.autopilot import flights
from benchmarks.autopilot.flight_evaluation import clearances_at
from benchmarks.autopilot.flights import Task
from benchmarks.autopilot.scenes import random_scene
from benchmarks.autopilot.simulated_link import FAULTS, SimulatedLink
from cosim.scenario.scenario import load_scenario
from cosim.scenario.true_vehicle import true_vehicle
from plant_fmu import load_vehicle


def test_random_scenes_leave_start_dive_and_goal_free_and_are_repeatable():
    counts = set()
    for seed in range(20):
        scene = random_scene(seed)
        start, goal = np.array(scene.initial.position), np.array(scene.goal.center)
        rocks = [s.region.shape for s in scene.regions if s.region.name.startswith("rock")]
        counts.add(len(rocks))
        for rock in rocks:
            assert (
                min(np.linalg.norm(start + np.array([0.0, 0.0, d]) - rock.center) for d in (0.0, 0.6))
                > rock.radius + 0.6
            )
            assert np.linalg.norm(goal - rock.center) > rock.radius + 1.1
        assert 8.0 <= goal[0] - start[0] <= 12.0 and np.hypot(*scene.plant.current[:2]) <= 0.4
        assert random_scene(seed).toml() == scene.toml()
    assert min(counts) >= 6 and max(counts) <= 30 and len(counts) > 5


def test_the_plant_of_other_scenes_has_drag_and_added_mass_that_the_law_does_not_know():
    usual, other = (Task(f"{name}-3").load() for name in ("random", "other"))
    assert [s.region.shape for s in usual.regions] == [s.region.shape for s in other.regions]
    true, published = true_vehicle(other), load_vehicle("bluerov2_heavy_wu")
    np.testing.assert_allclose(true.added_mass, published.added_mass)
    np.testing.assert_allclose(true.quadratic_damping, published.quadratic_damping)
    assert other.vehicle == usual.vehicle and true.buoyancy == true_vehicle(usual).buoyancy


def test_a_pilot_of_the_benchmark_drives_and_lets_the_companion_resume():
    link = SimulatedLink.__new__(SimulatedLink)  # without an autopilot
    sent, link.events = [], []
    link.clock, link.others = lambda: 7.0, SimpleNamespace(send=sent.append)
    FAULTS["pilot drives"](link)
    times = [time for time, _ in link.events]
    assert times == sorted(times) and times[0] == 7.0 and times[-1] == 15.0
    for _, event in link.events:
        event()
    assert {message.x for message in sent[:-1]} == {-700}
    assert (sent[-1].command, sent[-1].param1, sent[-1].target_component) == (193, 1.0, 191)


def test_flights_that_the_file_has_are_not_flown_again(tmp_path, monkeypatch, capsys):
    """Except for those that failed, or whose plant ended."""
    tasks, flown = [Task("random-1", "wrench"), Task("docking"), Task("docking", level_dive=0.0), Task("harbour")], []
    statuses = ["completed", "failed: 90 s have passed", "", "held: lost link", "completed", "completed", "interrupted"]

    def fly(task, *rest):
        flown.append(task)
        return {"key": task.key, "status": statuses[len(flown) - 1], "reached": True, "violated": []}

    monkeypatch.setattr(flights, "fly", fly)
    out = tmp_path / "flights.jsonl"
    flights.make_flights(tasks[:3], Path("ardusub"), 0, out)
    flights.make_flights(tasks, Path("ardusub"), 0, out)
    assert flown == [*tasks[:3], *tasks[1:]]
    assert [json.loads(line)["key"] for line in out.read_text().splitlines()] == [task.key for task in tasks]
    assert "4 flights: 4 reached" in capsys.readouterr().err
    with pytest.raises(KeyboardInterrupt):
        flights.make_flights([Task("docking", "wrench"), *tasks], Path("ardusub"), 0, out)
    assert len(flown) == 7 and len(out.read_text().splitlines()) == 4


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs signals")
def test_a_kill_ends_the_autopilot(tmp_path, monkeypatch):
    program, running = tmp_path / "ardusub", flights._running
    program.write_text("#!/bin/sh\nexec sleep 100\n")
    program.chmod(0o700)
    processes, popen = [], subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **k: processes.append(popen(*a, **k)) or processes[-1])

    def fly(task, ardusub, instance, folder):
        with running(ardusub, instance, 1, folder, task):
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(10.0)

    monkeypatch.setattr(flights, "fly", fly)
    with pytest.raises(KeyboardInterrupt):
        flights.make_flights([Task("docking")], program, 0, None)
    assert [process.poll() for process in processes] == [-signal.SIGKILL]


def test_parameters_of_the_autopilot_are_numbers():
    lines = [line.split() for line in flights.PARAMETERS.read_text().splitlines() if line and line[0] != "#"]
    assert len({name for name, _ in lines}) == len(lines) > 40
    assert all(np.isfinite(float(value)) for _, value in lines)


def test_regions_move_from_the_begin_of_steering_on():
    scenario = load_scenario("pipe-inspection")
    assert scenario.goal.radius == 0.4 and scenario.goal.center == (0.2, 1.9, 4.0)
    time = np.array([-5.0, 0.0, 2.0, 10.0])
    record = {f"position.{axis}": np.full(4, value) for axis, value in zip("xyz", (0.5, 1.9, 4.0), strict=True)}
    record |= {f"quaternion.e{i}": np.full(4, float(i == 0)) for i in range(4)}
    goal = 0.4 - np.abs(0.5 - (0.2 + 0.1 * np.maximum(time, 0.0)))
    np.testing.assert_allclose(clearances_at(scenario, record, time)[:, 0], goal, atol=1e-12)
