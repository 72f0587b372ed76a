"""Tables of a pool session, by the commands alone: imported, identified, and predicted where they were not fitted."""

import re
import shlex

import numpy as np
import pytest

from cosim.command_line.cli import main
from cosim.identification.log import load_log, measured_turns
from cosim.identification.parameters import free_parameters
from cosim.identification.prediction import validate
from plant_fmu import load_vehicle
from tests.cosim.identification.pool_pairs import TRUE, VEHICLE, write_pairs

RUNS, HELD_OUT = 16, 4


def imported(folder, runs):
    """Import the pairs of a folder by the command; return the runs."""
    (folder / "vehicle.toml").write_text(VEHICLE)
    for run in range(runs):
        logs = [str(folder / f"run-{run:02d}-{part}.csv") for part in ("wrench", "nav")]
        options = [
            "--map",
            str(folder / "map.toml"),
            "--vehicle",
            str(folder / "vehicle.toml"),
            "--no-report",
            "--quiet",
        ]
        assert main(["import", *logs, *options, "--out", str(folder / "runs" / f"{run:02d}")]) == 0
    return [folder / "runs" / f"{run:02d}" for run in range(runs)]


def true_r2(folder, runs):
    """R² by horizon of the true vehicle, with its true trim and delay: what noise and disturbances leave."""
    from dataclasses import replace

    from tests.cosim.identification.pool_pairs import INERTIA, MASS, WEIGHT

    vehicle = replace(
        load_vehicle(folder / "vehicle.toml"), mass=MASS, weight=WEIGHT, buoyancy=TRUE["buoyancy"], inertia=INERTIA,
        r_B=TRUE["r_B"], added_mass=TRUE["added_mass"], linear_damping=TRUE["linear"],
        quadratic_damping=TRUE["quadratic"], trim=TRUE["trim"],
    )  # fmt: skip
    logs = [load_log(run, vehicle) for run in runs]
    parameters = free_parameters(vehicle, ("thrusters.delay",))
    values = np.array([TRUE["delay"] + TRUE["lag"]])
    found = validate(logs, vehicle, parameters, values, 0.04, (2.0, 5.0), (True,))
    return {p.horizon: p.r2 for p in found if p.topic == "velocity"}


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_pool_pairs_are_predicted_nearly_as_well_as_by_the_true_vehicle(tmp_path, capsys):
    """From mass and size alone; trim and delay, which the pages do not name, are found by `--nuisance auto`."""
    write_pairs(tmp_path, seed=3)
    runs = imported(tmp_path, RUNS)
    capsys.readouterr()
    fitted, held_out = ([str(run) for run in part] for part in (runs[:-HELD_OUT], runs[-HELD_OUT:]))
    out = tmp_path / "mine.toml"
    arguments = ["--vehicle", str(tmp_path / "vehicle.toml"), "--nuisance", "auto", "--out", str(out)]
    assert main(["identify", *fitted, "--held-out", *held_out, *arguments]) == 0
    text = capsys.readouterr().out
    assert re.search(r"Chosen by .*: trim \(\+0\.\d+ ± 0\.\d+\)", text)
    line = next(line for line in text.splitlines() if "with measured attitude" in line and line.startswith("R²"))
    r2 = {
        float(h): np.array([float(x) for x in xs.split(",")]) for h, xs in re.findall(r"(\d+) s: ([\d., -]+\d)", line)
    }
    bars = {2.0: (0.89, 0.90, 0.85), 5.0: (0.82, 0.83, 0.74)}
    ceiling = true_r2(tmp_path, runs[-HELD_OUT:])
    for horizon, bar in bars.items():
        assert (r2[horizon] >= bar).all() and (r2[horizon] > ceiling[horizon] - 0.015).all(), (r2, ceiling)
    vehicle = load_vehicle(out)
    assert np.diag(vehicle.added_mass)[:3] == pytest.approx(np.diag(TRUE["added_mass"])[:3], rel=0.2)
    assert vehicle.buoyancy - vehicle.weight == pytest.approx(TRUE["buoyancy"] - 112.8, abs=0.5)
    assert vehicle.trim[:2] == pytest.approx(TRUE["trim"][:2], abs=0.5) and not vehicle.trim[2:].any()
    assert vehicle.command_delay == pytest.approx(TRUE["delay"] + TRUE["lag"], abs=0.03)
    page = out.with_suffix(".html").read_text()
    command = re.search(r"cosim identify [^<]*--out mine.toml", page)
    words = shlex.split(command[0].replace("&#39;", "'"))
    assert (
        words[-2:] == ["--out", "mine.toml"]
        and words[2:14] == fitted
        and words[words.index("--nuisance") + 1] == "auto"
    )


@pytest.mark.medium
def test_turns_are_measured_from_attitudes_alone(tmp_path):
    """Repeats, bursts and 8 Hz: rates are found within a few hundredths of a radian per second."""
    states = write_pairs(tmp_path, seed=1, runs=1, seconds=30.0)
    (run,) = imported(tmp_path, 1)
    log = load_log(run, load_vehicle(tmp_path / "vehicle.toml"))
    assert log.topic("velocity").times.size == pytest.approx(30.0 / 0.1125, rel=0.1)  # and not the 1,500 of its rows
    times = np.arange(2.0, 28.0, 0.1)
    turns = measured_turns(log, times)
    true = states[0, (times / 0.01).astype(int), 6:9]
    assert np.sqrt(np.mean(np.square(turns[:, 4:] - true), axis=0)).max() < 0.08
