"""Flights of pages by their own scripts, in Node."""

import importlib.util
import json
import shutil
import subprocess
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from cosim.replay.interactive.data import flight_data
from cosim.replay.trace import trace_of

NODE = shutil.which("node")
_FLY = Path(__file__).parent / "fly.mjs"


class Flown:
    """What a page's scripts make of a flight."""

    def __init__(self, said, numbers):
        self.said, self.verdict, self.toml = said, said["verdict"], said["toml"]
        columns = numbers.reshape(len(said["signals"]), said["rows"])
        self.columns = dict(zip(said["signals"], columns, strict=True))


@pytest.fixture(scope="session")
def builds():
    """Skip where no WebAssembly can be made, or nothing runs it."""
    if not importlib.util.find_spec("ziglang"):
        pytest.skip("the build extra is not installed")
    if not NODE:
        pytest.skip("node is not installed")


@pytest.fixture(scope="session")
def fly(builds, tmp_path_factory):
    """Return a function that flies the page of a run, with other numbers and one more failure of a thruster."""
    known = {}

    def fly_page(run, values=None, failure=None):
        if run.folder not in known:
            known[run.folder] = flight_data(run), trace_of(run).header
        data, header = known[run.folder]
        folder = tmp_path_factory.mktemp("flown")
        job = {"data": data, "header": header, "values": values or {}, "failure": failure}
        (folder / "job.json").write_text(json.dumps(job))
        assets = resources.files("cosim.replay") / "assets"
        subprocess.run([NODE, _FLY, str(assets), folder / "job.json", folder / "out"], check=True, timeout=600)
        said = json.loads((folder / "out.json").read_text())
        return said["refused"] if "refused" in said else Flown(said, np.fromfile(folder / "out.bin"))

    return fly_page
