"""The vehicle on the link with a simulated run, step by step."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.autopilot import Autopilot
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.master import Master
from tests.cosim.mavlink.station import ACCEPTED, Station, Wire, set_parameter
from tests.cosim.mavlink.test_mission import upload
from tests.cosim.mavlink.test_parameters import LIST
from tests.cosim.mavlink.test_targets import local, obstacle, sticks, velocity


class Flight(Station):
    """A station, and a run whose every row the autopilot gets."""

    def __init__(self, master):
        self.master, self.k = master, 0
        self.commands, self.wire, self.now = CommandQueue(), Wire(), 0.0
        options = MavlinkOptions(profile="ardusub", commands=True)
        self.context = VehicleContext(master.scenario, master.signals.columns, options, self.commands)
        self.profile, self.autopilot = self.context.profile, Autopilot(self.context)
        self.autopilot.attach(self.wire)

    def fly(self, seconds):
        for _ in range(round(seconds / self.master.scenario.time.step)):
            self.master.step(self.k, self.commands)
            self.k += 1
            self.now += self.master.scenario.time.step
            self.autopilot.observe(self.master.signals.row.copy())
            self.autopilot.tick(self.now)

    def last(self, name):
        return self.wire.of(name)[-1]

    def settings_agree(self):
        shown, flown = self.context.settings, self.master.command_handler.settings
        return [(s.key, s.value) for s in flown] == [(s.key, s.value) for s in shown]


@pytest.fixture
def flight():
    overrides = ["commands.enabled=true", "commands.obstacles=2", "time.duration=60.0"]
    with Master(load_scenario("paper-deployable", overrides)) as master:
        yield Flight(master)


def test_commands_take_effect_in_the_run(flight):
    """Arming, a parameter, an obstacle, a position and the sticks, one after the other in one run."""
    master = flight.master
    flight.fly(0.1)
    flight.command(400, 0.0)
    flight.fly(0.5)
    assert not flight.last("HEARTBEAT").base_mode & 128 and not master.signals.view("thrust[1]", 8).any()
    flight.command(400, 1.0)
    for name, value in (("LAW_SPEED", 0.7), ("SR1_RADIUS", 0.4), ("THR_MAX_1", 20.0), ("GOAL_RADIUS", 0.8)):
        flight.send(set_parameter(name, value))
    flight.send(obstacle(place=(4.0, 0.0, 3.0)))
    flight.send(local(place=(1.5, 0.5, 1.0)))
    flight.fly(0.1)
    assert [text for text in flight.wire.texts if text.endswith("rmed")] == ["Disarmed", "Armed"]
    assert flight.last("HEARTBEAT").base_mode & 128
    settings = master.command_handler.settings
    assert (master.law.gains.speed, settings.shapes["SR1"].radius) == (0.7, 0.4)
    assert settings["plant.parameters.thrust_max[1]"] == 20.0 and master.environment.target.tolist() == [1.5, 0.5, 1.0]
    assert flight.settings_agree()
    view = flight.context.view
    assert view.clearances[4] == pytest.approx(np.linalg.norm(np.array(view.position_ned) - [4.0, 0.0, 3.0]) - 0.5)
    flight.fly(15.0)
    assert "Target reached" in flight.wire.texts
    here = flight.last("LOCAL_POSITION_NED")
    assert np.linalg.norm([here.x - 1.5, here.y - 0.5, here.z - 1.0]) < 0.81
    flight.command(176, 1, 19)
    for _ in range(2):
        flight.send(sticks(x=1000))
        flight.fly(0.8)
    assert flight.last("HEARTBEAT").custom_mode == 19 and flight.last("LOCAL_POSITION_NED").vx > 0.05


@pytest.mark.medium
def test_velocity_setpoint_is_tracked_and_expires(flight):
    """MAVSDK's set_velocity_ned, streamed at 10 Hz."""
    flight.fly(0.1)
    x, places = flight.master.signals.view("position.x", 3), []
    for _ in range(60):
        places.append(x.copy())
        flight.send(velocity((0.0, 0.2, 0.0)))
        flight.fly(0.1)
    assert (x - places[30])[1] / 3.0 == pytest.approx(0.2, rel=0.2)
    flight.fly(6.0)
    rest = x.copy()
    flight.fly(1.0)
    assert np.abs(x - rest).max() < 0.05


@pytest.mark.medium
def test_uploaded_mission_is_completed(flight):
    flight.fly(0.1)
    places = [(6000, 0, 1.0), (12_000, 4000, 1.2)]
    assert upload(flight, *({"numbers": (0.5, 0.3, 0, 0), "place": place} for place in places)) == 0
    assert flight.command(300, 0.0) == ACCEPTED
    flight.fly(25.0)
    assert [m.seq for m in flight.wire.of("MISSION_ITEM_REACHED")] == [1, 2]
    assert flight.last("MISSION_CURRENT").mission_state == mavlink.MISSION_STATE_COMPLETE
    assert flight.last("HEARTBEAT").custom_mode == 3


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("value", [0.0, 1e-30, 1e9, -1e9])
def test_no_parameter_change_aborts_the_run(flight, value):
    flight.send(LIST)
    flight.wait(0.1)
    values = {message.param_id: message.param_value for message in flight.wire.of("PARAM_VALUE")}
    for name, before in values.items():
        flight.command(176, 1, 16)
        flight.send(set_parameter(name, value))
        flight.send(obstacle(place=(4.0, 5.0, 6.0)))
        flight.fly(0.02)
        flight.send(set_parameter(name, before))
        flight.wire.clear()
    flight.fly(0.02)
    assert flight.settings_agree()
