"""Figures that other processes draw are those that the run's own process draws."""

import os
import subprocess
import sys

import pytest

from cosim.results.run_result import load_run
from cosim.run.run_folder import report_again

RUN = """
import os, signal, sys
from cosim.report.figure_process import figure_process
from cosim.run.run_scenario import run_scenario
fork, forked = os.fork, []
def fork_or_fail():
    if sys.argv[2] == "refused":
        raise BlockingIOError("too many processes")
    forked.append(fork())
    return forked[-1]
os.fork = fork_or_fail
with figure_process() as drawing:
    if sys.argv[2] == "killed":
        os.kill(forked[0], signal.SIGKILL)
    run_scenario("paper", sys.argv[1], figure_process=drawing)
assert ("matplotlib" in sys.modules) == (sys.argv[2] != "alive")
assert not signal.pthread_sigmask(signal.SIG_BLOCK, [])
try:
    os.waitpid(-1, 0)
except ChildProcessError:
    sys.exit()
"""


def figures_of(folder):
    return {file.name: file.read_bytes() for file in (folder / "figures").iterdir()}


@pytest.mark.medium
@pytest.mark.skipif(sys.platform != "linux" or os.cpu_count() == 1, reason="figures are drawn in the run's process")
@pytest.mark.parametrize("process", ["alive", "killed", "refused"])
def test_figures_and_report_are_those_of_the_runs_own_process(tmp_path, process):
    subprocess.run([sys.executable, "-c", RUN, tmp_path / "run", process], check=True, timeout=240)
    page, figures = load_run(tmp_path / "run").files()["report"].read_text(), figures_of(tmp_path / "run")
    report_again(tmp_path / "run")
    assert figures_of(tmp_path / "run") == figures and len(figures) == 10
    assert load_run(tmp_path / "run").files()["report"].read_text() == page
