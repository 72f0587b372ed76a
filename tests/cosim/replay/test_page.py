"""A page is one small file that needs nothing else, and gives back the numbers of the record."""

import json
import re
import shutil
import struct
import subprocess

import pytest

from cosim.replay.page import replay_page
from cosim.replay.trace import trace_of
from cosim.results.run_result import load_run
from tests.cosim.replay.conftest import CLOSED
from tests.cosim.replay.decoding import read_page

A_MINUTE = 1_000_000  # bytes


@pytest.fixture(scope="module")
def page(docking):
    return replay_page([trace_of(docking).as_json()], docking.scenario.title)


def test_page_numbers_equal_the_record_bit_for_bit(docking, page):
    _, [(header, columns)] = read_page(page)
    rows = {t: k for k, t in enumerate(docking.record["time"].tolist())}
    steps = [rows[t] for t in columns["time"]]
    for name in set(columns) & set(docking.record.units):
        assert columns[name] == docking.record[name][steps].tolist(), name
    assert header["rows"] == len(steps) > 700


@pytest.mark.parametrize("name", ["docking", pytest.param("dense-field", marks=pytest.mark.slow), "paper"])
def test_page_of_one_minute_is_small(name, shipped_run):
    run = load_run(shipped_run(name, CLOSED).folder)
    text = replay_page([trace_of(run).as_json()], "A minute")
    assert run.record["time"][-1] == 60.0
    assert len(text.encode()) < A_MINUTE


def test_page_loads_no_external_resource(page):
    reader, _ = read_page(page)
    for tag, name, value in reader.attributes:
        if name in ("src", "href", "xlink:href", "action", "data", "poster", "srcset", "content"):
            assert re.match(r"data:|#", value) or name == "content", (tag, name, value)
        assert not name.startswith("on"), (tag, name)
    assert not re.search(r"@import|url\((?!['\"]?(data:|#))", page)
    # the name of the SVG format is no address that is asked
    assert re.findall(r"https?://[^\s\"'`]+", page.replace("http://www.w3.org/2000/svg", "")) == []
    assert not {"iframe", "object", "embed", "base"} & set(reader.elements)


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
def test_page_script_decodes_the_same_numbers(page, tmp_path):
    """As a browser would, in an engine without one: every number of every column, and the pose between rows."""
    _, [(header, columns)] = read_page(page)
    script = page[page.index("class Run {") : page.index("async function loadRuns")]
    (tmp_path / "runs.json").write_text(json.dumps(header))
    (tmp_path / "read.mjs").write_text(
        "import { readFileSync } from 'node:fs';\n" + script + "\n"
        "const run = await unpacked(JSON.parse(readFileSync(process.argv[2])));\n"
        "const names = run.header.signals.map((s) => s.name);\n"
        "const bits = (x) => Buffer.from(new Float64Array([...x]).buffer).toString('hex');\n"
        "const out = Object.fromEntries(names.map((n) => [n, bits(run.column(n))]));\n"
        "const t = [run.time[3], run.time[3] / 2 + run.time[4] / 2, run.end + 1, run.start - 1];\n"
        "console.log(JSON.stringify({ out, poses: t.map((x) => run.pose(x)) }));\n"
    )
    command = ["node", tmp_path / "read.mjs", tmp_path / "runs.json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    got = json.loads(done.stdout)
    assert got["out"] == {name: struct.pack(f"<{len(c)}d", *c).hex() for name, c in columns.items()}
    place = [columns[f"position.{axis}"] for axis in "xyz"]
    at, between, after, before = (pose["position"] for pose in got["poses"])
    assert at == [axis[3] for axis in place]
    assert between == pytest.approx([(axis[3] + axis[4]) / 2 for axis in place], abs=1e-12)
    assert after == [axis[-1] for axis in place] and before == [axis[0] for axis in place]
