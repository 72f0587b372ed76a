"""D6: records that lack a used column are rejected in one line that names it."""

import re
import shutil

import pyarrow.parquet as pq
import pytest

from cosim.errors import RunError
from cosim.export import export_run
from cosim.live.watching import snapshots
from cosim.mavlink.stream_record import stream_record
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.replay.pages import replay
from cosim.results.record import RECORD
from cosim.results.required_columns import require_columns
from cosim.run.run_folder import report_again
from cosim.scenario.scenario import load_scenario
from cosim.scenario.toml_file import list_scenarios
from cosim.simulation.columns import column_names
from cosim.simulation.master import Master

KINDS = {
    "commanded": ["commands.enabled=true", "commands.obstacles=2"],
    "sensed, with V": ["sensing.position_noise=0.01", "record.lyapunov=true"],
    "thrusters": ["law.name=deployable", "actuation.through=thrusters"],
}
# columns that readers only show: reports of the law, however many it has, sensed states, water, and region functions
OPTIONAL = re.compile(r"(law|sensed|water_velocity)\..*|.*\.value")


def kind_of(overrides):
    return load_scenario("paper", ["time.duration=0.03", *overrides])


READERS = {
    "report": report_again,
    "replay": lambda folder: replay([folder]),
    "watch": lambda folder: list(snapshots(str(folder), None)),
    "export csv": lambda folder: export_run(folder, "csv", folder / "it.csv"),
    "export mcap": lambda folder: export_run(folder, "mcap", folder / "it.mcap"),
    "export tlog": lambda folder: export_run(folder, "tlog", folder / "it.tlog"),
    "stream": lambda folder: stream_record(
        folder, [parse_endpoint(str(folder / "own.tlog"))], MavlinkOptions(), None
    ),
}  # fmt: skip


def error_of(act, *arguments):
    """Return the message of the RunError that a call raises, "" if none."""
    try:
        act(*arguments)
    except RunError as error:
        return str(error)
    return ""


class Table:
    """What `require_columns` asks of a record."""

    file = "runs/it/record.parquet"

    def __init__(self, names):
        self.units = dict.fromkeys(names, "")


@pytest.fixture(scope="module", params=KINDS.values(), ids=KINDS)
def kind(request):
    scenario = kind_of(request.param)
    return scenario, column_names(scenario)


@pytest.mark.medium
def test_d6_each_missing_column_is_named(kind, monkeypatch, caplog):
    scenario, names = kind
    monkeypatch.setattr("cosim.simulation.columns.column_names", lambda _: names)
    for name in names:
        caplog.clear()
        error = error_of(require_columns, scenario, Table([other for other in names if other != name]))
        if OPTIONAL.fullmatch(name):
            (warning,) = caplog.messages
            assert not error and f"has no column {name!r}" in warning and Table.file in warning
        else:
            assert error == f"{Table.file}: has no column {name!r}, which its scenario calls for"
    require_columns(scenario, Table(names))
    require_columns(scenario, Table([*names, "of another"]))


@pytest.mark.medium(fast=1)
def test_d6_the_names_are_those_of_the_run(kind):
    scenario, names = kind
    with Master(scenario) as master:
        assert names == [column.name for column in master.signals.columns]


@pytest.mark.slow
@pytest.mark.parametrize("name", list_scenarios())
def test_d6_the_names_are_those_of_every_shipped_scenario(name):
    scenario = load_scenario(name)
    with Master(scenario) as master:
        assert column_names(scenario) == [column.name for column in master.signals.columns]


@pytest.mark.parametrize(
    "swapped", [("position.x", "position.y"), ("time", "position.x"), ("commands.mode", "target.z")]
)
def test_d6_columns_in_another_order_are_rejected(ordered_run, swapped):
    """What is read side by side would be another quantity."""
    scenario = load_scenario(ordered_run / "scenario.toml")
    other = dict(zip(swapped, reversed(swapped), strict=True))
    names = [other.get(name, name) for name in column_names(scenario)]
    with pytest.raises(RunError, match="stands elsewhere"):
        require_columns(scenario, Table(names))
    with pytest.raises(RunError, match="stands elsewhere"):
        require_columns(scenario, Table(["of another", *column_names(scenario)]))


@pytest.fixture
def lacking(tmp_path, ordered_run):
    """Return a function that makes a run without some columns."""

    def made(*names):
        folder = tmp_path / "run"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(ordered_run, folder)
        pq.write_table(pq.read_table(ordered_run / RECORD).drop_columns(list(names)), folder / RECORD)
        return folder

    return made


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
def test_d6_every_reader_names_the_column_and_the_file(read, lacking):
    names = (
        "target.x", "commands.mode", "thruster_force[1]", "attitude.yaw", "membership.depth", "seen 2.shift.y",
        "time",
    )  # fmt: skip
    for name in names:
        folder = lacking(name)
        before = sorted(folder.iterdir())
        with pytest.raises(RunError) as caught:
            read(folder)
        assert str(caught.value) == f"{folder / RECORD}: has no column {name!r}, which its scenario calls for"
        assert sorted(folder.iterdir()) == before


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
def test_d6_readers_work_without_unused_columns(read, lacking, caplog):
    folder = lacking("water_velocity.y", "goal.value")
    read(folder)
    assert "has no columns 'water_velocity.y', 'goal.value'" in caplog.text and str(folder / RECORD) in caplog.text
