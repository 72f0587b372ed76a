"""Readers of the folders of runs, campaigns, sweeps and comparisons."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from controller import LAWS
from cosim.campaigns.analysis.campaign_summary import summarize_campaign
from cosim.campaigns.pages.campaign_page import write_campaign_page
from cosim.campaigns.pages.comparison_page import NUMBERS, write_comparison_page
from cosim.campaigns.pages.replays import replay_of
from cosim.campaigns.pages.sweep_page import write_sweep_page
from cosim.campaigns.rerun import repeat_of
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.scene_rows import SCHEMA
from cosim.campaigns.scenes.scene_work import SceneTask
from cosim.campaigns.store.folder import PLAN, RESULTS, SUMMARY
from cosim.campaigns.store.results import Results
from cosim.campaigns.store.row_log import RowLog
from cosim.io.strict_json import json_text
from cosim.replay.events import events_of
from cosim.replay.page import is_page, write_page
from cosim.replay.region_changes import list_region_changes
from cosim.replay.trace import trace_of
from cosim.report.web_page import InlineFigure
from cosim.results.log_facts import IMPORT, LogFacts, TopicFacts, load_log_facts
from cosim.results.record import RECORD, STREAM, load_record
from cosim.results.run_result import _read_summary, load_run, open_run
from cosim.scenario.scenario import load_scenario
from cosim.simulation.columns import column_names
from cosim.simulation.commands.sources import read_log
from tests.security.fuzzing.registry import SCENES, Case, Seeds, reader

# ---- run folders ---------------------------------------------------------------------------------------------------


@reader("summary of a run", "json", "cosim.io.strict_json:read_json")
def summary(seeds: Seeds) -> Case:
    planned = load_run(seeds.run).planned
    return seeds.file(
        "summary.json", lambda path: _read_summary(path, planned), (seeds.run / "summary.json").read_bytes()
    )


@reader("facts of an imported run", "json", "cosim.io.strict_json:read_json", "cosim.results.log_facts:load_log_facts")
def log_facts(seeds: Seeds) -> Case:
    topic = TopicFacts("depth", "BARO", 9, 10.0, 0.3, 1, ((1.0, 2.0),), 0, 0, 0, 0)
    facts = LogFacts("it.bin", 99, 0.5, 10.0, "pulses", (topic,), {"GPS": 3}, ("a remark",))
    return seeds.file(IMPORT, lambda path: load_log_facts(path.parent), json_text(msgspec.to_builtins(facts)).encode())


@reader("commands of a run", "jsonl", "cosim.simulation.commands.sources:read_log")
def commands(seeds: Seeds) -> Case:
    run = load_run(seeds.run)

    def read(path: Path) -> None:
        log = read_log(path)
        list_region_changes(run, log)
        events_of(run, log)

    return seeds.file("commands.jsonl", read, (seeds.run / "commands.jsonl").read_bytes())


def _thinned(folder: Path, rows: int) -> bytes:
    made = io.BytesIO()
    pq.write_table(pq.read_table(folder / RECORD).slice(0, rows), made)
    return made.getvalue()


@reader("record", "parquet", "cosim.results.record:_open_source", "cosim.results.record:_column_of")
def record(seeds: Seeds) -> Case:
    table = pq.read_table(seeds.run / RECORD).slice(0, 9)
    made = io.BytesIO()
    pq.write_table(table.select(table.column_names[:6]), made)

    def read(path: Path) -> None:
        found = load_record(path.parent)
        for name in found.units:
            found[name]
        list(found.blocks())

    return seeds.file(RECORD, read, made.getvalue(), folder=True)


_RECORD = "cosim.results.record"


@reader("record of a killed run", "bytes", f"{_RECORD}:_open_source", f"{_RECORD}:_complete_batches")
def stream(seeds: Seeds) -> Case:
    table = pq.read_table(io.BytesIO(record(seeds).contents[0]))
    made = io.BytesIO()
    with pa.ipc.new_stream(made, table.schema) as writer:
        writer.write_table(table, max_chunksize=3)
    return seeds.file(STREAM, lambda path: list(load_record(path.parent).blocks()), made.getvalue(), folder=True)


@reader("run", "parquet", "cosim.results.record:_open_source", "cosim.results.run_result:open_run")
def run(seeds: Seeds) -> Case:
    """Make every output of a run, for any numbers."""
    folder, flown = seeds.folder(seeds.run), load_run(seeds.run)
    names = column_names(flown.planned)
    seeds.patch.setattr("cosim.simulation.columns.column_names", lambda _: names)

    def read(content: bytes) -> None:
        (folder / RECORD).write_bytes(content)
        trace_of(open_run(folder, flown.planned, "completed", None)).as_json()

    return Case((_thinned(seeds.run, 12),), read, str(folder))


@reader("replay page", "text", "cosim.replay.page:is_page")
def page(seeds: Seeds) -> Case:
    whole = write_page(seeds.folder() / "it.html", [], "a run").read_bytes()
    return seeds.file("it.html", is_page, whole[-40_000:])


# ---- campaigns, sweeps and comparisons -----------------------------------------------------------------------------


@reader("plan of a campaign", "json", "cosim.io.strict_json:read_json")
def plan(seeds: Seeds) -> Case:
    seed = json.loads(SCENES[0])["seed"]
    of = seeds.comparison / "ismail_dunnigan"
    return seeds.file(PLAN, lambda path: repeat_of(path.parent, seed), of=of, folder=True)


def _with_its_scenario(seeds: Seeds, name: str) -> Case:
    """Return the case of a file of a sweep, whose scenario was read before."""
    scenario = load_scenario(seeds.sweep / "scenario.toml")
    case = seeds.file(name, lambda path: repeat_of(path.parent, 1), of=seeds.sweep, folder=True)

    def read(content: bytes) -> None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("cosim.campaigns.rerun.load_scenario", lambda _: scenario)
            case.read(content)

    return replace(case, read=read)


@reader("plan of a sweep", "json", "cosim.io.strict_json:read_json")
def plan_of_sweep(seeds: Seeds) -> Case:
    return _with_its_scenario(seeds, PLAN)


_RESULTS = [f"cosim.campaigns.store.results:Results.{name}" for name in ("__init__", "row", "_read", "values")]


@reader("results of a campaign", "parquet", *_RESULTS)
def results(seeds: Seeds) -> Case:
    plan = SceneTask("ismail_dunnigan", LAWS["ismail_dunnigan"].gains_type(), Conditions()).plan(2)
    seed = json.loads(SCENES[0])["seed"]

    def read(path: Path) -> None:
        repeat_of(path.parent, seed)
        found = Results(path, SCHEMA)
        summarize_campaign(plan, found, path.parent)
        list(found.values("scene"))

    return seeds.file(RESULTS, read, of=seeds.comparison / "ismail_dunnigan", folder=True)


@reader("results of a sweep", "parquet", *_RESULTS[:2])
def results_of_sweep(seeds: Seeds) -> Case:
    return _with_its_scenario(seeds, RESULTS)


@reader("part of a campaign", "bytes", "cosim.campaigns.store.row_log:RowLog._batches")
def part_of_campaign(seeds: Seeds) -> Case:
    """The rows that are damaged are flown again."""
    folder, table = seeds.folder(), pq.read_table(seeds.comparison / "ismail_dunnigan" / RESULTS)
    log = RowLog(folder, SCHEMA)
    log.add(table)
    log.close()
    (file,) = folder.iterdir()
    content = file.read_bytes()

    def read(content: bytes) -> None:
        file.write_bytes(content)
        if len(RowLog(folder, SCHEMA).keys()):
            RowLog(folder, SCHEMA).join(folder.parent / "joined.parquet")

    return Case((content,), read, str(folder))


class _AnyFigure(dict[str, InlineFigure]):
    def __contains__(self, name: object) -> bool:
        return True

    def __missing__(self, name: str) -> InlineFigure:
        return InlineFigure("", "")


def _page_of(
    name: str, write_page: Callable[[Path, int], Path], of: Callable[[Seeds], Path], folder: bool, seeds: Seeds
) -> Case:
    seeds.patch.setattr("cosim.campaigns.pages.replays.write_figures", lambda folder, _: _AnyFigure())
    return seeds.file(name, lambda path: write_page(path.parent, 0), of=of(seeds), folder=folder)


for _name, _file, _write_page, _of, _folder in (
    ("summary of a campaign", SUMMARY, write_campaign_page, lambda seeds: seeds.comparison / "ismail_dunnigan", False),
    ("summary of a sweep", SUMMARY, write_sweep_page, lambda seeds: seeds.sweep, True),
    ("comparison", NUMBERS, write_comparison_page, lambda seeds: seeds.comparison, True),
):
    reader(_name, "json", "cosim.io.strict_json:read_json")(partial(_page_of, _file, _write_page, _of, _folder))


@reader("remarks on a replay", "json", "cosim.io.strict_json:read_json")
def remarks(seeds: Seeds) -> Case:
    return seeds.file(
        "worst/1/flown.json",
        lambda path: replay_of(path.parents[2], 1, [], "it"),
        b'{"remarks": ["printed: step by step it came out otherwise"]}',
    )
