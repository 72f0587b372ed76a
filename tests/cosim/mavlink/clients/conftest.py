"""Real clients in cached environments of their own, and the vehicle that they connect to."""

from __future__ import annotations

import contextlib
import fcntl
import json
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

INSTALLING = 420.0  # s, for pip or npm
ENDING = 60.0  # s, for a run to write what it has
INTERRUPTED = 130
REQUIREMENTS = ("MAVProxy>=1.8.75", "pymavlink>=2.4.49", "setuptools<81", "future", "fastcrc", "matplotlib")
HERE = Path(__file__).parent


@pytest.fixture(scope="session")
def make_once(request):
    """Return a function that makes a folder by commands, in one process alone, or skips."""

    def make_once(name, *commands):
        folder = request.config.cache.mkdir("mavlink-clients") / name
        with folder.with_suffix(".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not (folder / "made").exists():
                shutil.rmtree(folder, ignore_errors=True)
                folder.mkdir()
                for command in commands:
                    _install([part.format(folder=folder) for part in command], folder)
                (folder / "made").touch()
        return folder

    return make_once


def _install(command, folder):
    try:
        subprocess.run(command, check=True, capture_output=True, text=True, timeout=INSTALLING, cwd=folder)
    except subprocess.TimeoutExpired:
        pytest.skip(f"{command[0]}: took more than {INSTALLING:g} s")
    except subprocess.CalledProcessError as error:
        last = (error.stderr.strip().splitlines() or ["no word of why"])[-1]
        pytest.skip(f"cannot be installed: {last}")


@pytest.fixture(scope="session")
def environment(make_once):
    """Return a function that gives the Python of a virtual environment with some packages, or skips."""

    def make(name, *requirements):
        python = ("{folder}/bin/python", "install", "-q", "--no-compile", *requirements)
        venv, pip = (sys.executable, "-m", "venv", "--without-pip", "."), (sys.executable, "-m", "pip", "--python")
        return make_once(name, venv, (*pip, *python)) / "bin" / "python"

    return make


@pytest.fixture(scope="session")
def ardupilots_tools(environment):
    """Return the Python of an environment with MAVProxy and pymavlink's own tools."""
    return environment("ardupilot-tools", *REQUIREMENTS)


@pytest.fixture(scope="session")
def node_mavlink(make_once):
    """Return a folder in which node finds node-mavlink, or skip."""
    if not (shutil.which("node") and shutil.which("npm")):
        pytest.skip("node or npm is not here")
    init, install = ("npm", "init", "-y"), ("npm", "install", "--no-audit", "--no-fund", "node-mavlink@2")
    return make_once("node", init, install)


@contextlib.contextmanager
def cosim_run(folder, profile, *endpoints):
    """Run the command as a user does, until the context ends by Ctrl-C; it is armed and accepts commands."""
    links = [word for endpoint in endpoints for word in ("--mavlink", endpoint)]
    process = subprocess.Popen(
        [sys.executable, "-m", "cosim", "run", "paper-limited", "--set", "time.duration=3600", "--commands",
         "--profile", profile, "--rate", "1", "--no-report", "--out", str(folder), *links],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=ENDING)
    assert process.returncode == INTERRUPTED, output
    assert "Traceback" not in output and "times" not in output, output


def commands_of(folder):
    """Return the names of the commands that a run took, in their order."""
    return [json.loads(line)["command"]["command"] for line in (folder / "commands.jsonl").read_text().splitlines()]
