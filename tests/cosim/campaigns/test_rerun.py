"""Rerun of a row by its engine and by the reference master."""

import json
import math
import shutil

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cosim.campaigns.campaign import run_campaign
from cosim.campaigns.parameter_sweep import run_sweep
from cosim.campaigns.rerun import rerun
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.conflicts import make_conflict
from cosim.campaigns.store.folder import RESULTS
from cosim.campaigns.sweeps.design import Design, vary_from
from cosim.campaigns.workers.dispatch import KILLED
from cosim.command_line.cli import main
from cosim.errors import RunError
from cosim.scenario.scenario import load_scenario
from tests.cosim.campaigns.scene_data import PLAIN, write

VARY = ["initial.position.1=-2:2", "regions.SR1.gain=500:5000:log", "plant.parameters.weight=1150:1280"]
BRIEFLY = ["arbiter.engine=closed", "time.duration=0.3", "sensing.position_noise=0.02"]


def changed(folder, column, row, value):
    """Change one number of the results."""
    table = pq.read_table(folder / RESULTS)
    values = table[column].to_pylist()
    values[row] = value
    i = table.schema.get_field_index(column)
    pq.write_table(
        table.set_column(i, table.schema.field(i), pa.array(values, table.schema.field(i).type)), folder / RESULTS
    )


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """Return the folder of a sweep by the fused loop."""
    out = tmp_path_factory.mktemp("swept") / "out"
    run_sweep(load_scenario("paper", BRIEFLY), Design(vary_from(VARY), "sobol", 6, 5), out)
    return out


@pytest.fixture
def folder(swept, tmp_path):
    """Return a copy of it."""
    return shutil.copytree(swept, tmp_path / "swept")


@pytest.mark.medium
def test_sweep_row_rerun_is_bit_identical_and_writes_a_run(folder, tmp_path, capsys):
    assert main(["rerun", str(folder), "4", "--out", str(tmp_path / "run")]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "row 4: flown again, identical to the last bit"
    assert said[-2:] == [str(tmp_path / "run" / name) for name in ("report.html", "replay.html")]
    row = pq.read_table(folder / RESULTS).to_pylist()[4]
    scenario = load_scenario(tmp_path / "run" / "scenario.toml")
    assert scenario.initial.position[1] == row["initial.position.1"] and scenario.sensing.seed == row["seed"]
    assert scenario.plant.parameters["weight"] == row["plant.parameters.weight"]
    assert {r.region.name: r for r in scenario.regions}["SR1"].region.gain == row["regions.SR1.gain"]
    record = pq.read_table(tmp_path / "run" / "record.parquet")
    for axis in "xyz":
        assert record[f"position.{axis}"][-1].as_py() == pytest.approx(row[f"final_{axis}"], abs=1e-9)


@pytest.mark.slow
def test_one_bit_difference_is_reported_as_error(folder, tmp_path, capsys):
    before = pq.read_table(folder / RESULTS)["effort"][2].as_py()
    changed(folder, "effort", 2, math.nextafter(before, math.inf))
    assert main(["rerun", str(folder), "2", "--out", str(tmp_path / "run")]) == 1
    said = capsys.readouterr()
    assert f"row 2: effort was {math.nextafter(before, math.inf)!r}, is {before!r} now" in said.err
    assert "identical" not in said.out


@pytest.mark.slow
def test_values_that_differ_from_the_design_are_reported(folder, tmp_path):
    changed(folder, "initial.position.1", 3, 0.25)
    assert list(rerun(folder, 3, tmp_path / "run").differing) == ["initial.position.1"]


@pytest.mark.slow
def test_changed_code_is_reported(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("cosim.campaigns.rerun.code_digest", lambda: "other")
    assert main(["rerun", str(folder), "0", "--out", str(tmp_path / "run")]) == 0
    assert "the code is not that which flew the row" in capsys.readouterr().err


def test_rejected_row_is_rejected_again_without_a_run(tmp_path, capsys):
    design = Design(vary_from(["limit.time_constant=-1,0.1"]), "grid")
    run_sweep(load_scenario("paper", BRIEFLY), design, tmp_path / "out")
    rows = pq.read_table(tmp_path / "out" / RESULTS).to_pylist()
    assert "limit.time_constant is -1" in rows[0]["refused"] and rows[1]["refused"] is None
    assert main(["rerun", str(tmp_path / "out"), "0", "--out", str(tmp_path / "run")]) == 0
    assert "identical to the last bit" in capsys.readouterr().out and not (tmp_path / "run").exists()


@pytest.mark.parametrize("row", ["-1", "6", "99999999999999"])
def test_nonexistent_rows_are_rejected(folder, capsys, row):
    assert main(["rerun", str(folder), row]) == 2
    assert f"has no row {row}, expected one from 0 to 5" in capsys.readouterr().err


def test_row_that_crashes_workers_is_not_rerun(folder):
    changed(folder, "refused", 1, KILLED)
    with pytest.raises(RunError, match="row 1 is not flown again"):
        rerun(folder, 1)


def test_folders_without_a_complete_campaign_are_rejected(folder, tmp_path):
    with pytest.raises(RunError, match=r"holds no campaign \(campaign\.json is missing\)"):
        rerun(tmp_path, 0)
    plan = json.loads((folder / "campaign.json").read_text())
    for change, words in (
        ({"kind": "other"}, "of another version"),
        ({"vary": None}, r"campaign\.json: cannot be understood"),
        ({"seed": "none"}, "the design of the campaign cannot be read"),
    ):
        (folder / "campaign.json").write_text(json.dumps(plan | change))
        with pytest.raises(RunError, match=words):
            rerun(folder, 0)
    (folder / "campaign.json").write_text(json.dumps(plan))
    (folder / RESULTS).unlink()
    with pytest.raises(RunError, match="is not complete"):
        rerun(folder, 0)


def test_changed_scenario_is_rejected(folder):
    file = folder / "scenario.toml"
    text = file.read_text()
    assert text.count("duration = 0.3") == 1
    file.write_text(text.replace("duration = 0.3", "duration = 0.4"))
    with pytest.raises(
        RunError, match=r"scenario\.toml: is not that of the campaign .*time\.duration is 0\.3, now 0\.4"
    ):
        rerun(folder, 0)


@pytest.mark.slow
def test_scene_rerun_is_bit_identical(tmp_path, capsys):
    out = tmp_path / "out"
    inside = PLAIN[1] | {"goal": {"centre": PLAIN[1]["start"], "radius": 40.0}}
    scenes = [PLAIN[0], inside, PLAIN[2] | {"weight_minus_buoyancy": 1e6}]
    run_campaign(write(tmp_path / "s.jsonl", scenes), "ismail_dunnigan", out, Conditions(duration=3.0, settled=1.0))
    for seed in (20000, 20001, 20002):
        assert main(["rerun", str(out), str(seed), "--out", str(tmp_path / str(seed))]) == 0
        said = capsys.readouterr()
        assert said.out.startswith(f"row {seed}: flown again, identical to the last bit\n") and said.err == ""
    files = {p.name for p in (tmp_path / "20001").iterdir()}
    assert {"record.parquet", "report.html", "replay.html", "scenario.toml"} <= files
    changed(out, "effort", 1, 1.0)
    assert list(rerun(out, 20001, tmp_path / "again").differing) == ["effort"]
    with pytest.raises(RunError, match="has no row 7, expected one from 20000 to 20002"):
        rerun(out, 7)


@pytest.mark.slow
def test_rerun_ignores_violations_of_soft_regions(tmp_path, capsys):
    scene = next(made for made in map(make_conflict, range(100)) if made["kind"].startswith("squeeze"))
    scene["scenario"]["time"]["duration"] = 1.0
    assert not any(region["hard"] for region in scene["scenario"]["regions"])
    out = tmp_path / "out"
    run_campaign(write(tmp_path / "s.jsonl", [scene]), "deployable", out)
    (row,) = pq.read_table(out / RESULTS).to_pylist()
    assert row["weighted_violation"] > 0.0 and not row["violation"] and row["min_clearance"] is None
    assert main(["rerun", str(out), str(scene["seed"]), "--out", str(tmp_path / "run")]) == 0
    assert "step by step" not in capsys.readouterr().err
