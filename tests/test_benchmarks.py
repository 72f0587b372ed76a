"""The benchmarks run and compare the same plant. No test asserts a time."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

from benchmarks import page, peer_environment
from benchmarks.__main__ import BENCHMARKS, main
from benchmarks.contest import Contest
from benchmarks.contests.plant import STEP, THRUST, WRENCH
from benchmarks.fmu import INPUTS, export_numpy_plant
from benchmarks.peer_environment import Environment
from benchmarks.peer_process import peer
from benchmarks.peers import numba_body, numpy_body
from benchmarks.scaling import Curve
from benchmarks.table import Row, Table, as_json, format_time, print_tables, write_json
from benchmarks.timing import InProcess, NotMeasuredError, Timing, count_for, fit_exponent, fit_line, take_turns
from benchmarks.vehicle_numbers import vehicle_numbers
from plant_fmu import Plant, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.checking.check import IMPORTERS
from plant_fmu.checking.fmu_file import read_fmu
from plant_fmu.checking.process import run_importer
from plant_fmu.checking.task import Task
from tests.plant_fmu.conftest import STATES


@pytest.fixture
def here(monkeypatch):
    """Use the Python of the tests as that of the peers, without installing."""
    monkeypatch.setattr(peer_environment, "install", lambda again=False: pytest.fail("installs"))
    return Environment(sys.executable)


# ---- the tables ----


@pytest.mark.slow
@pytest.mark.parametrize("name", BENCHMARKS)
def test_each_benchmark_prints_a_table(name, capsys, tmp_path):
    main([name, "--steps", "60", "--repeats", "2", "--json", str(tmp_path / "figures.json")])
    lines = capsys.readouterr().out.splitlines()
    figures = json.loads((tmp_path / "figures.json").read_text())
    (table,) = figures["tables"]
    assert len(table["rows"]) >= 5
    assert lines[: len(figures["machine"])] == figures["machine"]
    for row, line in zip(table["rows"], lines[-len(table["rows"]) :], strict=True):
        assert row["name"] in line
        # one step of a law may be shorter than what its clock is uncertain by
        assert row["note"] or (sum(row["seconds"]) if name == "law" else min(row["seconds"])) > 0.0


@pytest.mark.slow
def test_long_record_memory_is_printed_as_a_table(capfd, tmp_path):
    work = ["record", "summary", "export csv"]
    main(["long-record", "--rows", "300", "900", "--work", *work, "--folder", str(tmp_path)])
    lines = capfd.readouterr().out.splitlines()
    assert [line[:24].rstrip() for line in lines[-3:]] == work
    for line in lines[-3:]:
        assert len(re.findall(r"\d+ MB +\d", line)) == 2 and line.endswith("x")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("subject", ["plant", "deciding", "link"])
def test_all_benchmarks_print_one_table_of_ratios(here, subject, capsys, tmp_path):
    arguments = ["--budget", "1e-4", "--repeats", "2", "--peers-python", sys.executable]
    main(["all", subject, *arguments, "--json", str(tmp_path / "figures.json")])
    assert capsys.readouterr().out.count("ratio") == (1 if subject == "link" else 2)  # the link has no peer
    rows = [row for table in json.loads((tmp_path / "figures.json").read_text())["tables"] for row in table["rows"]]
    compared = [row for row in rows if row["ratio"]]
    assert not compared if subject == "link" else len(compared) > 3
    for row in compared:
        low, high = row["range"]
        assert 0.0 < low <= high
    for row in rows:
        assert row["seconds"], row["note"]  # ours are there, whoever else is missing


@pytest.mark.slow
def test_growth_exponent_is_printed_for_each_curve(capsys, monkeypatch):
    monkeypatch.setattr("benchmarks.scaling.OBSTACLES", (1, 3, 10))
    monkeypatch.setattr("benchmarks.scaling.HORIZONS", (1.0, 2.0, 4.0))
    main(["scaling", "horizon", "obstacles", "--budget", "1e-4", "--repeats", "1"])
    assert capsys.readouterr().out.count("exponent") == 5


def test_comparison_row_shows_the_time_ratio(capsys):
    row = Row("ours", Timing((2e-6, 1e-6, 3e-6)), "theirs", Timing((8e-6, 8e-6, 6e-6)), is_paired=True)
    assert row.ratio == 4.0
    assert row.range == (2.0, 8.0)
    missing = Row("ours", Timing((1.0,)), "nobody", "not installed: no such thing", is_paired=True)
    print_tables([Table("a step", (row, missing))], "theirs to ours", ["a machine"])
    machine, _, heading, title, first, second = capsys.readouterr().out.splitlines()
    assert (machine, title) == ("a machine", "-- a step")
    assert heading.split()[:2] == ["ratio", "range"]
    assert first.split()[:2] == ["4.00x", "2.00–8.00"]
    assert second.endswith("– not installed: no such thing")


def test_parts_are_shown_as_multiples_of_their_base():
    assert Row("part", Timing((3.0,)), "whole", Timing((2.0,))).ratio == 1.5
    assert Row("part", Timing((3.0,)), "whole", Timing((2.0,))).range is None


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(1.0, "1.00 s"), (0.0123, "12.3 ms"), (4.5678e-6, "4.57 µs"), (250e-9, "250 ns"), (0.9999, "1.00 s")],
)
def test_figures_are_printed_with_units(seconds, text):
    assert format_time(seconds) == text


# ---- taking turns ----


class KnownScene:
    """A contestant with a given duration that logs its turns."""

    def __init__(self, name, log, each=1.0, fails_at=None):
        self.name, self.log, self.each, self.fails_at = name, log, each, fails_at

    def seconds(self, count):
        self.log.append(self.name)
        if self.fails_at == len([name for name in self.log if name == self.name]):
            raise NotMeasuredError("broke")
        return self.each * count


def test_contestants_alternate_and_a_failure_is_isolated():
    log = []
    found = take_turns(
        [KnownScene("a", log), "missing", KnownScene("b", log, 2.0), KnownScene("c", log, fails_at=2)], 0.0, 3, count=1
    )
    assert found == [Timing((1.0,) * 3), "missing", Timing((2.0,) * 3), "broke"]
    assert "".join(log) == "abcabcab"


def test_item_count_fits_the_time_budget():
    log = []
    count = count_for(KnownScene("a", log, 1e-6), 0.25)
    assert 0.25 <= 1e-6 * count < 1.0
    assert len(log) < 10


def test_failed_start_is_shown_in_its_row():
    def no(_):
        raise OSError("no such device")

    (row,) = (
        Contest("a step", {"ours": lambda _: InProcess(lambda n: sum(range(n)))}, {"peer": no}).measure(1e-5, 2).rows
    )
    assert row.ratio is None
    assert row.base_timing == "OSError: no such device"


def test_growth_exponent_is_estimated():
    assert fit_exponent([1, 10, 100], [3.0, 3e2, 3e4]) == pytest.approx(2.0)
    log = []
    curve = Curve("a step", "things", {n: lambda _, n=n: KnownScene("a", log, n**1.5) for n in (1, 4, 16)}, count=1)
    assert curve.measure(0.0, 2).notes[0] == "exponent 1.50; from one size to the next 1.50, 1.50"


def test_linear_growth_has_a_fixed_and_a_proportional_part():
    assert fit_line([1, 10, 100], [5e-6 + 2e-7 * n for n in (1, 10, 100)]) == pytest.approx(
        (5e-6, 2e-7, 0.0), abs=1e-12
    )
    fixed, each, off = fit_line([1, 2, 4], [1.0, 2.0, 8.0])
    assert fixed == 0.0
    assert 0.1 < off < 1.0 < each


# ---- the peers ----


@pytest.mark.medium
def test_peer_runs_in_its_own_process(here):
    with peer(here, "numpy", "numpy_body", "steps", _setup()) as contestant:
        assert contestant.seconds(3) > 0.0


@pytest.mark.medium
def test_missing_or_failing_peer_is_reported(here):
    with pytest.raises(NotMeasuredError, match="not installed: no-such-peer"):
        here.python("no-such-peer")
    with pytest.raises(NotMeasuredError, match="KeyError"), peer(here, "numpy", "numpy_body", "steps", {}):
        pytest.fail("began")
    with pytest.raises(NotMeasuredError, match="ended with code"), peer(here, "numpy", "sys", "exit", {}):
        pytest.fail("began")


def _setup():
    return {"vehicle": vehicle_numbers("odin"), "step": STEP, "thrust": THRUST, "wrench": WRENCH}


@pytest.mark.slow
def test_numpy_and_numba_bodies_match_the_plant():
    setup = _setup() | {"wrench": [0.5, 1.0, 4.0, 2.0, 0.3, -1.0]}
    theirs = numpy_body.Body(setup["vehicle"])
    state, *others = numba_body.arguments(setup)
    tau = theirs.tau(np.array(setup["thrust"]), np.array(setup["wrench"]))
    for _ in range(50):
        theirs.step(tau, STEP)
    numba_body.many(state, *others, 50)
    assert np.abs(state - theirs.state).max() < 1e-14
    with Plant(load_vehicle("odin")) as plant:
        plant.set({f"thrust[{i + 1}]": x for i, x in enumerate(setup["thrust"])})
        plant.set({f"wrench.{axis}": x for axis, x in zip("XYZKMN", setup["wrench"], strict=True)})
        plant.set({"substep": STEP})
        plant.initialize()
        for _ in range(50):
            plant.step(STEP)
        ours = [plant[name] for name in STATES]
    assert np.abs(state - ours).max() < 1e-12
    assert np.abs(ours).min() > 0.0


@pytest.mark.slow
def test_the_numpy_plant_is_the_same_plant(tmp_path):
    path = export_numpy_plant(tmp_path)
    if path is None:
        pytest.skip("pythonfmu is not installed")
    fmpy = next(importer for importer in IMPORTERS if importer.name == "FMPy")
    task = Task(stop_time=0.5, start=INPUTS | {"wrench.K": 2.0, "wrench.N": -1.0, "wrench.Z": 4.0})
    theirs, ours = (run_importer(fmpy, read_fmu(p), task) for p in (path, cached_fmu(load_vehicle("odin"), 2)))
    assert (theirs.status, ours.status) == ("ok", "ok"), theirs.note + ours.note
    for name in STATES:
        assert ours.values[name] != 0.0
        assert theirs.values[name] == pytest.approx(ours.values[name], abs=1e-12)


# ---- the page ----


def test_page_update_replaces_only_figures(tmp_path):
    paired = Row("ours", Timing((1e-6, 2e-6)), "a|b", Timing((4e-6, 4e-6)), is_paired=True)
    missing = Row("ours", Timing((1e-6,)), "nobody", "not installed", is_paired=True)
    plain = Row("3 obstacles", Timing((2.0,)), "1 obstacles", Timing((1.0,)))
    tables = {"all": [Table("a step", (paired, missing))], "scaling": [Table("a run", (plain,), ("grows",))]}
    figures = []
    for verb, of_verb in tables.items():
        write_json(tmp_path / verb, as_json(verb, of_verb, "theirs to ours", ["a machine", "calm"]))
        figures.append(page.read_figures(tmp_path / verb))
    old = page.PAGE.read_text()
    new = page.rewrite(old, figures)
    assert "a machine; calm. The ratio says theirs to ours." in new
    assert "| 2.67 | 2.00–4.00 | ours | 1.50 µs | a/b | 4.00 µs |" in new
    assert "|  |  | ours | 1.00 µs | nobody (not installed) | – |" in new
    assert "| 2.00 | 2.00 s | 2.00 s–2.00 s | 3 obstacles |\n\nGrowth: grows.\n" in new
    assert page.rewrite(new, figures) == new
    assert new.startswith(old[: old.index("<!-- figures")])
    assert new.endswith(old[old.rindex("<!-- end of figures") :])
    assert page.rewrite(new, figures[:1]) == new  # each part by itself


def test_invalid_figures_are_rejected(tmp_path):
    (tmp_path / "a").write_text('{"verb": "step", "tables": []}')
    for path, why in ((tmp_path / "a", "figures of 'step'"), (tmp_path / "b", "no figures")):
        with pytest.raises(page.PageError, match=why):
            page.read_figures(path)
    with pytest.raises(page.PageError, match="marks of the part 'all'"):
        page.rewrite("no marks", [{"verb": "all"}])


def test_peers_are_installed_individually_and_failures_are_recorded(monkeypatch, fmu_cache):
    asked = []

    def run(command, **_):
        asked.append(command[-1] if "install" in command else command)
        failed = "mujoco" in command
        return subprocess.CompletedProcess(command, int(failed), "1.2\n", "ERROR: no such thing\nERROR: no mujoco")

    monkeypatch.setattr(peer_environment.subprocess, "run", run)
    monkeypatch.setattr(peer_environment.venv, "create", lambda *_, **__: None)
    monkeypatch.setattr(peer_environment, "FOLDER", "peers-of-a-test")
    state = peer_environment.install()
    assert state["mujoco"] == "not installed: no mujoco"
    assert {version for name, version in state.items() if name != "mujoco"} == {"1.2"}
    asked.clear()
    assert peer_environment.install() == state
    assert asked == []
    peer_environment.install(again=True)
    assert asked == ["mujoco"]
    environment = Environment()
    assert environment.python("fmpy").startswith(str(fmu_cache))
    with pytest.raises(NotMeasuredError, match="no mujoco"):
        environment.python("mujoco")
