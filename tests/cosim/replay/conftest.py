"""Runs to be seen again, their pages, and a browser."""

import importlib.util
import json
import shutil

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cosim.replay.page import write_page
from cosim.replay.pages import replay
from cosim.replay.trace import trace_of
from cosim.results.run_result import load_run
from cosim.simulation.commands import commands as cmd
from tests.cosim.records import filled, steered_run
from tests.cosim.replay.browser import CHROMEDRIVER, CHROMIUM, Browser
from tests.cosim.replay.decoding import read_page

CLOSED = "arbiter.engine=closed"
GAPS = ("position.x", "quaternion.e0", "heading.clearance", "membership.obstacle", "weight.shape", "command.X")
RADIUS = "regions.pile 1.shape.radius"
ITEMS = (
    cmd.MissionItem((2.0, 0.0, 2.0), 50.0),
    cmd.MissionItem(None, commands=(cmd.ChangeSetting(RADIUS, 0.5), cmd.ChangeSetting("regions.ship.gain", 55.0))),
    cmd.MissionItem(None, commands=(cmd.ChangeSetting("goal.radius", 0.9),)),
    cmd.MissionItem((3.0, -1.0, 2.0), stay=None, commands=(cmd.ChangeSetting("regions.quay.shape.point.1", 6.0),)),
)
COMMANDS_LOG = {
    20: [
        cmd.ChangeSetting("goal.radius", 0.75),
        cmd.ChangeSetting("goal.radius", -1.0),
        cmd.ChangeSetting("law.gains.speed", 0.3),
    ],
    40: [cmd.SetTarget((4.0, -1.0, 2.0), 0.6)],
    60: [cmd.AddObstacle(7, (5.0, 0.0, 2.0), 0.4), cmd.AddObstacle(9, (-3.0, 0.0, 2.0), 0.3)],
    90: [cmd.ChangeSetting("regions.ship.shape.semi_axes.0", 3.5)],
    120: [cmd.AddObstacle(7, (5.0, 0.2, 2.0), 0.4, (0.1, 0.0, 0.0))],
    140: [cmd.AddObstacle(7, (5.0, 0.3, 2.0), 0.8)],
    160: [cmd.RemoveObstacle(7)],
    180: [cmd.SetTarget((4.0, 0.0, 2.0)), cmd.ChangeSetting("goal.center.0", 12.5)],
    200: [cmd.SetMission(ITEMS), cmd.SetMode("mission")],
    260: [cmd.ChangeSetting(RADIUS, 0.7), cmd.SetCurrentItem(1)],
}


@pytest.fixture(scope="session")
def docking(shipped_run):
    return load_run(shipped_run("docking", CLOSED).folder)


@pytest.fixture(scope="session")
def paper(shipped_run):
    return load_run(shipped_run("paper", CLOSED).folder)


@pytest.fixture(scope="session")
def steered(tmp_path_factory):
    return steered_run(tmp_path_factory.mktemp("steered"), ["time.duration=4"], COMMANDS_LOG)


@pytest.fixture(scope="session")
def copy_of(tmp_path_factory):
    """Return a function that copies a run folder to a place of its own."""

    def copy(run, name="run"):
        folder = tmp_path_factory.mktemp("copies") / name
        shutil.copytree(run.folder, folder)
        return folder

    return copy


class Shown:
    """A run, the file of its page, and what an independent reader finds in it."""

    def __init__(self, run, file):
        self.run, self.file = run, file
        _, ((self.header, self.columns),) = read_page(file.read_text())
        at = {t: k for k, t in enumerate(run.record["time"].tolist())}
        self.steps = [at[t] for t in self.columns["time"]]  # of the record, by row of the page

    def recorded(self, name):
        """Return a signal of the record at the rows of the page."""
        return self.run.record[name][self.steps].tolist()


@pytest.fixture(scope="session")
def shown(tmp_path_factory):
    """Return a function that writes the page of a run, once."""
    pages = {}

    def page_of(run):
        if run.folder not in pages:
            file = tmp_path_factory.mktemp("pages") / "replay.html"
            pages[run.folder] = Shown(run, write_page(file, [trace_of(run).as_json()], run.scenario.title))
        return pages[run.folder]

    return page_of


@pytest.fixture(scope="session")
def both(docking, paper, tmp_path_factory):
    """Return the page of two runs."""
    return replay([docking.folder, paper.folder], tmp_path_factory.mktemp("both") / "replay.html")


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """Return the one browser of the session."""
    if not (CHROMIUM and CHROMEDRIVER and importlib.util.find_spec("selenium")):
        pytest.skip("no browser: chromium, chromedriver and selenium are needed (apt install chromium chromium-driver)")
    chromium = Browser(tmp_path_factory.mktemp("profile"))
    yield chromium
    chromium.close()


@pytest.fixture(scope="session")
def spoil():
    """Return a function that makes a run folder one of a run that was not whole."""

    def spoil_folder(folder, kind):
        table = pq.read_table(folder / "record.parquet")
        if kind in ("killed", "one row"):
            (folder / "summary.json").unlink()
            with pa.ipc.new_stream(folder / "record.arrows", table.schema) as stream:
                stream.write_table(table.slice(0, 1 if kind == "one row" else 900))
            (folder / "record.parquet").unlink()
        elif kind == "interrupted":
            summary = json.loads((folder / "summary.json").read_text())
            (folder / "summary.json").write_text(json.dumps(summary | {"status": "interrupted"}))
            pq.write_table(table.slice(0, 900), folder / "record.parquet")
        else:
            pq.write_table(filled(table, GAPS, slice(300, 420)), folder / "record.parquet")
        return folder

    return spoil_folder
