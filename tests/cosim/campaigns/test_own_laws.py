"""Laws of Python code in campaigns, comparisons, sweeps and searches: by file and name, or as an object."""

import numpy as np
import pytest

import cosim
from controller import FunctionLaw
from cosim.campaigns.rerun import rerun
from cosim.campaigns.scenes.conditions import Conditions
from cosim.command_line.cli import main
from cosim.errors import RunError
from cosim.scenario.law_factory import own_law, read_law
from tests.architecture.modules import ROOT

FILE = """
import numpy as np
from neighbor import GAIN

def brake(state, goal, regions, weights):
    return -GAIN * state.velocity_body

def bad(state, goal, regions, weights):
    return 1 / 0

class Counting:
    def __init__(self):
        self.steps = 0

    def __call__(self, state, goal, regions, weights):
        self.steps += 1
        return np.array([0.1 * self.steps, 0.0, 0.0, 0.0, 0.0, 0.0])

counting = Counting()
NUMBER = 3
"""
SHORT = ["time.duration=2", "time.step=0.01", "time.control=0.01", "time.arbiter=0.01", "arbiter.engine=closed"]
CONDITIONS = Conditions(duration=1.0)
COLUMNS = ("min_clearance", "effort", "thrust_variation")


def brake(state, goal, regions, weights):
    return -60.0 * state.velocity_body


class Counting:
    """As in the file."""

    def __init__(self):
        self.steps = 0

    def __call__(self, state, goal, regions, weights):
        self.steps += 1
        return np.array([0.1 * self.steps, 0.0, 0.0, 0.0, 0.0, 0.0])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(FILE)
    (tmp_path / "neighbor.py").write_text("GAIN = 60.0\n")
    (tmp_path / "scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    return tmp_path


def rows(law, out, workers=1):
    results = cosim.run_campaign("scenes.jsonl", law, out, CONDITIONS, workers=workers).results
    assert results.is_null("refused").all()
    return [results.number(name) for name in COLUMNS]


def test_flights_are_the_same_by_object_file_and_class(folder):
    """A law with memory begins each flight anew."""
    np.testing.assert_array_equal(rows("mine.py:brake", "a"), rows(FunctionLaw(brake), "b"))
    counted = rows("mine.py:Counting", "c")
    np.testing.assert_array_equal(counted, rows("mine.py:counting", "d"))
    np.testing.assert_array_equal(counted, rows(Counting(), "e"))
    assert (counted[1] > 0.0).all()


@pytest.mark.medium
def test_flight_has_the_bits_of_a_recorded_run(folder):
    scenario = cosim.load_scenario("paper", SHORT)
    design = cosim.Design(cosim.vary_from(["initial.position.0=0,1"]), "grid")
    sweep = cosim.run_sweep(scenario, design, "sweep", law=FunctionLaw(brake)).results
    for i, x in enumerate((0.0, 1.0)):
        varied = scenario.replace({"initial.position.0": x})
        run = cosim.run_scenario(varied, f"run{i}", report=False, law=FunctionLaw(brake))
        assert sweep.number("final_z")[i] == run.record["position.z"][-1]
    cosim.run_sweep(scenario, design, "by-file", law="mine.py:brake")
    assert rerun(folder / "by-file", 1, folder / "again", law=read_law("mine.py:brake")).differing == {}


@pytest.mark.medium
def test_workers_and_comparisons_fly_it(folder):
    np.testing.assert_array_equal(rows("mine.py:Counting", "a"), rows("mine.py:Counting", "b", workers=2))
    done = cosim.compare("scenes.jsonl", [FunctionLaw(brake), "mine.py:brake", "pd"], "both", CONDITIONS)
    assert list(done.campaigns) == ["tests.cosim.campaigns.test_own_laws.brake", "mine.brake", "pd"]
    one, other, _ = [campaign.results.number("effort") for campaign in done.campaigns.values()]
    np.testing.assert_array_equal(one, other)


def test_translated_law_of_a_file_is_set_up_for_each_scene(folder):
    source = f"{ROOT / 'examples' / 'laws' / 'sliding_mode.py'}:SlidingModeLaw"
    assert (rows(source, "a")[1] > 0.0).all()


def test_errors_of_the_code_are_reasons_of_rows(folder):
    results = cosim.run_campaign("scenes.jsonl", "mine.py:bad", "a", CONDITIONS).results
    assert all(" s: ZeroDivisionError: division by zero" in reason for reason in results["refused"].tolist())


@pytest.mark.medium
def test_command_line_takes_it_and_repeats_need_it_again(folder, capsys):
    """A folder never makes Python run code: its law is named again, and is the same file."""
    short = [f"--set={change}" for change in SHORT]
    search = ["falsify", "paper", "--law", "mine.py:brake", "--vary", "initial.position.1=-2:2", "--budget=4", *short]
    assert main([*search, "--out", "search", "--replays=0", "--quiet"]) == 0
    assert main(["campaign", "scenes.jsonl", "--law", "mine.py:brake", "--out", "a", "--replays=1", "--quiet"]) == 0
    assert len(list((folder / "a" / "worst").iterdir())) == 1
    assert main(["rerun", "a", "1", "--law", "mine.py:brake", "--out", "again", "--quiet"]) == 0
    run = ["run", "paper", "--law", "mine.py:brake", *short, "--no-report", "--quiet", "--out", "run"]
    assert main(run) == 0 and cosim.load_run("run").summary["law"] == "mine.py:brake"
    capsys.readouterr()
    (folder / "mine.py").write_text(FILE.replace("-GAIN", "-2.0 * GAIN"))
    for law, words in (([], "expected --law FILE.py:NAME"), (["--law", "mine.py:brake"], "its code has changed")):
        assert main(["rerun", "a", "1", *law, "--quiet"]) == 2
        error = capsys.readouterr().err
        assert words in error and error.count("\n") == 1
    assert main(["campaign", "scenes.jsonl", "--law", "mine.py:brake", "--out", "a", "--quiet"]) == 2
    assert "law_sha256" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("law", "words"),
    [
        ("none.py:steer", "law none.py:steer: No such file"), ("mine.py:braek", "did you mean 'brake'"),
        ("mine.py:NUMBER", "NUMBER is no law or function there"), ("wrong.py:x", "wrong.py:x: SyntaxError: "),
        ("exits.py:x", "exits.py:x: SystemExit: 3"), ("mine.py:", "law 'mine.py:' is unknown"),
    ],
)  # fmt: skip
def test_what_is_no_law_is_refused(folder, law, words, capsys):
    (folder / "wrong.py").write_text("def x(:\n")
    (folder / "exits.py").write_text("raise SystemExit(3)\n")
    assert main(["campaign", "scenes.jsonl", "--law", law, "--out", "a", "--quiet"]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1
    assert not (folder / "a").exists()


def test_gains_are_of_no_own_law(folder):
    assert main(["campaign", "scenes.jsonl", "--law", "mine.py:brake", "--set", "k=1", "--out", "a"]) == 2
    with pytest.raises(RunError, match=r"law is 'pd', expected FILE\.py:NAME"):
        cosim.run_scenario("paper", "run", law="pd")


def test_law_that_no_process_can_receive_flies_in_this_one(folder):
    """A function within another one cannot be pickled."""
    assert (rows(lambda state, goal, regions, weights: np.ones(6), "a")[1] > 0.0).all()
    assert own_law("pd") is None
