"""The image's steps, run as commands in a folder of their own, and cosim as the image runs it; no Docker is needed."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.packaging.conftest import ROOT, run

STEPS = [line.partition(" ")[::2] for line in (ROOT / "Dockerfile").read_text().splitlines() if line.strip()]


def copied(tracked, folder):
    """Copy what `COPY . /src` copies: the tracked files that .dockerignore lets through."""
    kept = re.findall(r"^!(\S+)", (ROOT / ".dockerignore").read_text(), re.MULTILINE)
    for name in tracked:
        if name.split("/")[0] in kept:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)


@pytest.fixture(scope="session")
def image(tracked, once):
    """Return the folder in which the RUN steps were run, with `opt` and `src`, as the image has them at its root."""

    def build(folder):
        copied(tracked, folder / "src")
        env = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        for instruction, words in STEPS:
            if instruction == "RUN":
                run("sh", "-ec", inside(words, folder).replace("python3 ", f"{shlex.quote(sys.executable)} "), env=env)

    return once("image", build)


def inside(words, folder):
    """Replace the image's folders by those below `folder`."""
    return re.sub(r"(?<![\w.])/(?=(?:src|opt)\b)", f"{folder}/", words)


def test_image_names_no_registry_and_runs_as_no_root():
    names = [name for name, _ in STEPS]
    assert names.count("FROM") == 2 and "USER" in names and names[-2:] == ["ENTRYPOINT", "CMD"]
    assert not re.search(r"https?:|index|\w\.(?:io|com|org)\b", "\n".join(words for _, words in STEPS))
    assert all(words.split()[0] == "python:3.12-slim" for name, words in STEPS if name == "FROM")


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_cosim_runs_from_the_steps_of_the_image(image, tmp_path):
    """As another user, without a compiler: with the environment, folder and entry that the image states."""
    ((_, entry),) = [step for step in STEPS if step[0] == "ENTRYPOINT"]
    settings = dict(pair.split("=") for name, words in STEPS if name == "ENV" for pair in words.split())
    path = inside(settings["PATH"], image).split(":")[0]
    env = settings | {"PATH": path, "HOME": str(tmp_path)}
    folder = Path(inside("/opt/runs", image))
    assert folder.stat().st_mode & 0o7777 == 0o1777
    program = shutil.which(entry.strip('[]"'), path=path)
    assert program is not None and shutil.which("cc", path=path) is None

    def cosim(*words):
        return run(program, *words, cwd=folder, env=env)

    assert "companion" in cosim("--help")
    cosim("run", "docking", "--set", "time.duration=0.5", "--out", "run")
    cosim("export", "run", "--to", "rosbag2")
    done = subprocess.run(
        [program, "companion", "udpout:127.0.0.1:9", "--scenario", "docking", "--surveyed-origin=0,0,0", "--timeout=1"],
        cwd=folder, env=env, capture_output=True, text=True,
    )  # fmt: skip
    assert "waiting for a heartbeat of an autopilot" in done.stderr and "Traceback" not in done.stderr
