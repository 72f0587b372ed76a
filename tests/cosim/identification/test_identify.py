"""The command and what it refuses."""

import pytest

from cosim import import_log
from cosim.command_line.cli import main
from tests.cosim.logs.conftest import LOGS


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A telemetry log of ArduSub at the surface, with servo outputs at 2 Hz."""
    out = tmp_path_factory.mktemp("runs") / "small"
    return import_log(LOGS / "small.tlog", "bluerov2_heavy", out, report=False).folder


@pytest.mark.medium
def test_slow_servo_data_are_named_where_no_window_is_left(run, tmp_path, capsys):
    assert main(["identify", str(run), "--vehicle", "bluerov2_heavy", "--out", str(tmp_path / "a.toml")]) == 2
    said = capsys.readouterr().err
    assert "the hull is at the surface" in said and "Servo outputs of small are logged at 2 Hz" in said
    assert "not added mass, lag or delays" in said
    assert not (tmp_path / "a.toml").exists()


def test_unknown_nuisance_is_rejected_by_name(run, tmp_path, capsys):
    arguments = ["--vehicle", "bluerov2_heavy", "--nuisance", "wind", "--out", str(tmp_path / "a.toml")]
    assert main(["identify", str(run), *arguments]) == 2
    assert "--nuisance wind: is unknown" in capsys.readouterr().err
