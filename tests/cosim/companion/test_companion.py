"""The companion flies our own vehicle through its autopilot, whose clock is the run's; nothing here waits."""

import gc
import math
import re
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink
from scipy.spatial.transform import Rotation

from controller.laws.deployable.gains import SPREADS
from cosim.companion.companion_options import CompanionOptions
from cosim.companion.companion_run import Companion, scenario_to_steer
from cosim.companion.frame_alignment import SceneOrigin
from cosim.companion.safety import CONDITIONS, STATES
from cosim.errors import RunError
from cosim.live.address import parse_live
from cosim.live.live_view import LiveView
from cosim.mavlink.wire.options import ORIGIN
from cosim.mavlink.wire.thrust_body import get_thrust_body
from cosim.results.run_result import load_run
from cosim.results.wording import verdict
from cosim.run.run_folder import report_again
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands.commands import Arm
from cosim.simulation.environment import RegionEnvironment
from tests.architecture.modules import ROOT
from tests.cosim.companion.stand_in import IDENTITY, StandIn
from tests.cosim.live.conftest import Viewer

SHIFT = (0.9, -1.6, 1.9)  # m: what a real ArduSub's origin was off by
GLOBE = SceneOrigin(geodetic=ORIGIN)
UNSEEN = 0.05  # m: what a real ArduSub's position was off by
EVENT = 3.0  # s of the stand-in's time, while it is steered
STICKS = ("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE", "SET_POSITION_TARGET_LOCAL_NED", "SET_ATTITUDE_TARGET")


@pytest.fixture
def link():
    """A vehicle of profile `generic` whose own frame is off."""
    return StandIn(profile="generic", shift=SHIFT)


class Flight:
    """A flight, its states with their times, and its record."""

    def __init__(self, tmp_path, seconds=6.0, events=(), link=None, live=None, **options):
        self.link = link or StandIn(profile="generic", shift=SHIFT)
        self.link.events += [(EVENT, event) for event in events]
        options = {"profile": "generic", "origin": GLOBE, "timeout": 10.0, **options}
        scenario = load_scenario("pipe-inspection", [f"time.duration={seconds}"])
        self.companion = Companion(scenario, self.link, CompanionOptions(**options))
        self.states = []
        self.run = self.companion.run(tmp_path / "run", report=False, on_state=self._note, live=live)
        self.status = self.run.summary["status"]

    def _note(self, state, missing):
        if not self.states or self.states[-1][1] != state:
            self.states.append((self.link.clock() - 100.0, state))

    def time_of(self, state):
        return next(time for time, name in self.states if name == state)

    def sent_after(self, time, *kinds):
        return [m for at, m in self.link.sent if at - 100.0 > time and m.get_type() in kinds]

    def target(self):
        """Return the middle of the goal region at the end: it travels [m, NED]."""
        table = self.run.table()
        return np.array([table[f"target.{axis}"].to_numpy()[-1] for axis in "xyz"])

    def held(self, reason):
        """Check that it is held for that reason, within a second, with the sticks released."""
        since = self.time_of("held")
        assert self.status == f"held: {reason}"
        assert EVENT < since <= EVENT + 1.0
        self._released(since)
        return since

    def _released(self, since):
        column = dict(zip(("state", "x", "y", "z"), self.run.table().select(
            ["companion.state", "stick.X", "stick.Y", "stick.Z"]).to_pandas().to_numpy().T, strict=True))  # fmt: skip
        assert column["state"][-1] == STATES.index(self.states[-1][1])
        idle = column["state"] == STATES.index(self.states[-1][1])
        assert idle.sum() > 50 and not any(column[name][idle][1:].any() for name in "xyz")
        for message in self.sent_after(since, "MANUAL_CONTROL"):
            assert (message.x, message.y, message.z, message.r) == (0, 0, 0, 0)


BRIEF = {"RC_OVERRIDE_TIME": 0.5, "FS_PILOT_TIMEOUT": 0.5}  # s, for which the last sticks act: wrench needs it

OUTPUTS = [  # profile, steered by, sticks by, and what carries it
    ("generic", "sticks", "manual-control", {"MANUAL_CONTROL"}),
    ("generic", "wrench", "manual-control", {"MANUAL_CONTROL"}),
    ("generic", "velocity", "manual-control", {"SET_POSITION_TARGET_LOCAL_NED"}),
    ("generic", "attitude", "manual-control", {"SET_ATTITUDE_TARGET"}),
    ("px4", "attitude", "manual-control", {"SET_ATTITUDE_TARGET"}),
    ("ardusub", "sticks", "rc-override", {"RC_CHANNELS_OVERRIDE"}),
    ("ardusub", "wrench", "rc-override", {"RC_CHANNELS_OVERRIDE"}),
    ("ardusub", "attitude", "manual-control", {"SET_ATTITUDE_TARGET", "MANUAL_CONTROL"}),
    ("ardusub", "attitude", "rc-override", {"SET_ATTITUDE_TARGET", "RC_CHANNELS_OVERRIDE"}),
]


@pytest.mark.medium
@pytest.mark.parametrize(
    ("profile", "steer_by", "sticks_by", "carried_by"),
    [OUTPUTS[0], *(pytest.param(*output, marks=pytest.mark.slow) for output in OUTPUTS[1:])],
)
def test_goal_is_reached_and_regions_satisfied_by_the_true_state(tmp_path, profile, steer_by, sticks_by, carried_by):
    link = StandIn(profile=profile, shift=SHIFT)
    link.events = [(0.5, lambda: answer(**BRIEF)(link))]
    flight = Flight(tmp_path, 30.0, link=link, profile=profile, steer_by=steer_by, sticks_by=sticks_by)
    assert {m.get_type() for _, m in flight.link.sent} & set(STICKS) == carried_by
    goal = flight.companion.scenario.goal
    assert flight.status == "completed" and [s for _, s in flight.states][-1] == "steering"
    true = np.array([link.now(f"position.{axis}") for axis in "xyz"])
    assert np.linalg.norm(true - flight.target()) < goal.radius
    for region in ("pipe", "sea bed"):
        assert link.column(f"{region}.clearance").min() > 0.0
    session = flight.companion.session
    assert session.alignment.offset == pytest.approx([-s for s in SHIFT], abs=0.03)
    position = session.alignment.to_scene(session.reported.position)
    assert position == pytest.approx(true, abs=0.03)


@pytest.mark.slow
def test_docking_by_wrench_keeps_walls_and_heading_by_the_true_state(tmp_path):
    """At full pilot gain, where the law asks for all that the thrusters have."""
    link = StandIn("docking", "ardusub", SHIFT, overrides=["commands.pilot_gain=1.0"])
    link.events = [(0.5, lambda: answer(**BRIEF)(link))]
    options = CompanionOptions("ardusub", "wrench", origin=GLOBE, pilot_gain=1.0, timeout=10.0)
    companion, begun = Companion(load_scenario("docking", ["time.duration=40"]), link, options), len(link.rows)
    assert companion.run(tmp_path / "run", report=False).summary["status"] == "completed"
    assert link.now("goal.clearance") > 0.0
    for region in (secondary.region.name for secondary in companion.scenario.regions):
        assert link.column(f"{region}.clearance")[begun:].min() > 0.0


@pytest.mark.medium
def test_surveyed_origin_is_believed_and_a_wrong_one_misses_the_goal(tmp_path):
    surveyed = (0.3, 0.0, -0.4)
    flight = Flight(tmp_path, 20.0, origin=SceneOrigin(surveyed=surveyed))
    true = np.array([flight.link.now(f"position.{axis}") for axis in "xyz"])
    assert flight.companion.session.alignment.offset.tolist() == [*surveyed]
    believed = flight.companion.session.alignment.to_scene(flight.companion.session.reported.position)
    assert believed - true == pytest.approx(np.add(SHIFT, surveyed), abs=0.05)
    assert np.linalg.norm(true - flight.target()) > 1.0


def parameter(name, value):
    return mavlink.MAVLink_param_value_message(name, value, 9, 1, 0)


# what a vehicle is like that is not steered, the companion's options, a message of the autopilot, and the reason
NOT_STEERED = {
    "no origin": ({}, {"origin": SceneOrigin()}, None, "waiting for the scene's origin"),
    "no global position": ({"silent": ["GLOBAL_POSITION_INT"]}, {}, None, "the autopilot has no global position"),
    "another vehicle": ({}, {"vehicle_system": 2}, None, "waiting for a heartbeat of an autopilot of system 2"),
    "not armed, by default": ({"armed": False}, {}, None, "waiting for arming"),
    "held before it is armed": (
        {"armed": False}, {"arm": True},
        mavlink.MAVLink_command_long_message(*IDENTITY, mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0, *[0.0] * 7),
        "waiting for a command to resume"),
    "held before somebody arms it": (
        {"armed": False}, {"timeout": 4.0},
        mavlink.MAVLink_command_long_message(*IDENTITY, mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0, *[0.0] * 7),
        "waiting for a command to resume"),
    "an ArduSub that would ignore sticks": (
        {"profile": "ardusub"}, {"profile": "ardusub"}, parameter(b"SYSID_MYGCS", 250.0),
        r"SYSID_MYGCS is 250, and the companion's system id 255: .*; expected --system-id 250, or"),
    **{f"an ArduSub {version} whose resting vertical stick pushes {push}": (
        {"profile": "ardusub"}, {"profile": "ardusub"}, (parameter(name, 255.0), parameter(b"RC3_TRIM", trim)),
        rf"RC3_TRIM is {trim:g}: a resting vertical stick would push {push}; expected {rest} in this version")
       for version, name, trim, push, rest in (
           ("4.5", b"SYSID_MYGCS", 1500.0, "down", 1100), ("4.7", b"MAV_GCS_SYSID", 1100.0, "up", 1500))},
    "an ArduSub whose last sticks of all axes would act on": (
        {"profile": "ardusub"}, {"profile": "ardusub", "steer_by": "wrench"}, parameter(b"RC_OVERRIDE_TIME", 3.0),
        r"RC_OVERRIDE_TIME is 3; expected 1 s or less; with --steer-by wrench they would turn the vehicle over"),
    "an ArduSub whose last sticks of all axes would act for ever": (
        {"profile": "ardusub"}, {"profile": "ardusub", "steer_by": "wrench"}, parameter(b"FS_PILOT_INPUT", 0.0),
        r"FS_PILOT_INPUT 0 disables FS_PILOT_TIMEOUT; expected 1; with --steer-by wrench"),
    "an ArduSub whose last sticks of all axes may act on": (
        {"profile": "ardusub"}, {"profile": "ardusub", "steer_by": "wrench"}, parameter(b"RC_OVERRIDE_TIME", 0.5),
        r"may outlast a lost link: FS_PILOT_TIMEOUT not answered; with --steer-by wrench"),
    "an ArduSub that would misread sticks": (
        {"profile": "ardusub"}, {"profile": "ardusub"},
        mavlink.MAVLink_named_value_float_message(0, b"PilotGain", 0.25),
        r"the autopilot's pilot gain is 0.25, expected 0.5 of --pilot-gain"),
}  # fmt: skip


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize(("kind", "options", "event", "words"), NOT_STEERED.values(), ids=NOT_STEERED)
def test_no_setpoints_are_sent_to_a_vehicle_that_cannot_be_steered(tmp_path, kind, options, event, words):
    link = StandIn(**{"profile": "generic", "shift": SHIFT} | kind)
    events = () if event is None else event if isinstance(event, tuple) else (event,)
    link.events = [(0.5, lambda: [link.hear(message, 1, 1) for message in events])]
    if "timeout" in options:
        link.events.append((2.0, lambda: link.queue.submit(Arm(True))))
    with pytest.raises(RunError, match=words):
        Flight(tmp_path, link=link, **options)
    assert not link.of_type(*STICKS) and not {176, 400} & {m.command for m in link.of_type("COMMAND_LONG")}
    assert not (tmp_path / "run").exists()


@pytest.mark.medium
def test_the_last_system_of_a_range_may_be_answered_after_the_first(tmp_path):
    link = StandIn(profile="ardusub", shift=SHIFT)
    link.events = [
        (0.5, lambda: answer(MAV_GCS_SYSID=250.0)(link)),
        (1.0, lambda: answer(MAV_GCS_SYSID_HI=255.0)(link)),
    ]
    assert Flight(tmp_path, 1.0, link=link, profile="ardusub").status == "completed"


@pytest.mark.medium
@pytest.mark.parametrize("answers", ["GLOBAL_POSITION_INT", "GPS_GLOBAL_ORIGIN"])
def test_a_global_origin_is_sent_each_second_until_the_autopilot_has_one(tmp_path, answers):
    link = StandIn(profile="generic", shift=SHIFT, silent={"GLOBAL_POSITION_INT", "GPS_GLOBAL_ORIGIN"})
    link.events = [(3.5, lambda: link.silent.discard(answers)), (6.0, link.silent.clear)]
    flight = Flight(tmp_path, 1.0, link=link, global_origin=ORIGIN)
    origins = [(at, m) for at, m in link.sent if m.get_type() == "SET_GPS_GLOBAL_ORIGIN"]
    assert flight.status == "completed" and 3 <= len(origins) <= 6 and min(np.diff([at for at, _ in origins])) > 0.98
    assert {(m.target_system, m.latitude, m.longitude) for _, m in origins} == {(1, 559097000, -33203000)}
    without = StandIn(profile="generic", shift=SHIFT)
    Flight(tmp_path / "without", 0.5, link=without, origin=SceneOrigin(surveyed=(0.0, 0.0, 0.0)))
    having = StandIn(profile="generic", shift=SHIFT)
    Flight(tmp_path / "having", 0.5, link=having, global_origin=ORIGIN)
    assert not without.of_type("SET_GPS_GLOBAL_ORIGIN") + having.of_type("SET_GPS_GLOBAL_ORIGIN")


@pytest.mark.medium
def test_garbage_collection_leaves_out_what_was_there_before_steering(tmp_path):
    link, frozen = StandIn(profile="generic", shift=SHIFT), []
    link.events = [(1.0, lambda: frozen.append(gc.get_freeze_count()))]
    assert Flight(tmp_path, 1.5, link=link).status == "completed"
    assert frozen[0] > 10_000 and gc.get_freeze_count() == 0


@pytest.mark.medium
def test_companion_arms_the_vehicle_if_it_may(tmp_path):
    flight = Flight(tmp_path, 2.0, link=StandIn(profile="generic", armed=False), arm=True)
    assert flight.status == "completed" and flight.link.now("commands.armed") == 1.0


@pytest.mark.medium
def test_an_ardusub_that_was_armed_here_dives_level_before_it_is_steered(tmp_path):
    link = StandIn(profile="ardusub", shift=SHIFT, armed=False)
    flight = Flight(tmp_path, 2.0, link=link, profile="ardusub", arm=True, timeout=40.0)
    names = [state for _, state in flight.states]
    assert names[-3:] == ["diving", "engaging", "steering"] and flight.status == "completed"
    depth = link.column("position.z")
    at = [round((flight.time_of(state)) / link.step) for state in ("diving", "engaging")]
    assert depth[at[1]] - depth[at[0]] == pytest.approx(0.6, abs=0.06)
    assert np.abs(link.column("attitude.pitch")[at[0] : at[1]]).max() < np.radians(3.0)
    assert link.column("sea bed.clearance").min() > 0.3


@pytest.mark.medium
@pytest.mark.parametrize("ends", [pytest.param(False, marks=pytest.mark.medium), True])
def test_dry_run_sends_no_setpoints_and_only_message_requests(tmp_path, link, ends):
    """Nor when something ends it."""
    events = [lambda: link.silent.add("LOCAL_POSITION_NED")] if ends else ()
    flight = Flight(tmp_path, 4.0, dry_run=True, events=events, link=link)
    assert flight.status == ("held: stale estimate" if ends else "dry run")
    assert verdict(flight.run.summary).endswith("It was a dry run: nothing was sent.") == (not ends)
    assert flight.states[-1][1] == ("held" if ends else "dry_run")
    assert not link.of_type(*STICKS) and {m.command for m in link.of_type("COMMAND_LONG")} == {511}
    assert np.abs(flight.run.table()["stick.Y"].to_numpy()).max() > 0.05  # what it would have sent


# ---- what ends steering: each condition of the table ----


def position_off(link, by, speed=math.inf):
    """Let the local position move away by so many meters, at once or at a speed [m/s], and stay there."""
    begun = link.clock()

    def move(message):
        message.x += by if speed == math.inf else min(by, speed * (link.clock() - begun))

    link.tamper["LOCAL_POSITION_NED"] = move


def heading_off(link, degrees):
    turn = Rotation.from_euler("z", degrees, degrees=True)

    def leap(message):
        q = (turn * Rotation.from_quat([message.q2, message.q3, message.q4, message.q1])).as_quat()
        message.q2, message.q3, message.q4, message.q1 = q.tolist()

    link.tamper["ATTITUDE_QUATERNION"] = leap


def changed(link, kind, **fields):
    link.tamper[kind] = lambda message: message.__dict__.update(fields)


def command(link, number, *parameters, system=1, component=1):
    filled = [*parameters, *[0.0] * (7 - len(parameters))]
    link.hear(mavlink.MAVLink_command_long_message(system, component, number, 0, *filled))


FAULTS = {
    "lost link": lambda link: setattr(link, "cut", True),
    "stale estimate": lambda link: link.silent.add("LOCAL_POSITION_NED"),
    "late loop": lambda link: setattr(link, "stall", 0.35),
    "autopilot failsafe": lambda link: changed(link, "HEARTBEAT", system_status=5),
    "frame jump": lambda link: position_off(link, 1.0),
    "heading leap": lambda link: heading_off(link, 8.0),
    "battery": lambda link: changed(link, "SYS_STATUS", battery_remaining=12),
    "leak": lambda link: link.context.send_text("Leak Detected"),
    "pilot gain": lambda link: link.hear(mavlink.MAVLink_named_value_float_message(0, b"PilotGain", 1.0), 1, 1),
    "takeover": lambda link: command(link, 193, 0.0, system=IDENTITY[0], component=IDENTITY[1]),
}


@pytest.mark.medium
@pytest.mark.parametrize("reason", FAULTS)
def test_fault_holds_the_vehicle_within_one_second(tmp_path, reason, link):
    flight = Flight(tmp_path, link=link, events=[lambda: FAULTS[reason](link)], least_battery=20.0)
    flight.held(reason)
    if reason != "lost link":
        assert link.mode() == 1 and link.context.sticks == (0.0,) * 6  # position hold


@pytest.mark.medium
def test_our_last_sticks_are_no_pilots_after_a_stall_of_our_loop(tmp_path):
    """An ArduSub acts on them for 3 s and reports them."""
    link = StandIn(profile="ardusub", shift=SHIFT)
    link.events = [(6.0, lambda: setattr(link, "stall", 2.0))]  # its parameters are awaited for 3 s
    assert Flight(tmp_path, 4.0, link=link, profile="ardusub").status in ("held: late loop", "held: frame jump")


@pytest.mark.medium
@pytest.mark.parametrize(("delay", "main"), [(0.5, 1.0), (1.5, 1.0), (1.5, 7.0)])  # 7: the mode that we steer in
def test_a_pilot_takes_over_by_mode_from_a_held_vehicle(tmp_path, link, delay, main):
    link.events = [(EVENT, lambda: FAULTS["takeover"](link)), (EVENT + delay, lambda: command(link, 176, 1.0, main))]
    flight = Flight(tmp_path, link=link)
    assert flight.status == "held: takeover" and flight.companion.session.reported.mode == int(main) << 16
    assert not flight.sent_after(EVENT + delay, *STICKS)
    assert not [m for m in flight.sent_after(EVENT + delay, "COMMAND_LONG") if m.command == 176]


@pytest.mark.medium
def test_rejected_mode_holds_within_one_second(tmp_path, link):
    link.refused_commands.add(176)
    with pytest.raises(RunError, match="a command to resume after: refused mode"):
        Flight(tmp_path, link=link)
    first = min(at for at, m in link.sent if m.get_type() == "COMMAND_LONG" and m.command == 176)
    texts = [(at, m.text) for at, m in link.sent if m.get_type() == "STATUSTEXT"]
    (held,) = [at for at, text in texts if text == "Companion held: refused mode"]
    assert held - first <= 1.0


@pytest.mark.medium
def test_a_dive_that_does_not_end_holds_the_vehicle(tmp_path):
    link = StandIn(profile="ardusub", shift=SHIFT, armed=False, overrides=["commands.pilot_gain=0.01"])
    with pytest.raises(RunError, match="a command to resume after: unfinished dive"):
        Flight(tmp_path, link=link, profile="ardusub", arm=True, timeout=40.0)


@pytest.mark.medium
@pytest.mark.parametrize(("reason", "event"), [("mode taken", 19.0), ("disarmed", None)])
def test_a_pilot_takes_over_while_it_dives(tmp_path, reason, event):
    link, dived = StandIn(profile="ardusub", shift=SHIFT, armed=False), 6.0
    link.events = [(dived, lambda: command(link, 400, 0.0) if event is None else command(link, 176, 1.0, event))]
    with pytest.raises(RunError, match=f"a command to resume after: {reason}"):
        Flight(tmp_path, link=link, profile="ardusub", arm=True, timeout=8.0)
    texts = [(at - 100.0, m.text) for at, m in link.sent if m.get_type() == "STATUSTEXT"]
    (begun,) = [at for at, text in texts if text == "Companion diving"]
    (ended,) = [at for at, text in texts if text == f"Companion pilot: {reason}"]
    assert begun < dived < ended < dived + 0.5
    modes = [m for at, m in link.sent if m.get_type() == "COMMAND_LONG" and m.command == 176 and at - 100.0 > ended]
    assert not modes


@pytest.mark.medium
def test_a_px4_that_refuses_hold_gets_no_forces_any_more(tmp_path):
    """Without a global position it refuses Hold, and keeps the forces of the last set-point for a second."""
    link = StandIn(profile="px4", shift=SHIFT)
    late = 6.0  # s: PX4's parameters, which our vehicle has not, are waited for
    link.events += [
        (late, lambda: link.refused_commands.add(mavlink.MAV_CMD_DO_SET_MODE)),
        (late, lambda: link.silent.add("LOCAL_POSITION_NED")),
    ]
    flight = Flight(tmp_path, link=link, profile="px4", steer_by="attitude")
    assert flight.status == "held: stale estimate"
    since = flight.time_of("held")
    targets = flight.sent_after(since - 0.01, "SET_ATTITUDE_TARGET")
    assert targets and all(get_thrust_body(target) == (0.0, 0.0, 0.0) for target in targets)
    assert any(any(get_thrust_body(m)) for m in flight.sent_after(0.0, "SET_ATTITUDE_TARGET"))


@pytest.mark.medium
def test_a_velocity_that_is_off_does_not_shift_the_position(tmp_path, link):
    """By 3 cm/s, as a drifting gyroscope does: a filter that trusts it puts the vehicle 6 cm aside."""
    link.tamper["LOCAL_POSITION_NED"] = lambda m: setattr(m, "vx", m.vx + 0.03)
    flight = Flight(tmp_path, 8.0, link=link)
    estimate = flight.run.table()["law.position.x"].to_numpy()
    true = link.column("position.x")
    steps = round(flight.companion.scenario.time.step / link.step)
    begun = len(true) - steps * (len(estimate) - 1)
    errors = [estimate[k] - true[begun + steps * k] for k in range(len(estimate) // 2, len(estimate) - 10)]
    assert abs(np.mean(errors)) < 0.02


@pytest.mark.medium
def test_frame_drift_holds_the_vehicle(tmp_path, link):
    flight = Flight(tmp_path, 8.0, link=link, events=[lambda: position_off(link, 10.0, 0.4)])
    assert flight.status == "held: frame drift" and flight.companion.session.alignment.drift > 0.5


@pytest.fixture
def margins(monkeypatch):
    """Return the list of the margins [m] that a flight sets for position errors."""
    found, inflate = [], RegionEnvironment.inflate_position_uncertainty
    monkeypatch.setattr(RegionEnvironment, "inflate_position_uncertainty",
                        lambda self, by: (found.append(SPREADS * by), inflate(self, by)))  # fmt: skip
    return found


@pytest.mark.medium
def test_frame_drift_widens_margins(tmp_path, margins, link):
    """Of sources that come apart by 0.3 m, the margins of all regions are as much wider, and it goes on."""
    flight = Flight(tmp_path, 8.0, link=link, events=[lambda: position_off(link, 0.3, 0.15)])
    assert flight.status == "completed"
    assert 0.2 < flight.companion.session.alignment.drift < 0.4
    assert margins[0] == pytest.approx(UNSEEN)
    assert margins[-1] == pytest.approx(UNSEEN + 0.3, abs=0.1)


@pytest.mark.medium
def test_dead_reckoning_widens_margins_with_distance(tmp_path, margins, link):
    link.tamper["EKF_STATUS_REPORT"] = link.tamper["ESTIMATOR_STATUS"] = lambda m: setattr(m, "flags", 8)
    flight = Flight(tmp_path, 6.0, link=link, reckoning_error=0.05)
    table = flight.run.table()
    way = np.array([table[f"position.{a}"].to_numpy() for a in "xy"])
    moved = np.linalg.norm(np.diff(way, axis=1), axis=0).sum()
    assert flight.status == "completed" and moved > 0.5
    assert margins[-1] - UNSEEN == pytest.approx(0.05 * moved, rel=0.1)


@pytest.mark.medium
def test_violated_hard_region_holds_the_vehicle(tmp_path):
    flight = Flight(tmp_path, 8.0, origin=SceneOrigin(surveyed=(0.0, 3.2, -1.9)))  # as if it were beside the pipe
    assert flight.status in ("held: geofence", "completed")
    inside = flight.run.table()["pipe.clearance"].to_numpy().min() < -0.1
    assert inside == (flight.status == "held: geofence")


@pytest.mark.medium
@pytest.mark.parametrize("echoes", [1, 100])
def test_a_bottom_nearer_than_the_scene_says_holds_the_vehicle_unless_it_is_one_echo(tmp_path, echoes):
    """The scene's frame is off, or something is there that the scene has not."""
    link, left = StandIn(profile="generic", shift=SHIFT, overrides=["plant.parameters.bottom_depth=4.9"]), [echoes]

    def nearer(message):
        message.current_distance -= 100 if left[0] > 0 else 0
        left[0] -= 1

    flight = Flight(tmp_path, 6.0, link=link, events=[lambda: link.tamper.update(DISTANCE_SENSOR=nearer)])
    assert flight.status == ("completed" if echoes == 1 else "held: unexpected range")
    assert echoes == 1 or flight.time_of("held") < EVENT + 3.0  # at 2 Hz


PILOTS = {
    "mode taken": lambda link: command(link, 176, 1.0, 4.0, 3.0),
    "pilot's sticks": lambda link: link.hear(mavlink.MAVLink_manual_control_message(1, 600, 0, 0, 0, 0)),
    "disarmed": lambda link: command(link, 400, 0.0),
}


@pytest.mark.medium
@pytest.mark.parametrize("reason", PILOTS)
def test_pilot_takes_over_within_one_second(tmp_path, reason, link):
    flight = Flight(tmp_path, link=link, events=[lambda: PILOTS[reason](link)])
    since = flight.time_of("pilot")
    assert flight.status == f"pilot: {reason}" and EVENT < since <= EVENT + 1.0
    assert not flight.sent_after(since, *STICKS)
    assert not [m for m in flight.sent_after(since, "COMMAND_LONG") if m.command == 176]
    last = [m for _, m in link.sent if m.get_type() == "MANUAL_CONTROL"][-1]
    assert (last.x, last.y, last.z, last.r) == (0, 0, 0, 0)


def channels(message):
    return [getattr(message, f"chan{i}_raw") for i in range(1, 7)]


@pytest.mark.medium
@pytest.mark.parametrize("end", ["pilot", "held", "over"])
def test_overridden_channels_rest_in_the_middle_and_are_then_given_back(tmp_path, end):
    """An ArduSub without a radio keeps what it heard last of a channel that it gets back."""
    link = StandIn(profile="ardusub", shift=SHIFT)
    events = {
        "pilot": lambda: command(link, 176, 1.0, 16.0),
        "held": lambda: command(link, 193, 0.0, system=IDENTITY[0], component=IDENTITY[1]),
        "over": lambda: None,
    }
    link.events = [(6.0, events[end])]  # once its failsafe parameters are read, which takes 3 s
    flight = Flight(tmp_path, 5.0, link=link, profile="ardusub", sticks_by="rc-override")
    since = flight.time_of("steering") + 5.0 if end == "over" else flight.time_of(end) - 1e-6
    sent = [(at, channels(m)) for at, m in link.sent if m.get_type() == "RC_CHANNELS_OVERRIDE"]
    steered = [pulses for at, pulses in sent if at - 100.0 < since]
    assert any(pulse not in (0, 1500) for pulses in steered[10:] for pulse in pulses)
    *middle, (last_at, last) = [(at, pulses) for at, pulses in sent if pulses in ([1500] * 6, [0] * 6)][-4:]
    assert last == [0] * 6 and all(pulses == [1500] * 6 for _, pulses in middle) and last_at == sent[-1][0]
    assert last_at - 100.0 >= since + 0.15
    assert link.context.sticks == (0.0,) * 6


def station(system, kind=mavlink.MAV_TYPE_GCS):
    """Return an event: the heartbeat of a ground station."""
    return lambda link: link.hear(mavlink.MAVLink_heartbeat_message(kind, 8, 0, 0, 4, 3), system)


def answer(**values):
    """Return an event: the autopilot's parameters."""
    return lambda link: [link.hear(parameter(name.encode(), value), 1, 1) for name, value in values.items()]


ONBOARD = mavlink.MAV_TYPE_ONBOARD_CONTROLLER
COMPETES = "joystick of station {} competes if on; enable it only to take over"
IGNORED = "ArduSub ignores sticks of station 250: SYSID_MYGCS is 255; set its system id to 255"
HIDES = "no failsafe while station 255 runs; it satisfies FS_GCS_ENABLE: set FS_PILOT_INPUT to 1"


@pytest.mark.medium
@pytest.mark.parametrize(
    ("profile", "options", "events", "warnings"),
    [
        ("generic", {}, [station(255), station(255), station(250), station(255, ONBOARD)], [COMPETES.format(255)]),
        ("generic", {}, [station(255, ONBOARD)], []),
        ("generic", {"dry_run": True}, [station(255)], []),
        ("ardusub", {}, [station(250), answer(SYSID_MYGCS=255.0)], [IGNORED]),
        ("ardusub", {}, [answer(MAV_GCS_SYSID=250.0, MAV_GCS_SYSID_HI=255.0), station(252)], [COMPETES.format(252)]),
        ("ardusub", {}, [answer(FS_PILOT_INPUT=0.0), station(255)], [COMPETES.format(255), HIDES]),
    ],
)  # fmt: skip
def test_each_station_that_competes_or_is_ignored_is_warned_of_once(
    tmp_path, caplog, profile, options, events, warnings
):
    link = StandIn(profile=profile, shift=SHIFT)
    begun = 4.0 if profile == "ardusub" else 0.5  # s: an ArduSub's missing parameters are awaited for 3 s
    link.events = [(begun + 0.1 * k, lambda event=event: event(link)) for k, event in enumerate(events)]
    expected = "dry run" if options.get("dry_run") else "completed"
    assert Flight(tmp_path, 1.5, link=link, profile=profile, **options).status == expected
    assert [r.getMessage() for r in caplog.records if "station" in r.getMessage()] == warnings
    texts = [m.text for m in link.of_type("STATUSTEXT") if "station" in m.text]
    for text, warning in zip(texts, warnings, strict=True):  # nothing is cut off: what follows the text is advice
        assert re.fullmatch(re.escape(text.removeprefix("Companion: ")) + "[:;].*", warning)


@pytest.mark.medium
@pytest.mark.parametrize(
    ("system", "routed", "warning", "min_distance", "max_distance"),
    [(255, False, COMPETES.format(255), 3.0, 10.0), (255, True, COMPETES.format(255), 3.0, 10.0),
     (250, False, IGNORED, 0.0, 1.5)],
)  # fmt: skip
def test_a_pilot_drives_away_by_sticks_of_the_system_that_the_autopilot_obeys(
    tmp_path, caplog, system, routed, warning, min_distance, max_distance
):
    """One of another system, whose sticks an ArduSub ignores, is warned of before the vehicle is armed."""
    link, begun = StandIn(profile="ardusub", shift=SHIFT, armed=False, obeys=255, routed=routed), 6.0

    def drive():
        link.hear(mavlink.MAVLink_manual_control_message(1, 1000, 0, 500, 0, 0), system)

    link.events = [(0.4, lambda: station(system)(link)), (0.5, lambda: answer(SYSID_MYGCS=255.0)(link)),
                   *((begun + 0.04 * k, drive) for k in range(300))]  # fmt: skip
    flight = Flight(tmp_path, 10.0, link=link, profile="ardusub", arm=True, level_dive=0.0)
    assert flight.status == "pilot: pilot's sticks" and flight.time_of("pilot") - begun <= 0.2
    assert [r.getMessage() for r in caplog.records if "station" in r.getMessage()] == [warning]
    (warned_at,) = [k for k, (_, m) in enumerate(link.sent) if m.get_type() == "STATUSTEXT" and "station" in m.text]
    (armed_at, *_) = [k for k, (_, m) in enumerate(link.sent) if m.get_type() == "COMMAND_LONG" and m.command == 400]
    way = np.array([link.column(f"position.{axis}")[round(begun / link.step) :] for axis in "xyz"])
    assert warned_at < armed_at and min_distance < np.linalg.norm(way[:, -1] - way[:, 0]) < max_distance


@pytest.mark.medium
def test_control_can_be_resumed_after_a_takeover(tmp_path, link):
    ours = {"system": IDENTITY[0], "component": IDENTITY[1]}
    later = [(EVENT, lambda: command(link, 193, 0.0, **ours)), (EVENT + 2.0, lambda: command(link, 193, 1.0, **ours))]
    flight = Flight(tmp_path, 10.0, link=link, events=[lambda: link.events.extend(later)])
    names = [state for _, state in flight.states]
    assert names[-1] == "steering" and "held" in names and flight.status == "completed"


@pytest.mark.medium
def test_a_command_to_resume_does_not_undo_the_release_at_the_end(tmp_path, link):
    """The release waits for the hold mode, which is refused here; while it is steered, the command changes nothing."""
    resume = {"system": IDENTITY[0], "component": IDENTITY[1]}
    link.events = [(EVENT, lambda: link.refused_commands.add(176))]
    link.events += [(EVENT + 0.1 * k, lambda: command(link, 193, 1.0, **resume)) for k in range(50)]
    flight = Flight(tmp_path, 3.0, link=link)
    assert flight.status == "completed" and flight.companion.session.supervisor.state == "held"
    assert link.of_type("STATUSTEXT")[-1].text == "Companion steering"


def test_every_condition_has_a_test():
    tested = {*FAULTS, *PILOTS, "refused mode", "frame drift", "geofence", "unfinished dive", "unexpected range"}
    assert tested == {condition.name for condition in CONDITIONS}


def test_documented_tables_match_the_code():
    page = (ROOT / "docs" / "howto" / "companion.md").read_text()
    for condition in CONDITIONS:
        limit = f"{condition.limit:g} {condition.unit}" if condition.unit else "any"
        assert f"| {condition.name} | {limit} | {condition.words} | {condition.next_state} |" in page
    for number, state in enumerate(STATES):
        assert f"| {number} | {state.replace('_', ' ')} |" in page


# ---- the run that is left ----


@pytest.mark.medium
def test_record_holds_the_exchange_with_the_autopilot(tmp_path):
    flight = Flight(tmp_path, 3.0)
    run = load_run(tmp_path / "run")
    table = run.table()
    assert table.num_rows == round(3.0 / 0.02) + 1
    age = table["autopilot.age"].to_numpy()
    assert 0.01 < np.median(age) < 0.05  # 12 ms on the way, and half a period
    estimate = np.array([table[f"autopilot.position.{a}"].to_numpy() for a in "xyz"])
    scene = np.array([table[f"position.{a}"].to_numpy() for a in "xyz"])
    way = np.array([table[f"autopilot.velocity.{a}"].to_numpy() for a in "xyz"]) * age  # it is predicted by
    offset = np.outer(flight.companion.session.alignment.offset, np.ones(151))
    assert scene - estimate - way == pytest.approx(offset, abs=3e-3)
    assert set(table["companion.state"].to_numpy()[2:]) == {STATES.index("steering")}
    late = round(0.15 / flight.link.step)  # steps: pulses come at 10 Hz, in whole microseconds
    begun = len(flight.link.rows) - round(3.0 / flight.link.step) - 1
    for i in (1, 8):
        true, force = flight.link.column(f"thrust[{i}]"), table[f"thruster_force[{i}]"].to_numpy()
        for k in range(20, 150):
            now = begun + round(0.02 * k / flight.link.step)
            assert np.abs(true[now - late : now + 2] - force[k]).min() < 0.2
        assert np.ptp(force[20:150]) > 0.5
    assert table["companion.round_trip"].to_numpy()[-1] == pytest.approx(0.067, abs=0.03)


def test_scenario_keys_of_simulation_only_are_rejected():
    with pytest.raises(RunError, match=r"record\.lyapunov is set"):
        scenario_to_steer(load_scenario("paper", ["record.lyapunov=true"]))
    with pytest.raises(RunError, match=r"goal\.then is set"):
        scenario_to_steer(load_scenario("pile-inspection"))
    steered = scenario_to_steer(load_scenario("pipe-inspection"))
    assert steered.time.step == steered.time.control == 0.02 and steered.sensing.exact


@pytest.mark.medium
def test_the_page_of_a_flight_shows_states_ages_modes_and_sticks(tmp_path):
    link, sent = StandIn(profile="generic", shift=SHIFT), {"hold": Event(), "reach": Event()}
    link.events = [(EVENT + k, lambda mode=mode: sent[mode].wait(60.0)) for k, mode in enumerate(sent)]
    with LiveView(parse_live("0")) as live, ThreadPoolExecutor(1) as pool:
        flying = pool.submit(Flight, tmp_path, 6.0, link=link, live=live)
        with Viewer(live.url) as viewer:
            for count, (mode, state) in enumerate(zip(sent, ("steering", "held"), strict=True), 1):
                while not any(text.startswith(state) for text in viewer.texts_of("info")):
                    viewer.receive()
                viewer.command(command="set_mode", mode=mode)
                viewer.command(command="arm", armed=True)
                while len(viewer.texts_of("refused")) < count:  # the one before it was taken
                    viewer.receive()
                sent[mode].set()
            end = viewer.until("end")
        flight = flying.result()
    assert viewer.headers[0]["commands"] == ["hold", "reach"]
    assert set(viewer.texts_of("refused")) == {"expected one of the modes hold, reach"}
    names = iter([state for _, state in flight.states])  # in this order; a busy machine may add others
    assert all(state in names for state in ("steering", "held", "aligning", "engaging", "steering"))
    assert end["status"] == "completed"
    assert "engaging, waits for mode 458752" in viewer.texts_of("info") and "steering" in viewer.texts_of("info")
    table = flight.run.table()
    rows = np.round(viewer.column("time") / 0.02).astype(int)
    for name in ("autopilot.age", "autopilot.mode", "companion.state", "stick.X", "stick.N", "companion.lateness"):
        assert np.array_equal(viewer.column(name), table[name].to_numpy()[rows], equal_nan=True), name


@pytest.mark.slow
def test_report_and_replay_are_written(tmp_path):
    Flight(tmp_path, 3.0)
    summary, files = report_again(tmp_path / "run")
    assert summary["simulated_time"] == 3.0
    assert {file.name for file in files} >= {"report.html", "replay.html"}
