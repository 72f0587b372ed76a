"""A record too long for memory tells the same as one that is held, from a few of its rows at a time."""

import dataclasses
import itertools
import tracemalloc

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.long_record import write_long_run
from cosim.export.excerpt import excerpt_of
from cosim.io.strict_json import json_text
from cosim.replay.events import joined_spans
from cosim.replay.trace import trace_of
from cosim.report.contents import contents_of
from cosim.report.figures.sampled_rows import make_figure_data
from cosim.report.figures.style import FigureData
from cosim.results.extremes import even_edges, extreme_rows
from cosim.results.record import Record
from cosim.results.run_result import load_run
from cosim.results.spans import Spans, spans
from cosim.results.summary import _Sum

RUNS = ("paper", "docking", "steered", "with V")


@pytest.fixture(scope="module")
def run_of(request, shipped_run):
    def run(name):
        if name == "with V":
            keys = ("arbiter.engine=closed", "time.duration=2", "record.lyapunov=true")
            return load_run(shipped_run("paper", *keys).folder)
        return request.getfixturevalue(name)

    return run


@pytest.fixture
def streamed(monkeypatch):
    """Return a function that opens a run anew, to be read in blocks of an odd size."""
    monkeypatch.setattr("cosim.results.record._BLOCK", 777)
    monkeypatch.setattr("cosim.report.figures.sampled_rows._MAX_WHOLE_ROWS", 100)

    def reopened(run):
        with monkeypatch.context() as patch:
            patch.setattr("cosim.results.record._SMALL", 0)
            again = load_run(run.folder)
        assert not again.record._small and not again.record._kept
        return again

    return reopened


@pytest.mark.medium
@pytest.mark.parametrize("name", RUNS)
def test_streamed_run_gives_the_same_report_and_trace(name, run_of, streamed):
    run = run_of(name)
    long = streamed(run)
    assert json_text(long.summary) == json_text(run.summary)
    assert long.scenario.toml() == run.scenario.toml()
    assert contents_of(long) == contents_of(run)
    assert trace_of(long).as_json() == trace_of(run).as_json()
    assert not long.record._kept  # nothing was read as a whole


def test_streamed_run_with_gaps_gives_the_same_report_and_trace(docking, copy_of, spoil, streamed):
    run = load_run(spoil(copy_of(docking), "gaps"))
    long = streamed(run)
    assert contents_of(long) == contents_of(run) and contents_of(run)["remarks"]
    assert trace_of(long).as_json() == trace_of(run).as_json()


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize(("every", "rate"), [(1, None), (7, None), (1, 30.0)])
def test_streamed_excerpt_is_identical(every, rate, docking, streamed):
    held = excerpt_of(docking.folder, ["time", "position.x"], every, rate)
    long = dataclasses.replace(held, source=streamed(docking))
    rows = [np.concatenate([block.to_array() for block in excerpt.blocks()]) for excerpt in (held, long)]
    assert rows[0].tobytes() == rows[1].tobytes() and len(rows[0]) == held.count == long.count
    steps = np.array([0, 5, held.count - 1])
    assert long.take(steps, ["time"])["time"].tolist() == rows[0][steps, 0].tolist()


@pytest.mark.medium
@pytest.mark.parametrize("name", RUNS)
def test_figures_of_a_long_run_are_thinned_and_keep_extremes(name, run_of, streamed, monkeypatch):
    monkeypatch.setattr("cosim.report.figures.sampled_rows._MAX_SAMPLED_ROWS", 2000)
    monkeypatch.setattr("cosim.report.figures.sampled_rows._EVEN", 1000)
    run = run_of(name)
    story = make_figure_data(streamed(run))
    n, drawn = len(run.record), story.record
    assert len(drawn) <= 2000 + 1000 or len(drawn) == n
    at = np.searchsorted(run.record["time"], drawn["time"])
    assert at[0] == 0 and at[-1] == n - 1
    told = [n for n in drawn.units if n.startswith(("attitude.", "weight.", "lyapunov.")) or n.endswith(".clearance")]
    for signal in drawn.units:
        assert drawn[signal].tobytes() == run.record[signal][at].tobytes()
    for signal in told:
        assert (np.nanmin(drawn[signal]), np.nanmax(drawn[signal])) == (
            np.nanmin(run.record[signal]),
            np.nanmax(run.record[signal]),
        ), signal
    force = [np.linalg.norm(of.stack([f"command.{axis}" for axis in "XYZ"]), axis=1) for of in (drawn, run.record)]
    assert force[0].max() == force[1].max()
    length = [np.linalg.norm(np.diff(of.stack([f"position.{a}" for a in "xyz"]), axis=0), axis=1).sum()
              for of in (drawn, run.record)]  # fmt: skip
    assert length[0] == pytest.approx(length[1], rel=1e-3)


@pytest.mark.medium
@pytest.mark.parametrize("name", RUNS)
def test_every_figure_of_a_long_run_is_drawn(name, run_of, streamed, monkeypatch):
    from cosim.report.figures.figures import drawings

    monkeypatch.setattr("cosim.report.figures.sampled_rows._MAX_SAMPLED_ROWS", 2000)
    run = run_of(name)
    stories = FigureData(run.scenario, run.record, run.summary), make_figure_data(streamed(run))
    whole, few = ([drawing.name for drawing in drawings(story)] for story in stories)
    assert whole == few


# ---- one pass, block by block --------------------------------------------------------------------------------------


def cut(data, array):
    """Return an array in pieces, some of them empty."""
    at = sorted(data.draw(st.lists(st.integers(0, len(array)), max_size=6)))
    return np.split(array, at)


@given(st.lists(st.sampled_from([1.0, -1.0, -2.0, np.nan]), max_size=40), st.data())
def test_spans_do_not_depend_on_blocks(signal, data):
    signal = np.array(signal)
    time = np.arange(len(signal)) * 0.5
    found, ended = Spans(), []
    at = sorted(data.draw(st.lists(st.integers(0, len(signal)), max_size=6)))
    for t, s in zip(np.split(time, at), np.split(signal, at), strict=True):
        ended += found.add(s < 0.0, t, s)
    told = [*ended, *([found.open] if found.open else [])]
    assert [(span.start, span.end) for span in told] == spans(signal < 0.0, time)
    for span in told:
        within = signal[(time >= span.start) & (time < span.end) | (time == span.start)]
        held = within[within < 0.0] if span is found.open else within
        assert span.least == (min(held) if span is not found.open else min(signal[time >= span.start]))


@given(st.lists(st.integers(1, 4), max_size=60), st.integers(1, 5), st.data())
def test_widest_gaps_do_not_depend_on_blocks(lengths, most, data):
    flags = np.array([i % 2 == 0 for i, length in enumerate(lengths) for _ in range(length)], bool)
    time = np.arange(len(flags)) * 1.0
    at = sorted(data.draw(st.lists(st.integers(0, len(flags)), max_size=6)))
    blocks = zip(np.split(time, at), np.split(flags, at), itertools.repeat(None))
    found = [(span.start, span.end) for span, _ in joined_spans(blocks, most)]
    # all at once: close every gap that is no wider than the widest one that has to go
    whole = spans(flags, time)
    gaps = [b[0] - a[1] for a, b in itertools.pairwise(whole)]
    apart = sorted(gaps)[len(whole) - most - 1] if len(whole) > most else -1.0
    joined = whole[:1]
    for gap, span in zip(gaps, whole[1:], strict=True):
        joined = [*joined, span] if gap > apart else [*joined[:-1], (joined[-1][0], span[1])]
    assert found == joined


@given(st.lists(st.sampled_from([0.0, 1.0, 2.0, np.nan, np.inf, -np.inf]), min_size=1, max_size=40), st.data())
def test_extremes_do_not_depend_on_blocks(signal, data):
    signal = np.array(signal)
    edges = even_edges(len(signal), data.draw(st.integers(1, len(signal))))
    found = extreme_rows([[piece] for piece in cut(data, signal)], 1, edges)
    expected = set()
    for part in np.array_split(np.arange(len(signal)), len(edges) - 1):
        if np.isfinite(signal[part]).any():
            expected |= {int(part[np.nanargmin(signal[part])]), int(part[np.nanargmax(signal[part])])}
    assert found.tolist() == sorted(expected)


@given(st.integers(0, 3), st.data())
def test_sum_does_not_depend_on_blocks(times, data):
    rng = np.random.default_rng(data.draw(st.integers(0, 99)))
    numbers = rng.lognormal(sigma=5.0, size=times * 2**18 + data.draw(st.integers(0, 999)))
    totals = []
    for pieces in ([numbers], cut(data, numbers)):
        total = _Sum()
        for piece in pieces:
            total.add(piece)
        totals.append(total.total())
    assert totals[0] == totals[1] == pytest.approx(numbers.sum(), rel=1e-13)
    assert times or totals[0] == numbers.sum()  # to the last bit, as NumPy has it


# ---- memory --------------------------------------------------------------------------------------------------------


def _peaks(run, work):
    """Return the most memory [bytes] that work took in NumPy and Python, and in PyArrow."""
    before, pool = pa.default_memory_pool(), pa.proxy_memory_pool(pa.default_memory_pool())
    pa.set_memory_pool(pool)
    tracemalloc.start()
    try:
        work(run)
        return tracemalloc.get_traced_memory()[1], pool.max_memory()
    finally:
        tracemalloc.stop()
        pa.set_memory_pool(before)


def _told(path):
    run = load_run(path)
    contents_of(run)
    make_figure_data(run)
    trace_of(run, 500_000).as_json()


def _exported(path):
    excerpt = excerpt_of(path, rate=500.0)
    assert excerpt.count == sum(len(block) for block in excerpt.blocks())


@pytest.mark.slow
def test_memory_does_not_grow_with_the_rows(tmp_path, monkeypatch):
    monkeypatch.setattr("cosim.results.record._SMALL", 2**21)
    monkeypatch.setattr("cosim.report.figures.sampled_rows._MAX_SAMPLED_ROWS", 5000)
    monkeypatch.setattr("cosim.report.figures.sampled_rows._MAX_WHOLE_ROWS", 5000)
    rows = {n: tmp_path / str(n) for n in (40_000, 160_000)}
    for n, path in rows.items():
        write_long_run(path, n)
    few, many = rows.values()
    more = 8 * len(Record(few / "record.parquet").units) * 120_000  # bytes
    for work in (_told, _exported):
        work(few)  # what is imported and compiled is not counted
        for least, most in zip(_peaks(few, work), _peaks(many, work), strict=True):
            assert most - least < more / 40  # two signals and a half
