"""Run folders: complete and readable, even after an interruption."""

import json
import shutil
from importlib import resources

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cosim.errors import RunError
from cosim.results.record import load_record
from cosim.results.recorder import Recorder
from cosim.results.spans import spans
from cosim.results.wording import verdict
from cosim.run.run_folder import claim, report_again
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from plant_fmu import PlantError

SHORT = ["arbiter.engine=closed", "time.duration=0.3"]
REQUIRED = {
    "law", "reached", "reach_time", "settled", "settle_time", "final_position", "intersection_windows", "min_clearance",
    "max_force", "max_speed", "effort", "estimate_final", "steps", "wall_time", "real_time_factor",
}  # fmt: skip


def test_folder_holds_documented_files(shipped_run):
    folder = shipped_run("paper", *SHORT, report=True).folder
    names = sorted(p.name for p in folder.iterdir())
    assert names == ["figures", "record.parquet", "replay.html", "report.html", "scenario.toml", "summary.json"]
    assert json.loads((folder / "summary.json").read_text()).keys() >= REQUIRED


def test_record_has_every_signal_with_its_unit(shipped_run):
    folder = shipped_run("paper", *SHORT, report=True).folder
    schema = pq.read_schema(folder / "record.parquet")
    units = {f.name: f.metadata[b"unit"].decode() for f in schema}
    assert all(f.metadata[b"description"] for f in schema)
    expected = {
        "time": "s", "position.z": "m", "quaternion.e0": "", "velocity.u": "m/s", "velocity.r": "rad/s",
        "attitude.yaw": "rad", "thrust[8]": "N", "wrench.K": "N.m", "thruster_force[1]": "N", "actuation.X": "N",
        "thrust_saturated[1]": "", "wrench_saturated": "", "goal.value": "m2", "goal.clearance": "m", "SR1.value": "m2",
        "SR3.clearance": "m", "membership.shape": "", "weight.depth": "", "estimate.phi1": "N", "estimate.phi4": "N.m",
        "command.Z": "N", "command.N": "N.m",
    }  # fmt: skip
    assert units.items() >= expected.items()
    assert load_record(folder).units == units
    assert len(units) == len(set(units))


def test_summary_follows_from_the_record(shipped_run):
    run = shipped_run("paper-limited", "arbiter.engine=closed", "time.duration=5")  # past both spheres
    record, summary = load_record(run.folder), run.summary
    force = np.sqrt(sum(record[f"actuation.{a}"] ** 2 for a in "XYZ"))[:-1]
    assert summary["effort"] == pytest.approx(np.sum(force) * 0.001, rel=1e-12)
    assert summary["final_position"] == [record[f"position.{a}"][-1] for a in "xyz"]
    distance = np.sqrt(
        (record["position.x"] - 2.0) ** 2 + record["position.y"] ** 2 + (record["position.z"] - 1.8) ** 2
    )
    assert summary["min_clearance"]["SR1"] == pytest.approx(distance.min() - 0.5, abs=1e-12)
    assert summary["saturated_time"] == pytest.approx(np.count_nonzero(force > 107.999) * 0.001, abs=0.01)


def test_time_above_the_water_surface_is_said(shipped_run):
    """It starts in the air, and dives."""
    changes = ("arbiter.engine=closed", "time.duration=2", "initial.position=[0,0,-1.5]")
    run = shipped_run("paper", *changes)
    dry = np.count_nonzero(run.record["position.z"] < -0.315) * 0.001  # the hull's radius
    assert 0.0 < dry < 2.0 and run.summary["time_above_surface"] == pytest.approx(dry)
    share = f"the vehicle for {100.0 * dry / 2.0:.0f} % of the time."
    assert "Above the water surface (z < 0; z points down)" in verdict(run.summary)
    assert f"does not hold: the start, {share}" in verdict(run.summary)
    below = shipped_run("paper", *SHORT).summary
    assert below["time_above_surface"] == 0.0 and "water surface" not in verdict(below)


@pytest.mark.slow
def test_settled_means_inside_for_the_last_ten_seconds(shipped_run):
    early = shipped_run("paper", "arbiter.engine=closed", "time.duration=20").summary
    assert early["reached"] and early["settle_time"] == pytest.approx(13.87, abs=0.1) and not early["settled"]


def test_spans_of_a_boolean_signal_are_found():
    time = np.arange(6) * 0.5
    assert spans(np.array([0, 1, 1, 0, 0, 1], bool), time) == [(0.5, 1.5), (2.5, 2.5)]
    assert spans(np.array([1, 1, 1, 1, 1, 1], bool), time) == [(0.0, 2.5)]
    assert spans(np.zeros(6, bool), time) == []


@pytest.mark.slow
def test_plant_error_keeps_recorded_rows(tmp_path):
    out = tmp_path / "run"
    scenario = load_scenario("paper", [*SHORT, "law.gains.k_v1=5e5"])  # which no 1 kHz loop can hold: k_v1 h > 2 m
    with pytest.raises(PlantError):
        run_scenario(scenario, out)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["status"].startswith("failed: t = ")
    assert 0 < summary["steps"] < 30
    assert np.isfinite(load_record(out)["position.x"]).all()
    assert (out / "report.html").exists()


@pytest.mark.slow
def test_a_killed_run_can_be_reported(tmp_path):
    whole = run_scenario(load_scenario("paper", SHORT), tmp_path / "run", report=False)
    killed = tmp_path / "killed"
    killed.mkdir()
    shutil.copy(whole.folder / "scenario.toml", killed)
    table = pq.read_table(whole.folder / "record.parquet")
    with pa.ipc.new_stream(killed / "record.arrows", table.schema) as stream:
        stream.write_table(table)
    summary, _ = report_again(killed)
    assert summary["status"] == "killed"
    assert summary["real_time_factor"] is None
    assert summary["min_clearance"] == whole.summary["min_clearance"]
    assert "was killed" in (killed / "report.html").read_text()
    assert report_again(whole.folder)[0] == whole.summary  # of a whole run it says the same again
    assert not list(killed.glob(".*"))


def test_runs_that_start_together_get_folders_of_their_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scenario = load_scenario("paper", SHORT)
    paths = [claim(None, scenario).path for _ in range(5)]
    assert len(set(paths)) == 5


def test_region_names_do_not_affect_saturation(tmp_path):
    scenario = load_scenario("paper", [*SHORT, "regions.SR3.name=not_saturated"])
    assert run_scenario(scenario, tmp_path / "run", report=False).summary["saturated_time"] == 0.0


def test_missing_or_damaged_record_is_rejected(tmp_path):
    with pytest.raises(RunError, match="no record"):
        load_record(tmp_path)
    (tmp_path / "record.parquet").write_bytes(b"PAR1 and then nothing")
    with pytest.raises(RunError, match="cannot be read"):
        load_record(tmp_path)


@pytest.mark.slow
def test_custom_vehicle_file_is_copied_into_the_run(tmp_path):
    text = (
        (resources.files("plant_fmu") / "vehicles" / "odin.toml").read_text().replace("mass = 125.0 ", "mass = 126.0 ")
    )
    (tmp_path / "boat.toml").write_text(text)
    (tmp_path / "mine.toml").write_text('base = "paper"\nvehicle = "boat.toml"\n')
    run = run_scenario(load_scenario(tmp_path / "mine.toml", SHORT), tmp_path / "run", report=False)
    assert not (run.folder / "report.html").exists()
    (tmp_path / "boat.toml").unlink()
    assert load_scenario(run.folder / "scenario.toml").vehicle.mass == 126.0


@pytest.mark.parametrize("override", ["plant.parameters.mass=-5", "law.gains.k_p1=1e9"])  # before the first step, in it
@pytest.mark.parametrize("exists", [False, True])
def test_scenario_rejected_by_the_fmu_leaves_no_folder_but_the_users(tmp_path, override, exists):
    out = tmp_path / "run"
    if exists:
        out.mkdir()
    with pytest.raises(PlantError):
        run_scenario(load_scenario("paper", [*SHORT, override]), out)
    assert out.exists() is exists and not list(tmp_path.rglob("*/*"))


@pytest.mark.slow
@pytest.mark.parametrize("last", [0, 150])
@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
def test_run_that_is_cut_off_keeps_its_rows(tmp_path, monkeypatch, last, error):
    class Interrupting(Recorder):
        def observe_block(self, first, rows):
            if last:
                super().observe_block(first, rows[: last + 1 - first])
            if first + len(rows) > last:
                raise error

    monkeypatch.setattr("cosim.run.run_scenario.Recorder", Interrupting)
    out, scenario = tmp_path / "run", load_scenario("paper", SHORT)
    if last == 0 or error is ZeroDivisionError:
        with pytest.raises(error):
            run_scenario(scenario, out)
    else:
        run = run_scenario(scenario, out)
        assert (run.summary["status"], run.summary["steps"]) == ("interrupted", 150)
        assert "was interrupted at 0.150 s" in (out / "report.html").read_text()
    assert out.exists() == bool(last)
    if last:
        assert len(load_record(out)["time"]) == 151


def test_gains_of_another_vehicle_are_named(tmp_path, caplog):
    odin = load_scenario("paper-deployable", [*SHORT, "law.name=pd", "law.gains={}"])
    run_scenario(odin, tmp_path / "odin", report=False)
    assert not caplog.messages
    run_scenario(odin.replace({"vehicle": "bluerov2_heavy"}), tmp_path / "bluerov2", report=False)
    assert any("pd were found for odin, not for bluerov2_heavy" in message for message in caplog.messages)
