"""Campaigns: one row per scene, none lost and none repeated after interruptions."""

import json
import math
import os

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from msgspec.structs import replace

from controller.paper_law import Gains
from cosim.campaigns.analysis.campaign_summary import summarize_campaign
from cosim.campaigns.campaign import run_campaign
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import SceneFlyer, Score
from cosim.campaigns.scenes.law_gains import gains_by_law, gains_from
from cosim.campaigns.scenes.scene_file import SceneStore, decode_scene
from cosim.campaigns.scenes.scene_rows import SCHEMA, row_of
from cosim.campaigns.scenes.scene_work import SceneTask
from cosim.campaigns.store.folder import PARTS, RESULTS, SUMMARY, CampaignFolder, lock_folder
from cosim.campaigns.store.plan import difference
from cosim.campaigns.store.results import Results
from cosim.errors import RunError, ScenarioError
from tests.cosim.campaigns.scene_data import (
    BRIEF,
    HARD,
    PLAIN,
    batches_of,
    interrupt_after,
    many,
    results_of,
    rows,
    write,
)


@pytest.fixture
def scenes(tmp_path):
    return write(tmp_path / "scenes.jsonl", many(20))


def test_one_row_per_scene_ordered_by_seed(tmp_path, scenes, caplog):
    done = run_campaign(scenes, "ismail_dunnigan", tmp_path / "out", BRIEF)
    assert "is now" not in caplog.text  # what scenes spell as ever warns of no old key
    assert done.flown == 20 and done.summary["medians"]["reach_time"] is None
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        ".lock", "campaign.json", "results.parquet", "summary.json"
    ]  # fmt: skip
    table = pq.read_table(tmp_path / "out" / RESULTS)
    assert table["seed"].to_pylist() == list(range(1000, 1020))
    units = {f.name: f.metadata[b"unit"].decode() for f in table.schema}
    assert units == {
        "seed": "", "reached": "", "violation": "", "min_clearance": "m", "bound_excess": "m",
        "bound_promised": "", "healthy_weakened": "", "weighted_violation": "m.s", "reach_time": "s",
        "effort": "N.s", "thrust_variation": "N", "worst_step_time": "s", "stopped_at": "s", "refused": "", "scene": "",
        "arrivals": "s",
    }  # fmt: skip
    assert all(f.metadata[b"description"] for f in table.schema)


def test_rows_equal_the_flyer_scores(tmp_path):
    wide = [scene | {"goal": {"centre": scene["start"], "radius": 40.0}} for scene in HARD]  # they start inside
    conditions = replace(BRIEF, settled=0.3)
    found = run_campaign(write(tmp_path / "s.jsonl", wide), "ismail_dunnigan", tmp_path / "out", conditions).results
    with SceneFlyer("ismail_dunnigan", conditions) as flyer:
        for i, scene in enumerate(wide):
            score, _ = flyer.fly(decode_scene(json.dumps(scene).encode()))
            row = found.table.to_pylist()[i]
            assert row["reached"] and row["reach_time"] == score.reach_time == 0.0
            assert (row["min_clearance"], row["effort"]) == (score.min_clearance, score.effort)
            assert row["thrust_variation"] == score.thrust_variation and row["stopped_at"] is None
            assert row["violation"] == (score.min_clearance < 0.0)


@pytest.mark.medium
def test_resumed_campaign_neither_loses_nor_repeats_rows(tmp_path, scenes, monkeypatch):
    whole = run_campaign(scenes, "ismail_dunnigan", tmp_path / "whole", BRIEF)
    batches_of(monkeypatch, 3)
    full = OSError(28, os.strerror(28))
    for tables, error, raised in (2, KeyboardInterrupt, KeyboardInterrupt), (3, full, RunError):
        with monkeypatch.context() as patch:
            interrupt_after(patch, tables, error)
            with pytest.raises(raised, match="what is flown is kept" if error is full else None):
                run_campaign(scenes, "ismail_dunnigan", tmp_path / "out", BRIEF)
        assert not (tmp_path / "out" / RESULTS).exists()
    last = max((tmp_path / "out" / PARTS).iterdir())
    last.write_bytes(last.read_bytes()[:-20])  # as a kill in the middle of its last table leaves it
    done = run_campaign(scenes, "ismail_dunnigan", tmp_path / "out", BRIEF)
    assert done.flown == 20 - 4 * 3 and rows(done.results) == rows(whole.results)
    assert not (tmp_path / "out" / PARTS).exists()


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("step", ["join", "conclude"])
def test_campaign_killed_while_finishing_repeats_no_run(tmp_path, scenes, monkeypatch, step):
    with monkeypatch.context() as patch:
        patch.setattr(CampaignFolder, step, lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            run_campaign(scenes, "ismail_dunnigan", tmp_path / "out", BRIEF)
    done = run_campaign(scenes, "ismail_dunnigan", tmp_path / "out", BRIEF)
    assert done.flown == 0 and done.summary["scenes"] == 20
    assert (tmp_path / "out" / SUMMARY).exists() and not (tmp_path / "out" / PARTS).exists()


@pytest.fixture(scope="module")
def brief(tmp_path_factory):
    """Return a file of twenty scenes, and the folder of their campaign."""
    folder = tmp_path_factory.mktemp("brief")
    scenes = write(folder / "scenes.jsonl", many(20))
    return scenes, run_campaign(scenes, "ismail_dunnigan", folder / "out", BRIEF).folder


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"law": "deployable"}, r"\(law is 'ismail_dunnigan', now 'deployable'\)"),
        ({"gains": Gains(k_p1=10.0)}, r"gains.k_p1 is 18.8, now 10.0"),
        ({"conditions": replace(BRIEF, report_failures=True)}, "conditions.report_failures is False, now True"),
        ({"scenes": many(19)}, "scenes is 20, now 19"),
        ({"scenes": [*many(19), PLAIN[0]]}, "scenes_sha256"),
        ({"code": True}, "code_sha256"),
    ],
)
def test_the_folder_of_another_campaign_is_refused(tmp_path, brief, monkeypatch, change, words):
    scenes, out = brief
    before = {p: p.read_bytes() for p in out.iterdir()}
    if "scenes" in change:
        scenes = write(tmp_path / "s.jsonl", change.pop("scenes"))
    if change.pop("code", False):
        monkeypatch.setattr("cosim.campaigns.scenes.scene_work.code_digest", lambda: "other")
    with pytest.raises(RunError, match=f"holds another campaign .*{words}"):
        run_campaign(scenes, **{"law": "ismail_dunnigan", "out": out, "conditions": BRIEF} | change)
    assert {p: p.read_bytes() for p in out.iterdir() if p.name != PARTS} == before


def test_foreign_folder_is_rejected(tmp_path, scenes):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "precious").write_text("x")
    with pytest.raises(RunError, match="holds no campaign"):
        run_campaign(scenes, "ismail_dunnigan", tmp_path / "out", BRIEF)
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["precious"]


def test_a_folder_in_use_is_refused(tmp_path, scenes):
    (tmp_path / "out").mkdir()
    with lock_folder(tmp_path / "out"), pytest.raises(RunError, match="another process is at work"):
        run_campaign(scenes, "ismail_dunnigan", tmp_path / "out", BRIEF)
    assert run_campaign(scenes, "ismail_dunnigan", tmp_path / "out", BRIEF).flown == 20


def test_scene_rejected_by_the_plant_has_a_marked_row(tmp_path):
    bad = [PLAIN[0], PLAIN[1] | {"weight_minus_buoyancy": 1e6}, PLAIN[2] | {"righting_moment": 1e300}, PLAIN[3]]
    done = run_campaign(write(tmp_path / "s.jsonl", bad), "ismail_dunnigan", tmp_path / "out", BRIEF)
    first, *refused, last = done.results.table.to_pylist()
    assert first["stopped_at"] is None and last["stopped_at"] is None and last["effort"] > 0.0
    for row in refused:
        assert not row["reached"] and row["violation"] and row["stopped_at"] == 0.0 and row["effort"] is None
    assert "weight_minus_buoyancy is 1000000.0" in refused[0]["refused"] and first["refused"] is None
    assert decode_scene(last["scene"].encode()) == decode_scene(json.dumps(PLAIN[3]).encode())
    assert done.summary["failed"]["stopped"] == done.summary["failed"]["violated"] == [20001, 20002]
    assert done.summary["violations"] == done.summary["stopped"] == 2


@pytest.mark.parametrize(
    ("score", "violation", "stopped_at", "reach_time"),
    [
        (Score(True, 5.0, 0.0, 1.0, 1.0, 1e-6, -1), False, None, 5.0),
        (Score(True, 5.0, -1e-9, 1.0, 1.0, 1e-6, -1), True, None, 5.0),
        (Score(False, 115.0, 0.1, 1.0, 1.0, 1e-6, -1), False, None, None),
        (Score(False, math.inf, math.nan, math.nan, math.inf, 1e-6, -1), True, None, None),
        (Score(False, math.inf, 0.5, 1.0, 1.0, 1e-6, 150), True, 1.5, None),
    ],
)
def test_unproven_safety_counts_as_violation(score, violation, stopped_at, reach_time):
    row = row_of(7, score, 0.01)
    assert (row["violation"], row["stopped_at"], row["reach_time"]) == (violation, stopped_at, reach_time)
    assert all(math.isfinite(x) for x in row.values() if isinstance(x, float))


def test_the_summary_follows_from_the_rows(tmp_path):
    scores = [
        Score(True, 30.0, 0.2, 100.0, 10.0, 1e-6, -1),
        Score(True, 50.0, -0.1, 300.0, 30.0, 3e-6, -1),
        Score(False, math.inf, 0.1, 900.0, 90.0, 2e-6, -1),
        Score(False, math.inf, 0.4, 5.0, 5.0, 1e-6, 10),
    ]
    plan = SceneTask("ismail_dunnigan", Gains(), Conditions(report_failures=True)).plan(4)
    lines = [json.dumps(scene) for scene in (*PLAIN[:2], *HARD[:2])]
    told = [row_of(9 - i, s, 0.01, line) for i, (s, line) in enumerate(zip(scores, lines, strict=True))]
    found = results_of(tmp_path / "rows.parquet", told[::-1])
    summary = summarize_campaign(plan, found, tmp_path)
    assert [summary[key] for key in ("law", "scenes", "reached", "violations")] == ["ismail_dunnigan", 4, 2, 2]
    assert summary["medians"] == {
        "reach_time": 40.0, "effort": 200.0, "thrust_variation": 20.0, "worst_step_time": 2e-6,
        "min_clearance": pytest.approx(0.05),
    }  # fmt: skip
    assert (summary["least_clearance"], summary["worst_step_time"]) == (-0.1, 3e-6)
    assert summary["failed"] == {"not_reached": [6, 7], "violated": [6, 8], "stopped": [6]}
    assert [w["row"] for w in summary["worst"]] == [8, 6, 7, 9]  # 6 was stopped; 7 was never reached
    assert summary["rates"]["completed"]["rows"] == 1 and summary["rates"]["violation"]["share"] == 0.5
    kinds = summary["kinds"]
    assert {name: (of["scenes"], of["rates"]["reached"]["rows"]) for name, of in kinds.items()} == {
        "plain": (2, 2), "drift, noise, failure": (2, 0)
    }  # fmt: skip
    assert kinds["plain"]["quantiles"]["reach_time"]["0.5"] == 40.0
    assert summary["quantiles"]["min_clearance"]["0.5"] == pytest.approx(0.15)
    assert summary["report_failures"] is True and summary["gains"] == Gains()._asdict()
    assert summary["conditions"]["duration"] == 120.0 and summary["versions"]["numpy"] == np.__version__
    json.dumps(summary, allow_nan=False)


# ---- scenes and gains ----


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([*PLAIN, PLAIN[2]], "seed 20002 comes twice"),
        ([], "holds no scene"),
        ([PLAIN[0], {}], "line 2"),
        ([PLAIN[0], {"x": "y" * 1_000_001}], "line 2: has more than 1000000 bytes"),
    ],
)
def test_invalid_scenes_are_rejected_before_writing(tmp_path, lines, words):
    with pytest.raises(ScenarioError, match=words):
        run_campaign(write(tmp_path / "s.jsonl", lines), "ismail_dunnigan", tmp_path / "out", BRIEF)
    assert not (tmp_path / "out").exists()


def test_scene_store_returns_each_scene_and_ignores_whitespace(tmp_path):
    spaced = tmp_path / "spaced.jsonl"
    spaced.write_text("\n\n".join(json.dumps(scene, indent=None, separators=(" , ", " : ")) for scene in HARD))
    with SceneStore(spaced) as one, SceneStore(write(tmp_path / "s.jsonl", HARD)) as other:
        assert one.digest == other.digest and one.seeds == [20000, 20001, 20002, 20003, 20004, 20005]
        (line,) = one.lines([20003])
        assert decode_scene(line) == decode_scene(json.dumps(HARD[3]).encode())


def test_gains_are_parsed_from_text():
    assert gains_from("ismail_dunnigan", ["k_p1=10", " gamma = 3e0 "]) == Gains(k_p1=10.0, gamma=3.0)
    assert gains_by_law(["ismail_dunnigan"], ["ismail_dunnigan.k_q=2"]) == {"ismail_dunnigan": Gains(k_q=2.0)}
    with pytest.raises(RunError, match=r"expected LAW\.KEY=VALUE with one of ismail_dunnigan"):
        gains_by_law(["ismail_dunnigan"], ["k_p1=3"])


def test_zero_workers_are_rejected(tmp_path, scenes):
    with pytest.raises(RunError, match="workers is 0"):
        run_campaign(scenes, "ismail_dunnigan", tmp_path / "out", BRIEF, workers=0)


def test_plan_differences_are_described_in_text():
    assert difference({"a": {"b": 1}, "c": 2}, {"a": {"b": 3}, "c": 2, "d": "x" * 50}) == (
        "a.b is 1, now 3; d is None, now 'xxxxxxxxx…"
    )
    assert difference({"law": "x", "c": 2}, {"law": "y", "c": 3}) == "law is 'x', now 'y'"
    assert difference(dict.fromkeys("abcde", 1), dict.fromkeys("abcde", 2)).endswith("c is 1, now 2; and 2 more")
    assert difference({"a": {"b": 1}}, {"a": {"b": 1}}) == ""
    assert difference({"a": [1, {"b": 2}]}, {"a": [1, {"b": 3}]}) == "a.1.b is 2, now 3"
    assert difference({"a": [1, 2]}, {"a": [1]}) == "a is [1, 2], now [1]"
    assert difference({"kind": "scenes", "law": "x"}, {"kind": "sweep"}) == "kind is 'scenes', now 'sweep'"


def test_results_of_another_kind_are_rejected(tmp_path):
    pq.write_table(pa.table({"seed": ["text"]}), tmp_path / "x.parquet")
    with pytest.raises(RunError, match=r"x\.parquet: cannot be read: column 'seed' holds string, .*expected int64$"):
        Results(tmp_path / "x.parquet", SCHEMA)
    (tmp_path / "y.parquet").write_bytes(b"none")
    with pytest.raises(RunError, match=r"y\.parquet: cannot be read"):
        Results(tmp_path / "y.parquet")
