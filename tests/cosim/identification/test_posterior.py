"""Vehicles drawn from an identification: their spread, and a sweep that flies them."""

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest

import cosim
from cosim.campaigns.sweeps.design import vary_vehicles
from cosim.command_line.cli import main
from cosim.errors import IdentificationError, RunError
from cosim.identification.parameters import DEFAULT_FREE, free_parameters
from cosim.identification.vehicle_file import draw_plants, posterior_lines
from plant_fmu import load_vehicle

VEHICLE = load_vehicle("bluerov2_heavy")


def fit_of(keys, values=None, deviations=0.05):
    """A fit as `identify` has it, with standard deviations in parts of the prior's."""
    parameters = free_parameters(VEHICLE, keys)
    found = np.array([p.start for p in parameters] if values is None else values)
    size = deviations * np.array([p.deviation for p in parameters])
    intervals = SimpleNamespace(covariance=np.diag(size**2))
    return SimpleNamespace(
        parameters=parameters, values=found, intervals=intervals, vehicle_indices=lambda: list(range(len(parameters)))
    )


def test_draws_lie_within_the_intervals_as_often_as_those_say():
    """In 95 of 100: the covariance is that of a normal distribution with these intervals."""
    fit = fit_of(("hydrodynamics.quadratic_damping", "hydrostatics.buoyancy"))
    plants = draw_plants(fit, VEHICLE, 0, 2000)
    values = np.array([[plant[p.plant] for p in fit.parameters] for plant in plants])
    inside = np.abs(values - fit.values) <= 1.96 * np.sqrt(np.diag(fit.intervals.covariance))
    assert np.abs(inside.mean(axis=0) - 0.95).max() < 0.02


def test_correlations_and_seeds_are_kept():
    fit = fit_of(("hydrodynamics.added_mass.1.1", "hydrodynamics.linear_damping.1"))
    fit.intervals.covariance[0, 1] = fit.intervals.covariance[1, 0] = 0.9 * np.sqrt(
        np.prod(np.diag(fit.intervals.covariance))
    )
    draws = np.array([list(plant.values()) for plant in draw_plants(fit, VEHICLE, 3, 500)])
    assert np.corrcoef(draws.T)[0, 1] == pytest.approx(0.9, abs=0.03)
    assert draw_plants(fit, VEHICLE, 3, 5) == draw_plants(fit, VEHICLE, 3, 5) != draw_plants(fit, VEHICLE, 4, 5)


def test_every_draw_is_a_body_of_the_fmu():
    """Bounds and positive definite mass matrices are kept however wide the intervals are."""
    fit = fit_of((*DEFAULT_FREE, "thrusters.matrix"), deviations=0.8)
    for plant in draw_plants(fit, VEHICLE, 0, 20):
        assert min(plant[f"linear_damping[{i}]"] for i in range(1, 7)) >= 0.0 <= plant["thrust_time_constant[8]"]
        cosim.load_scenario("docking", [f"plant.parameters.{name}={value!r}" for name, value in plant.items()])


def test_numbers_without_a_body_are_refused():
    fit = fit_of(("hydrodynamics.added_mass.1.1",), values=[-200.0])
    with pytest.raises(IdentificationError, match="positive definite"):
        draw_plants(fit, VEHICLE, 0, 2)


@pytest.mark.medium
def test_a_sweep_flies_each_vehicle_and_says_which_number_decides(tmp_path, capsys):
    """The law knows the scenario's own vehicle: what differs is the plant."""
    fit = fit_of(("hydrostatics.buoyancy", "thrusters.time_constant"), values=[130.0, 0.1], deviations=0.5)
    path = tmp_path / "mine.posterior.jsonl"
    path.write_text("\n".join(posterior_lines(fit, VEHICLE)))
    drawn = [json.loads(line)["parameters"] for line in path.read_text().splitlines()]
    out = tmp_path / "sweep"
    settings = ["arbiter.engine=closed", "vehicle=bluerov2_heavy", "actuation.through=thrusters", "time.duration=3"]
    command = ["sweep", "docking", *(part for text in settings for part in ("--set", text)), "--out", str(out), "-q"]
    assert main([*command, "--vehicles", str(path), "--samples", "24", "--replays", "0"]) == 0
    table = pq.read_table(out / "results.parquet").to_pydict()
    assert table["plant.parameters.buoyancy"] == [plant["buoyancy"] for plant in drawn[:24]]
    assert not any(table["refused"]) and len(set(table["final_z"])) == 24
    summary = json.loads((out / "summary.json").read_text())
    assert summary["rank_correlations"]["plant.parameters.buoyancy"]["final_z"]["rho"] < -0.8  # lighter goes up
    assert "24" in (out / "sweep.html").read_text()
    capsys.readouterr()
    assert main(["rerun", str(out), "5", "--out", str(tmp_path / "again")]) == 0
    assert "identical to the last bit" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", "is empty"), ('{"draw": 0}\n', "holds no vehicles"), ("{", "holds no vehicles"),
        ('{"parameters": {"mass": 1.0}}\n{"parameters": {"weight": 1.0}}\n', "line 2 has other parameters"),
    ],
)  # fmt: skip
def test_a_file_without_vehicles_is_refused_by_name(tmp_path, text, what):
    path = tmp_path / "mine.posterior.jsonl"
    path.write_text(text)
    with pytest.raises(RunError, match=what):
        vary_vehicles(path)


def test_lists_of_a_pair_have_one_length():
    vary = cosim.vary_from(["limit.force=100,200", "regions.SR1.gain=1,2,3"])
    with pytest.raises(RunError, match="lists of one length"):
        cosim.Design(vary, "paired")
    even = cosim.Design((vary[0], dataclasses.replace(vary[1], values=(1.0, 2.0))), "paired")
    assert even.rows == 2 and even.values(np.array([1])).tolist() == [[200.0, 2.0]]
