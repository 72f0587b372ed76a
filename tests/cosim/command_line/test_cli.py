"""The command line: one clear line and exit code 2 for every user error."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cosim.command_line.cli import main

QUICK = ["--set", "arbiter.engine=closed", "--set", "time.duration=0.02"]


@pytest.mark.parametrize(
    ("flags", "look"),
    [(["--no-report"], ["summary.json"]), pytest.param([], ["report.html", "replay.html"], marks=pytest.mark.slow)],
    ids=["without a report", "with one"],
)
def test_run_prints_the_verdict_and_output_paths(tmp_path, capsys, flags, look):
    out = tmp_path / "run"
    assert main(["run", "paper", "--out", str(out), *flags, *QUICK]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines()[-len(look) :] == [str(out / name) for name in look]
    assert "never entered the goal region" in said.out
    assert said.err == ""  # no bar where there is no terminal


@pytest.mark.slow
def test_run_without_out_makes_a_folder_of_its_own(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "paper", *QUICK]) == 0
    (folder,) = (tmp_path / "runs").iterdir()
    assert folder.name.startswith("paper-")


def test_list_and_show_print_scenarios(capsys):
    assert main(["list"]) == 0
    assert "paper-limited" in capsys.readouterr().out
    assert main(["show", "paper", "--set", "limit.force=5"]) == 0
    assert "force = 5.0" in capsys.readouterr().out


@pytest.mark.parametrize("arguments", [["--version"], ["--help"], ["run", "--help"]])
def test_help_and_version_exit_with_0(capsys, arguments):
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 0
    assert "cosim" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "papr"], "did you mean 'paper'"),
        (["run", "paper", "--set", "time.duration=long"], "time.duration"),
        (["run", "nowhere.toml"], "nowhere.toml"),
        (["run", "paper", "--set", "plant.parameters.mass=-5"], "mass = -5"),
        (["run", "paper", "--set", "law.gains.k_p1=1e9"], "wrench"),
        (["run", "paper", "--out", "/dev/null/run"], "/dev/null/run"),
        (["run", "paper", "--mavlink", "udpout:192.0.2.1:14550"], "--allow-remote"),
        (["run", "paper", "--mavlink", ""], "tcp:HOST:PORT"),
        (["show", "paper", "--set", "x=1"], "x: unknown key"),
    ],
)
def test_user_errors_are_one_line(tmp_path, capsys, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert said.startswith("cosim: ") and said.count("\n") == 1
    assert words in said
    assert not any(tmp_path.glob("runs/*"))


@pytest.mark.parametrize(
    "arguments",
    [
        ["fly"],
        ["run"],
        ["run", "paper", "--rate", "-1"],
        ["run", "paper", "--rate", "1e-15"],
        ["run", "paper", "--rat"],
    ],
)
def test_invalid_arguments_exit_with_2(capsys, arguments):
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2


def test_command_without_verb_lists_all_verbs(capsys):
    with pytest.raises(SystemExit) as left:
        main([])
    assert left.value.code == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "list the shipped scenarios" in said.err and "cosim run paper" in said.err


def test_missing_compiler_gives_one_line_error(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(tmp_path / "cache"))
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert main(["run", "paper", "--out", str(tmp_path / "run"), *QUICK]) == 2
    assert "no C compiler" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_report_command_regenerates_the_report(tmp_path, capsys):
    out = tmp_path / "run"
    assert main(["run", "paper", "--out", str(out), "--no-report", *QUICK]) == 0
    assert not (out / "report.html").exists()
    assert main(["report", str(out)]) == 0
    assert (out / "report.html").exists()
    assert main(["report", str(tmp_path)]) == 2
    assert "holds no run" in capsys.readouterr().err


def test_help_imports_no_heavy_library():
    code = "import sys, cosim.command_line.cli; print({'numpy', 'numba', 'fmpy', 'matplotlib'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "set()\n"


@pytest.mark.slow
def test_closed_output_pipe_prints_no_error():
    command = f"{sys.executable} -m cosim show paper | true"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=False)
    assert done.stderr == ""


@pytest.mark.slow
def test_verbose_logs_only_own_packages(tmp_path):
    command = [sys.executable, "-m", "cosim", "-v", "run", "paper", "--out", str(tmp_path / "run"), *QUICK]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert all(line.startswith(("cosim", "controller", "plant_fmu")) for line in done.stderr.splitlines())


@pytest.mark.slow
def test_run_works_without_a_writable_cache(tmp_path):
    """Only the run folder is writable: compiled code is not cached, and the FMU is built per process."""
    arguments = ["run", "paper", "--no-report", "--out", str(tmp_path / "run"), *QUICK]
    code = f"""
import sys
import platformdirs
platformdirs.user_cache_dir = lambda *_, **__: "/proc/nowhere"
from cosim.command_line.cli import main
sys.exit(main({arguments!r}))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "building for this process alone" in done.stderr


@pytest.mark.medium
@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="looks into /proc")
@pytest.mark.parametrize("delay", [0.3, *(pytest.param(delay, marks=pytest.mark.slow) for delay in (0.0, 0.8))])
def test_ctrl_c_during_imports_exits_cleanly(tmp_path, delay):
    command = [
        sys.executable,
        "-m",
        "cosim",
        "run",
        "paper",
        "--quiet",  # else it might say that it compiles
        "--set",
        "time.duration=3000",
        "--out",
        str(tmp_path / "run"),
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while "numpy" not in Path(f"/proc/{process.pid}/maps").read_text():  # before that the interpreter itself starts
        time.sleep(0.005)
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=240)
    # where it comes within an exec() of some import, CPython ends by the signal, which is 130 to a shell, too
    assert process.returncode in (130, -signal.SIGINT)
    assert said == "cosim: interrupted\n"


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.slow
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", None)])
def test_ctrl_c_leaves_a_readable_run(tmp_path, sent):
    """The process as a user has it: from the start of stepping to a report, no traceback."""
    out = tmp_path / "run"
    command = [sys.executable, "-m", "cosim", "run", "paper", "--set", "arbiter.engine=closed",
               "--set", "time.duration=3000", "--out", str(out)]  # fmt: skip
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not (any(out.glob("record.parts/*.parquet")) or process.poll() is not None):
        time.sleep(0.02)
    process.send_signal(sent)
    printed, said = process.communicate(timeout=240)
    assert process.returncode == 130
    assert "interrupted" in printed
    assert "Traceback" not in said
    assert (out / "record.parquet").exists() and (out / "report.html").exists()
