"""The command line: each verb, its exit status, and one-line errors without files."""

import csv
import io
import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest

from fuzzy_arbiter import Arbiter, Output, System, Variable, falling, rising
from fuzzy_arbiter.__main__ import main
from fuzzy_arbiter.hierarchy import WEIGHT
from tests.fuzzy_arbiter.formats.systems import REFUSED


@pytest.fixture
def run(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)

    def call(*words, stdin=""):
        monkeypatch.setattr(sys, "stdin", io.StringIO(stdin))
        try:
            status = main([str(word) for word in words])
        except SystemExit as stop:
            status = stop.code
        out, err = capsys.readouterr()
        return status, out, err

    return call


@pytest.fixture
def refused(run, tmp_path):
    """Run a command that must fail: status 2, a one-line error, no output, no file."""

    def call(*words, stdin=""):
        before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        status, out, err = run(*words, stdin=stdin)
        assert (status, out) == (2, "")
        assert err.startswith("fuzzy_arbiter: ") and err.count("\n") == 1
        assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before
        return err.removeprefix("fuzzy_arbiter: ").strip()

    return call


@pytest.fixture
def gap(tmp_path):
    """A file whose rules leave winds between calm and strong without one."""
    wind = Variable("wind", (0, 20), {"calm": falling(2, 6), "strong": rising(8, 12)})
    sail = Output("sail", (0, 1), {"none": falling(0, 1), "full": rising(0, 1)})
    rules = ("if wind is calm then sail is full", "if wind is strong then sail is none")
    Arbiter(System((wind,), (sail,), rules, name="gap")).save(tmp_path / "gap.json")
    return tmp_path / "gap.json"


def test_show_prints_the_complete_definition(run):
    status, out, _ = run("show", "section-vi")
    assert status == 0
    for part in (
        "obstacle in [0.0, 1.0]",
        "not_exist  (0.0, 1.0) (1.0, 0.0)",
        "alpha_3 in [0.0, 1.0], no default",
        "R6: if obstacle is exist or shape is complex then alpha_3 is low",
        "conjunction    min",
        "normalization  range",
        "engine         closed: ",
    ):
        assert part in out
    assert "engine         exact: requested" in run("show", "section-vi", "--engine", "exact")[1]


@pytest.mark.parametrize(
    "words",
    [
        ["0.75", "1", "0"],
        ["depth=0", "obstacle=0.75", "shape=1"],
        ["--engine", "closed", "0.75", "1.0", "0"],
        ["0.75", "--engine", "closed", "1", "0"],
    ],
)
def test_eval_gives_the_weights_in_all_digits(run, words):
    assert run("eval", "section-vi", *words) == (0, "obstacle = 0.84375\nshape = 0.15625\ndepth = 0.0\n", "")


def test_eval_gives_json(run, tmp_path):
    status, out, _ = run("eval", "section-vi", "--json", "0.1", "0.2", "0.3")
    assert status == 0
    assert tuple(json.loads(out).values()) == Arbiter()([0.1, 0.2, 0.3])
    assert run("eval", "section-vi", "1", "0", "0", "--json", "--out", "w.json")[:2] == (0, "")
    assert json.loads((tmp_path / "w.json").read_text()) == {"obstacle": 1.0, "shape": 0.0, "depth": 0.0}


TABLE = 'time,"depth", obstacle,shape\n0,0.5,0.25,1\n\n1,1,0,1e-1\n'


def test_eval_of_a_table_takes_columns_by_name(run, tmp_path):
    (tmp_path / "day.csv").write_text("\ufeff" + TABLE)
    weights = Arbiter().batch([[0.25, 1.0, 0.5], [0.0, 0.1, 1.0]]).tolist()
    for words, stdin in ((["day.csv"], ""), (["-"], TABLE)):
        status, out, _ = run("eval", "section-vi", "--csv", *words, stdin=stdin)
        header, *rows = csv.reader(io.StringIO(out))
        assert status == 0 and header == ["obstacle", "shape", "depth"]
        assert [[float(cell) for cell in row] for row in rows] == weights
    assert run("eval", "section-vi", "--csv", "day.csv", "--out", "out.csv") == (0, "", "")
    assert (tmp_path / "out.csv").read_text() == out
    listed = json.loads(run("eval", "section-vi", "--csv", "day.csv", "--json")[1])
    assert [list(row.values()) for row in listed] == weights
    assert run("eval", "section-vi", "--csv", "-", stdin="shape,depth,obstacle\n")[1] == "obstacle,shape,depth\n"


@pytest.mark.parametrize(
    ("table", "fault"),
    [*REFUSED["csv"], ('obstacle,shape,depth\n"0' + "1" * 200_000, "line 2: field larger than field limit")],
)
def test_invalid_table_leaves_no_file(refused, table, fault):
    assert f"standard input: {fault}" in refused("eval", "section-vi", "--csv", "-", "--out", "w.csv", stdin=table)


def test_unreadable_tables_are_rejected(refused, tmp_path):
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00")
    assert refused("eval", "section-vi", "--csv", "bytes.csv") == "bytes.csv: not UTF-8 text"
    assert refused("eval", "section-vi", "--csv", "none.csv") == "none.csv: No such file or directory"
    (tmp_path / "ok.csv").write_text(TABLE)
    assert "no/where.csv" in refused("eval", "section-vi", "--csv", "ok.csv", "--out", "no/where.csv")
    assert "Is a directory" in refused("eval", "section-vi", "--csv", "ok.csv", "--out", tmp_path)


@pytest.mark.parametrize(
    ("verb", "words", "fault"), [(verb, *row) for verb in ("eval", "plot") for row in REFUSED[verb]]
)
def test_invalid_arguments_give_one_line_errors(refused, verb, words, fault):
    assert fault in refused(verb, "section-vi", *words)


def test_invalid_commands_and_definitions_give_one_line_errors(refused, tmp_path):
    assert "the following arguments are required: verb" in refused()
    assert "invalid choice: 'frob'" in refused("frob", "section-vi")
    assert "show: the following arguments are required: FILE" in refused("show")
    assert "unknown argument '1'" in refused("show", "section-vi", "1")
    assert "none.json" in refused("show", "none.json")
    (tmp_path / "bad.json").write_text('{"a": \n\n')
    assert "bad.json" in refused("verify", "bad.json")
    (tmp_path / "bad.fcl").write_text("FUNCTION_BLOCK\n\n;")
    assert "bad.fcl" in refused("show", "bad.fcl")


def test_undefined_output_is_printed_as_nan_with_a_reason(run, gap):
    assert run("eval", gap, "7")[:2] == (0, "sail = nan\n")
    assert run("eval", gap, "7", "--json")[:2] == (0, '{"sail": null}\n')
    assert run("eval", gap, "--csv", "-", stdin="wind\n1\n7\n")[1].splitlines()[2] == "nan"
    assert json.loads(run("eval", gap, "--csv", "-", "--json", stdin="wind\n7\n")[1]) == [{"sail": None}]
    assert "no rule fired, and no default" in run("explain", gap, "7")[1]


def test_explain_and_verify_print_text_or_json(run, refused, gap):
    status, out, _ = run("explain", "section-vi", "0.75", "1", "0")
    assert status == 0 and "R5" in out
    status, out, _ = run("explain", "section-vi", "obstacle=0.75", "shape=1", "depth=0", "--json")
    assert status == 0 and json.loads(out)["winner"] == "obstacle"
    for file, expected in (("section-vi", 0), (gap, 1)):
        status, out, _ = run("verify", file)
        assert status == expected and out.splitlines()[-1] == ("ok", "not ok")[expected]
        assert json.loads(run("verify", file, "--json")[1])["ok"] is not bool(expected)
    assert ["consistent " in run("verify", gap, *options)[1] for options in ([], ["--as-criteria"])] == [False, True]
    assert "none.toml" in refused("verify", "none.toml")


@pytest.mark.parametrize("suffix", ["json", "toml", "fcl", "fis", "fll", "c", "py"])
def test_convert_keeps_the_weights_and_writes_code(run, suffix, tmp_path):
    native = ["--native"] if suffix in ("fcl", "fis", "fll") else []
    assert run("convert", "section-vi", f"a.{suffix}", *native) == (0, f"a.{suffix}\n", "")
    if suffix in ("c", "py"):
        assert "alpha_1" in (tmp_path / f"a.{suffix}").read_text()
        return
    status, out, _ = run("eval", f"a.{suffix}", "--json", "0.3", "0.8", "0.1")
    assert status == 0
    assert list(json.loads(out).values()) == pytest.approx(Arbiter()([0.3, 0.8, 0.1]), abs=1e-12)


def test_failed_convert_writes_nothing(refused, tmp_path):
    assert "suffix is '.xml', expected .json, .toml, .fcl, .fis, .fll, .c, .py" in refused(
        "convert", "section-vi", "a.xml"
    )
    (tmp_path / "old.json").write_text("old")
    assert "none.json" in refused("convert", "none.json", "old.json")
    Arbiter(weight=replace(WEIGHT, default=0.5)).save(tmp_path / "default.toml")
    (tmp_path / "old.fis").write_text("old")
    assert "fis cannot express the default 0.5" in refused("convert", "default.toml", "old.fis")
    Arbiter(normalization="sum").save(tmp_path / "sum.toml")
    assert "'sum'" in refused("convert", "sum.toml", "old.fis", "--native")


PLOTS = [
    (["terms"], 6),
    (["terms", "--input", "obstacle", "--output", "alpha_2", "--at", "obstacle=0.3"], 2),
    (["rules", "--at", "0.3", "0.8", "0.1", "--output", "alpha_2"], 1),
    (["profile", "--input", "shape", "--at", "obstacle=0.2", "depth=0.1"], 1),
    (["surface", "--output", "alpha_2", "--at", "depth=0.5"], 2),
    (["surface", "--relief"], 1),
    (["decisions", "--input", "shape", "--input", "depth", "--at", "obstacle=0.1"], 1),
]


@pytest.mark.medium
@pytest.mark.parametrize(("words", "panels"), PLOTS, ids=lambda value: value[0] if isinstance(value, list) else "")
def test_plot_draws_every_kind(run, tmp_path, words, panels):
    assert run("plot", "section-vi", *words, "--out", "a.svg") == (0, "a.svg\n", "")
    first = (tmp_path / "a.svg").read_bytes()
    axes = [g for g in ET.fromstring(first).iter() if g.get("id", "").startswith("axes_")]
    assert len(axes) == panels
    run("plot", "section-vi", *words, "--out", "a.svg")
    assert (tmp_path / "a.svg").read_bytes() == first


@pytest.mark.medium
def test_plot_rules_defaults_to_range_centers_with_a_notice(run, tmp_path, gap):
    status, out, err = run("plot", "section-vi", "rules", "--out", "a.svg")
    assert (status, out) == (0, "a.svg\n") and err.count("\n") == 1
    assert err.endswith("that --at leaves out: obstacle=0.5 shape=0.5 depth=0.5\n")
    drawn = (tmp_path / "a.svg").read_bytes()
    assert run("plot", "section-vi", "rules", "--at", "0.5", "0.5", "0.5", "--out", "b.svg")[2] == ""
    assert (tmp_path / "b.svg").read_bytes() == drawn
    status, _, err = run("plot", "section-vi", "rules", "--at", "shape=0.1", "--out", "a.svg")
    assert status == 0 and err.endswith(": obstacle=0.5 depth=0.5\n")
    assert run("plot", gap, "rules", "--out", "a.svg")[:2] == (0, "a.svg\n")  # wind 10: some rule fires
    assert run("plot", gap, "rules", "--at", "7", "--out", "a.svg")[:2] == (0, "a.svg\n")


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(("suffix", "magic"), [("png", b"\x89PNG"), ("PDF", b"%PDF")])
def test_plot_format_follows_the_suffix(run, tmp_path, suffix, magic):
    assert run("plot", "section-vi", "terms", "--input", "depth", "--out", f"a.{suffix}")[0] == 0
    assert (tmp_path / f"a.{suffix}").read_bytes().startswith(magic)


def test_bench_times_every_engine_or_says_why_not(run, monkeypatch, gap):
    from fuzzy_arbiter.command_line import bench

    monkeypatch.setattr(bench, "_SECONDS", 1e-3)
    monkeypatch.setattr(bench, "_MAX_COUNT", 50)
    status, out, _ = run("bench", "section-vi")
    heading, *rows = out.splitlines()
    assert status == 0 and heading.split()[0] == "engine"
    assert [row.split()[0] for row in rows] == ["closed", "exact", "grid", "skfuzzy"]
    for row in rows:
        _, call, _, batch, _, n = row.split()
        assert float(call) > 0.0 and float(batch) >= 0.0 and 1 <= int(n) <= 50
    status, out, _ = run("bench", gap)
    assert status == 0 and "closed" in out.splitlines()[1] and len(out.splitlines()[1].split()) > 6


SHOW = [sys.executable, "-m", "fuzzy_arbiter", "show", "section-vi"]


def test_closed_output_pipe_exits_silently_with_141():
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(SHOW, stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_full_standard_output_gives_one_line_error():
    with open("/dev/full", "wb") as full:
        done = subprocess.run(SHOW, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "fuzzy_arbiter: standard output: No space left on device\n")


def test_help_examples_parse(run):
    status, out, _ = run("--help")
    examples = [line.split()[3:] for line in out.splitlines() if line.strip().startswith("python -m")]
    assert status == 0 and len(examples) == 7
    from fuzzy_arbiter.__main__ import parse

    for words in examples:
        parse(words[: words.index("||")] if "||" in words else words)
