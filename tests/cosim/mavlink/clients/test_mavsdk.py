"""The current and the previous generation of MAVSDK connected to a running vehicle."""

import json
import subprocess

import pytest

from cosim.mavlink.wire.options import MavlinkOptions
from tests.cosim.mavlink.clients.conftest import HERE, commands_of, cosim_run
from tests.cosim.mavlink.stubs import free_port

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]  # the first of them builds and installs

RUNNING = 240.0  # s, for all steps together
REQUIREMENTS = {"mavsdk-4": "mavsdk>=4,<5", "mavsdk-3": "mavsdk<4"}


@pytest.fixture(scope="module", params=REQUIREMENTS)
def generation(request):
    return request.param


@pytest.fixture(scope="module", params=["px4", "generic"])
def flown(request, generation, environment, tmp_path_factory):
    """Return the value of each step, or its error, and under `commands` what the run was commanded."""
    python, port = environment(generation, REQUIREMENTS[generation]), free_port()
    folder = tmp_path_factory.mktemp("flown") / "run"
    with cosim_run(folder, request.param, f"udpout:127.0.0.1:{port}"):
        done = subprocess.run(
            [python, "-W", "ignore", HERE / "mavsdk_client.py", f"udpin://127.0.0.1:{port}"],
            capture_output=True, text=True, timeout=RUNNING,
        )  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    assert lines, done.stderr[-2000:]
    return json.loads(lines[-1]) | {"commands": commands_of(folder)}


def test_every_mavsdk_step_completes(flown):
    assert {name: value for name, value in flown.items() if isinstance(value, dict) and "error" in value} == {}
    assert flown["health"] is True


def test_position_and_attitude_are_those_of_the_run(flown):
    latitude, longitude, relative, absolute = flown["position"]
    assert (latitude, longitude) == pytest.approx(MavlinkOptions().origin, abs=1e-3)
    assert relative == pytest.approx(-flown["ned"][2], abs=0.5) and absolute == pytest.approx(relative, abs=0.1)
    assert all(abs(angle) <= 180.0 for angle in flown["attitude"])


def test_parameters_are_read_changed_and_refused(flown):
    assert len(flown["params"]) > 10
    name, before, after, again = flown["change_param"]
    assert flown["params"][name] == pytest.approx(before) == pytest.approx(again)
    assert after == pytest.approx(1.25 * before, rel=1e-5)
    word, before, after = flown["refused_param"]
    assert word != "taken" and after == pytest.approx(before)
    assert "DOES_NOT_EXIST" in flown["unknown_param"]  # without an answer it would be a TIMEOUT


def test_goto_location_moves_the_vehicle(flown):
    before, after, target = flown["go_to"]
    assert abs(after - target) < abs(before - target)


def test_mission_is_uploaded_read_back_and_started(flown):
    items, back, mode = flown["mission"]
    assert len(back) == 3 and mode == "MISSION"
    for sent, came in zip(items, back, strict=True):
        assert came[:3] == sent[:3] and came[3] == pytest.approx(sent[3], abs=1e-3)


def test_modes_commands_and_clock_are_those_of_the_run(flown):
    assert (flown["hold"], flown["offboard"]) == ("HOLD", "OFFBOARD")
    assert {"arm", "set_mode", "set_target", "change_setting", "set_mission"} <= set(flown["commands"])
    assert flown["speed"] == pytest.approx(1.0, abs=0.1)
