"""What is compiled ahead of a run is what the run needs, so that it compiles nothing."""

import os
import subprocess
import sys

import pytest

from controller import LAWS
from cosim.command_line.cli import main
from cosim.scenario.scenario import load_scenario


def test_it_says_what_took_how_long(capsys):
    assert main(["compile", "paper"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    name, _, took = line.partition(": ")
    assert name == "paper" and took.endswith(" s") and float(took[:-2]) >= 0.0


def test_a_scenario_that_the_compiled_loop_cannot_fly_is_compiled_for_the_master(capsys):
    assert main(["compile", "harbour"]) == 0
    assert capsys.readouterr().out.startswith("harbour: ")


def test_an_unknown_scenario_is_refused_in_one_line(capsys):
    assert main(["compile", "papre"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == "cosim: scenario 'papre' is unknown; did you mean 'paper'? (or a file ending in .toml)\n"


def test_without_a_scenario_every_law_is_compiled_in_its_own_actuation(monkeypatch, capsys):
    seen = []
    monkeypatch.setattr("cosim.command_line.compiling.compile_ahead", lambda *words: seen.append(load_scenario(*words)))
    assert main(["compile"]) == 0
    laws = [scenario.law.name for scenario in seen]
    assert sorted(laws) == sorted(LAWS) and laws[-1] == "deployable"
    assert [line.partition(":")[0] for line in capsys.readouterr().out.splitlines()] == laws


@pytest.mark.slow
def test_after_it_nothing_is_compiled(tmp_path):
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")}

    def cosim(*arguments):
        done = subprocess.run(
            [sys.executable, "-m", "cosim", *arguments], env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return {file.name for file in (tmp_path / "cache").rglob("*.so")}

    kept = cosim("compile", "paper")
    assert len(kept) >= 4  # regions, memberships, law, fused loop
    short = ["--set", "time.duration=0.02", "--set", "arbiter.engine=closed"]
    assert cosim("run", "paper", *short, "--no-report", "--out", str(tmp_path / "run")) == kept
    varied = ["--samples", "2", "--vary", "initial.position.1=-2:2", *short, "--out", str(tmp_path / "sweep")]
    assert cosim("sweep", "paper", *varied) == kept
