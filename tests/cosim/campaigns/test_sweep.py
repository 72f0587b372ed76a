"""Sweeps with engines of known outcomes: one row per design point for any executor and interruption."""

import json
import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from importlib import resources
from multiprocessing import current_process, get_context
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.stats import norm

from cosim.batch.outcome import FIELDS
from cosim.campaigns.parameter_sweep import run_sweep
from cosim.campaigns.scenes.scene_rows import SCHEMA
from cosim.campaigns.store.folder import RESULTS
from cosim.campaigns.store.results import make_table, to_array
from cosim.campaigns.sweeps.design import Design, design_of, vary_from
from cosim.campaigns.sweeps.sweep_rows import schema_of
from cosim.command_line.cli import main
from cosim.errors import RunError, ScenarioError
from cosim.scenario.scenario import load_scenario
from tests.cosim.campaigns.fake import KEYS, VARY, Choosy, Fake, Unfit, design, expected, fakes, paper
from tests.cosim.campaigns.scene_data import batches_of

ROOT = Path(__file__).parents[3]
WORDS = ["sweep", "paper", "--vary", *VARY, "--samples", "50", "--seed", "3", "--replays", "0"]

__all__ = ["fakes"]


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """Return a sweep of fifty rows by the fake."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("cosim.campaigns.sweeps.sweep_rows.FusedFlyer", Fake)
        return run_sweep(
            load_scenario("paper", ["limit.force=900"]), design(), tmp_path_factory.mktemp("swept") / "out"
        )


def rows_of(done):
    return done.results.table.to_pylist()


def test_one_row_per_design_point_in_order(swept):
    assert swept.flown == 50 and rows_of(swept) == expected()
    assert sorted(p.name for p in swept.folder.iterdir()) == [
        ".lock", "campaign.json", "results.parquet", "scenario.toml", "summary.json"
    ]  # fmt: skip
    schema = pq.read_schema(swept.folder / RESULTS)
    assert schema.equals(schema_of(KEYS))
    units = {f.name: f.metadata[b"unit"].decode() for f in schema}
    assert units["reach_time"] == "s" and units["effort"] == "N.s" and all(f.metadata[b"description"] for f in schema)


@pytest.mark.slow
def test_extreme_numbers_are_blamed_on_the_results(tmp_path, fakes, capsys, monkeypatch):
    """Their statistics overflow: the file that holds them is named, whichever column it is, and not the summary."""
    words = [*WORDS, "--out", str(tmp_path / "out")]
    assert main(words) == 0
    file = tmp_path / "out" / RESULTS
    table = pq.read_table(file)
    numbers = [field for field in table.schema if str(field.type) == "double" and field.name != "stopped_at"]
    for i, field in enumerate(numbers):
        column = table[field.name].to_pylist()
        column[7:9] = [-1e308, 1e308] if i % 2 else [1e308, 1e101]
        spoiled = pa.array(column, field.type)
        pq.write_table(table.set_column(table.schema.get_field_index(field.name), field, spoiled), file)
        capsys.readouterr()
        assert main(words) == 2
        said = f"column {field.name!r} holds {column[7]:g} in row 7, expected at most 1e+100 in size"
        assert capsys.readouterr().err == f"cosim: {file}: {said}\n"
    assert len(numbers) > 10


def test_folder_records_the_complete_sweep(swept):
    plan = json.loads((swept.folder / "campaign.json").read_text())
    assert plan["kind"] == "sweep" and plan["scenario"]["limit"]["force"] == 900.0
    again = design_of(plan)
    assert np.array_equal(again.values(np.arange(50)), design().values(np.arange(50)))
    assert load_scenario(swept.folder / "scenario.toml").limit.force == 900.0


@pytest.mark.medium
def test_vehicle_file_is_identified_by_content_not_location(tmp_path, fakes):
    for place in ("one", "two"):
        (tmp_path / place).mkdir()
        text = (resources.files("plant_fmu") / "vehicles" / "odin.toml").read_text()
        (tmp_path / place / "mine.toml").write_text(text)
        (tmp_path / place / "s.toml").write_text('base = "paper"\nvehicle = "mine.toml"\n')
    run_sweep(load_scenario(tmp_path / "one" / "s.toml"), design(), tmp_path / "out")
    assert (tmp_path / "out" / "vehicle.toml").read_text() == text
    assert run_sweep(load_scenario(tmp_path / "two" / "s.toml"), design(), tmp_path / "out").flown == 0
    (tmp_path / "two" / "mine.toml").write_text(text + "\n# another\n")
    with pytest.raises(RunError, match="vehicle_sha256"):
        run_sweep(load_scenario(tmp_path / "two" / "s.toml"), design(), tmp_path / "out")


@pytest.mark.slow
def test_processes_and_executors_give_the_same_rows(tmp_path, fakes):
    run_sweep(paper(), design(), tmp_path / "two", workers=2)
    with ThreadPoolExecutor(3) as threads:
        run_sweep(paper(), design(), tmp_path / "threads", workers=3, executor=threads)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        run_sweep(paper(), design(), tmp_path / "pool", workers=2, executor=pool)
        assert pool.submit(int, "1").result() == 1  # it is not closed
    for name in ("two", "threads", "pool"):
        assert pq.read_table(tmp_path / name / RESULTS).to_pylist() == expected(), name


@pytest.mark.medium
def test_engine_calls_of_threads_are_serialized(tmp_path, fakes, monkeypatch):
    inside, fly = [], Fake.fly

    def watched(self, values, seeds):
        inside.append(1)
        assert len(inside) == 1
        try:
            return fly(self, values, seeds)
        finally:
            inside.pop()

    monkeypatch.setattr(Fake, "fly", watched)
    batches_of(monkeypatch, 1)
    with ThreadPoolExecutor(4) as threads:
        assert run_sweep(paper(), design(), tmp_path / "out", workers=4, executor=threads).flown == 50


def test_closed_executor_gives_one_line_error(tmp_path, fakes):
    with ThreadPoolExecutor(1) as threads:
        pass
    with pytest.raises(RunError, match=r"the executor takes no more work .* what is flown is kept"):
        run_sweep(paper(), design(), tmp_path / "out", executor=threads)
    assert run_sweep(paper(), design(), tmp_path / "out").flown == 50


def test_rejected_row_is_kept_with_its_reason(tmp_path, fakes, caplog):
    fakes(Choosy)
    done = run_sweep(paper(), design(), tmp_path / "out")
    rows = rows_of(done)
    refused = [row for row in rows if row["refused"]]
    assert 3 < len(refused) == done.summary["refused"] and len(rows) == 50
    for row, other in zip(rows, expected(), strict=True):
        if row["refused"]:
            assert row[KEYS[0]] > 1.5 and f"is {row[KEYS[0]]}, expected less" in row["refused"]
            assert row["seed"] == other["seed"] and all(row[name] is None for name in FIELDS)
        else:
            assert row == other
    assert len([r for r in caplog.records if ": refused: " in r.message]) == 3
    assert f"{len(refused)} rows were refused" in caplog.text
    assert done.summary["reached"]["rows"] == sum(row["reached"] is True for row in rows)
    none = run_sweep(paper(), design(3, vary=["initial.position.1=1.6:2"]), tmp_path / "none").summary
    assert none["reached"] == {"rows": 0, "share": None, "low": None, "high": None} and none["refused"] == 3
    assert none["worst"] == [] and none["quantiles"]["effort"]["0.5"] is None
    assert list(none["reasons"]) == ["0", "1", "2"] and all("expected less" in why for why in none["reasons"].values())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "lhs"}, "design is 'random', now 'lhs'"),
        ({"vary": (*VARY[:2], "law.gains.k_p1=10:31")}, r"vary.law.gains.k_p1.high is 30.0, now 31.0"),
        ({"overrides": ["limit.force=901"]}, r"scenario.limit.force is 900.0, now 901"),
    ],
)
def test_folder_of_another_sweep_is_rejected(swept, fakes, change, words):
    overrides = change.pop("overrides", ["limit.force=900"])
    with pytest.raises(RunError, match=f"holds another campaign .*{words}"):
        run_sweep(load_scenario("paper", overrides), design(**change), swept.folder)


def test_script_without_main_guard_is_rejected(tmp_path, fakes, monkeypatch):
    monkeypatch.setattr(current_process(), "_inheriting", True, raising=False)  # as while a spawned process starts
    with pytest.raises(RunError, match="__main__"):
        run_sweep(paper(), design(), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_unsupported_engine_leaves_no_folder(tmp_path, fakes):
    with pytest.raises(ScenarioError, match=r"law\.gains\.k_p9"):
        run_sweep(paper(), design(vary=["law.gains.k_p9=1:2"]), tmp_path / "out")
    fakes(Unfit)
    with pytest.raises(RunError, match="cannot fly this"):
        run_sweep(paper(), design(), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("key", ["row", "seed", "reached", "refused"])
def test_no_key_of_a_sweep_has_the_name_of_another_column(key):
    with pytest.raises(ValueError, match=f"'{key}' varies"):
        schema_of(("limit.force", key))


# ---- the summary ----


def test_the_summary_follows_from_the_rows(tmp_path, fakes):
    done = run_sweep(paper(), design(200), tmp_path / "out")
    s, rows = done.summary, rows_of(done)
    assert json.loads((tmp_path / "out" / "summary.json").read_text()) == s
    reached = sum(row["reached"] for row in rows)
    z = norm.ppf(0.975)
    share = reached / 200  # whoever is as likely as this or less by the score test is outside
    low, high = np.sort(np.roots([1 + z**2 / 200, -2 * share - z**2 / 200, share**2]))
    assert s["reached"] == {"rows": reached, "share": share, "low": pytest.approx(low), "high": pytest.approx(high)}
    times = [row["reach_time"] for row in rows if row["reach_time"] is not None]
    assert s["quantiles"]["reach_time"]["0.5"] == pytest.approx(np.median(times))
    finite = [row["min_clearance"] for row in rows if np.isfinite(row["min_clearance"])]
    assert s["quantiles"]["min_clearance"]["0.05"] == pytest.approx(np.quantile(finite, 0.05))
    correlations = s["rank_correlations"]
    assert correlations[KEYS[0]]["reach_time"]["rho"] == pytest.approx(1.0)  # it is three times the value
    assert correlations[KEYS[0]]["stopped_at"] is None
    assert abs(correlations[KEYS[2]]["reach_time"]["rho"]) < 0.3
    assert "nan" not in str([field.metadata for field in done.results.schema])  # the file has null there
    ranks = [np.argsort(np.argsort([row[k] for row in rows])) for k in (KEYS[1], "effort")]
    assert correlations[KEYS[1]]["effort"]["rho"] == pytest.approx(np.corrcoef(*ranks)[0, 1])


def test_worst_rows_carry_their_rerun_command(tmp_path, fakes):
    worst = run_sweep(paper(), design(), tmp_path / "out dir").summary["worst"]
    missed = [row for row in expected() if not row["reached"]]  # the fake violates only what it reaches
    assert len(worst) == 10 and not any(row["violated"] for row in missed)
    violated = sorted((r for r in expected() if r["violated"]), key=lambda r: min(r["min_clearance"], 0.0))
    assert [w["row"] for w in worst] == [row["row"] for row in violated[:10]]
    assert worst[0]["command"] == f"cosim rerun '{tmp_path / 'out dir'}' {worst[0]['row']}"
    one = run_sweep(paper(), design(1), tmp_path / "one").summary
    assert one["rank_correlations"][KEYS[0]]["effort"] is None and one["rows"] == 1 and not one["reasons"]


def test_the_best_row_settles_first_without_a_violation_where_the_laws_keys_vary_alone(tmp_path, fakes):
    assert run_sweep(paper(), design(), tmp_path / "start").summary["best"] is None

    class Sound(Fake):
        def fly(self, values, seeds):
            result = super().fly(values, seeds)
            result.outcomes["violated"] = seeds % 3 == 0
            return result

    fakes(Sound)
    vary = vary_from(["law.gains.k_p1=10:30", "law.gains.k_q=5:20"])
    done = run_sweep(paper(), Design(vary, "random", 40, 3), tmp_path / "gains")
    rows = [row for row in rows_of(done) if row["settled"] and not row["violated"]]
    first, best = min(rows, key=lambda row: row["settle_time"]), done.summary["best"]
    assert (best["row"], best["settle_time"]) == (first["row"], first["settle_time"])
    assert best["changes"] == " ".join(f"--set {of.key}={first[of.key]:.4g}" for of in vary)


# ---- the command ----


@pytest.mark.slow
def test_command_prints_the_sweep_result(tmp_path, fakes, capsys):
    out = tmp_path / "out"
    words = WORDS
    assert main([*words, "--out", str(out)]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "paper: 50 of 50 rows flown, 0 refused, 0 stopped early"
    assert said[1].startswith("reached") and said[-1] == str(out / "sweep.html")
    assert main([*words, "--out", str(out)]) == 0
    assert "was complete already" in capsys.readouterr().out
    assert main([*words, "--out", str(out), "--set", "limit.force=800"]) == 2
    assert "scenario.limit.force is" in capsys.readouterr().err


# ---- tables ----

_WITHOUT_PANDAS = """
import sys
from pathlib import Path
from cosim.campaigns.parameter_sweep import run_sweep
from cosim.campaigns.scenes.scene_rows import refused_row, table_of
from cosim.campaigns.sweeps import sweep_rows
from tests.cosim.campaigns.fake import Fake, design, paper
sweep_rows.FusedFlyer = Fake
done = run_sweep(paper(), design(), Path(sys.argv[1]))
sys.exit(f"{done.flown} {len(table_of([refused_row(1, 'why', 'scene')]))} {'pandas' in sys.modules}")
"""


@pytest.mark.medium
def test_sweep_and_scenes_do_without_pandas(tmp_path):
    words = [sys.executable, "-c", _WITHOUT_PANDAS, str(tmp_path / "out")]
    done = subprocess.run(words, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True)
    assert done.stderr == "50 1 False\n"


@pytest.mark.parametrize("n", [0, 1, 8, 37])
def test_tables_equal_those_of_pyarrow(n):
    rng = np.random.default_rng(n)
    some = {"int64": [3, -(2**62)], "double": [0.0, -0.0, np.inf, 1e300], "bool": [True, False], "string": ["", "ä\n"]}
    columns = [
        [None if field.nullable and rng.random() < 0.3 else rng.choice(some[str(field.type)]).item() for _ in range(n)]
        for field in SCHEMA
    ]
    table = make_table(SCHEMA, columns)
    table.validate(full=True)
    arrays = [pa.array(column, field.type) for column, field in zip(columns, SCHEMA, strict=True)]
    assert table.equals(pa.Table.from_arrays(arrays, schema=SCHEMA))
    for column in (*table.slice(n // 3).itercolumns(), pa.chunked_array([], pa.float64())):
        np.testing.assert_array_equal(to_array(column), column.to_numpy())


# ---- memory ----

_MEMORY = """
import sys
from pathlib import Path
from cosim.campaigns.parameter_sweep import run_sweep
from cosim.campaigns.store import row_log
from cosim.campaigns.sweeps import sweep_rows
from cosim.campaigns.workers import dispatch
from tests.cosim.campaigns.fake import Fake, design, paper
sweep_rows.FusedFlyer = Fake
dispatch.FIRST = dispatch.MAX_ROWS = 48

def resident():
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20

marks = {}
add = row_log.RowLog.add
def watched(self, table):
    add(self, table)
    watched.rows += len(table)
    marks[watched.rows // 10_000] = resident()
watched.rows = 0
row_log.RowLog.add = watched
done = run_sweep(paper(), design(40_000), Path(sys.argv[1]))
print(len(done.results), marks[1], marks[3], resident())
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_forty_thousand_rows_need_no_more_memory_than_ten_thousand(tmp_path):
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    words = [sys.executable, "-c", _MEMORY, str(tmp_path / "out")]
    done = subprocess.run(words, env=environment, cwd=ROOT, capture_output=True, text=True, check=True)
    rows, early, late, end = map(float, done.stdout.split())
    assert rows == 40_000
    assert late - early < 10.0 and end - early < 120.0  # MiB; the summary reads columns
