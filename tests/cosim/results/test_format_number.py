"""Files of another format version are rejected in one line."""

import json
import shutil

import pyarrow.parquet as pq
import pytest

from cosim.campaigns.store.folder import read_plan
from cosim.command_line.cli import main
from cosim.errors import RunError

VERBS = [
    ["report", "{run}"],
    ["export", "{run}", "--to", "csv"],
    ["report", "--replay", "{run}", "--out", "replay.html"],
]


@pytest.mark.medium(fast=4)
@pytest.mark.parametrize("verb", VERBS, ids=lambda words: words[0])
@pytest.mark.parametrize(("said", "named"), [(None, "1"), ({"format": "3"}, "3"), ({"format": "x\x1b"}, "x")])
def test_record_of_another_format_version_is_rejected(shipped_run, tmp_path, monkeypatch, capsys, verb, said, named):
    monkeypatch.chdir(tmp_path)
    run = shipped_run("paper", "arbiter.engine=closed", "time.duration=0.05").folder
    shutil.copytree(run, tmp_path / "run")
    record = tmp_path / "run" / "record.parquet"
    table = pq.read_table(record).replace_schema_metadata(said)
    if said is None:
        table = table.rename_columns(["helm.armed" if name == "goal.value" else name for name in table.column_names])
    pq.write_table(table, record)
    assert main([word.format(run="run") for word in verb]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and f"record.parquet: format is {named}" in told and "\x1b" not in told
    assert ("helm.* are commands.*" in told) == (said is None)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run"]


@pytest.mark.parametrize(("said", "named"), [({}, "1"), ({"format": 7}, "7"), ({"format": [2]}, r"\[2\]")])
def test_campaign_of_another_format_version_is_rejected(tmp_path, said, named):
    (tmp_path / "campaign.json").write_text(json.dumps({"kind": "scenes"} | said))
    with pytest.raises(RunError, match=rf"campaign\.json: format is {named}, expected 2"):
        read_plan(tmp_path)
