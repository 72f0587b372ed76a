"""The command handler: commands take effect at their step and replay bit for bit."""

import dataclasses

import numpy as np
import pytest

from controller import quaternion
from cosim.results.as_flown import scenario_as_flown
from cosim.results.record import load_record
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands import commands as cmd
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.commands.commands import MODES
from cosim.simulation.commands.sources import CommandQueue, LoggedCommands, ReplayedCommands
from cosim.step.decision import MAX_WRENCH, bound_wrench
from plant_fmu.vehicle import load_vehicle
from tests.cosim.simulation.keep import kept_rows

STEPS = 100  # a second of pipe-inspection
SHORT = "time.duration=20"
OPEN = ["regions=[]", "sensing.position_noise=0", "sensing.velocity_noise=0", "plant.current=[0.0,0.0,0.0]"]


BLUEROV = load_vehicle("bluerov2_heavy")
REACH = greatest_wrench(BLUEROV)
TARGET = [f"target.{axis}" for axis in "xyz"]


def test_without_commands_the_run_is_unchanged(fly):
    commanded, plain = fly({}, "time.duration=5"), kept_rows(load_scenario("pipe-inspection", ["time.duration=5"]))
    for column in plain.signals.columns:
        assert np.array_equal(plain[column.name], commanded[column.name]), column.name


def test_disarmed_thrusters_give_zero_and_recover_when_armed(fly):
    run = fly({200: [cmd.Arm(False)], 400: [cmd.Arm(True)]}, "time.duration=8")
    thrusts = np.abs(run.stack(*(f"thrust[{i}]" for i in range(1, 9)))).max(axis=1)
    assert thrusts[:200].max() > 1.0 and thrusts[400:].max() > 1.0
    assert not thrusts[200:400].any()
    assert set(run["commands.armed"][200:400]) == {0.0} and set(run["commands.armed"][:200]) == {1.0}


def test_commanded_target_is_reached(fly):
    run = fly({100: [cmd.SetTarget((3.0, 2.0, 4.0), radius=0.4)]}, SHORT)
    assert np.linalg.norm(run.position[-1] - [3.0, 2.0, 4.0]) < 0.4
    assert run["goal.clearance"][-1] == pytest.approx(0.4 - np.linalg.norm(run.position[-1] - [3.0, 2.0, 4.0]), abs=0.1)
    assert run["target.radius"][-1] == 0.4 and run["target.radius"][0] == 0.0
    assert run.stack(*TARGET)[-1] == pytest.approx([3.0, 2.0, 4.0])


def test_target_without_radius_keeps_the_goal_shape(fly):
    run = fly({100: [cmd.SetTarget((3.0, 2.0, 4.0), velocity=(0.0, -0.1, 0.0))]}, SHORT, *OPEN)
    k = 1500
    middle = np.array([3.0, 2.0 - 0.1 * (k - 100) / STEPS, 4.0])
    assert run.stack(*TARGET)[k] == pytest.approx(middle, abs=1e-9)
    radius = load_scenario("pipe-inspection").goal.radius
    assert run["goal.clearance"][k] == pytest.approx(radius - np.linalg.norm(run.position[k] - middle), abs=1e-9)
    shifts = run.stack("goal.shift.x", "goal.shift.y", "goal.shift.z")[k]
    assert shifts + load_scenario("pipe-inspection").goal.center == pytest.approx(middle, abs=1e-9)


def test_hold_keeps_the_position_at_the_command(fly):
    run = fly({300: [cmd.SetMode("hold")]}, SHORT, *OPEN)
    place = run.stack(*TARGET)[300]
    assert place == pytest.approx(run.position[300], abs=1e-9)
    assert np.linalg.norm(run.position[800:] - place, axis=1).max() < 0.3
    assert MODES[int(run["commands.mode"][-1])] == "hold"


@pytest.mark.slow
def test_reach_mode_restores_the_previous_target(fly):
    run = fly({100: [cmd.SetMode("hold")], 300: [cmd.SetMode("reach")]}, "time.duration=60")
    straight = fly({}, "time.duration=60")
    assert run["goal.clearance"][-1] > 0.0 and straight["goal.clearance"][-1] > 0.0
    assert run["target.x"][-1] == pytest.approx(straight["target.x"][-1], abs=1e-9)  # it travels


def test_surface_mode_ascends_vertically(fly):
    run = fly({300: [cmd.SetMode("surface")]}, SHORT, *OPEN)
    assert run.position[-1][2] == pytest.approx(0.5, abs=0.3)
    assert np.linalg.norm(run.position[-1][:2] - run.position[300][:2]) < 0.35


@pytest.mark.parametrize(("axis", "by_gain"), [(0, True), (1, True), (2, True), (5, True), (0, False)])
def test_manual_control_acts_along_its_axis(fly, axis, by_gain):
    sticks = cmd.ManualControl(tuple(np.eye(6)[axis]), by_gain=by_gain)
    run = fly({0: [cmd.SetMode("manual"), sticks]}, "time.duration=2", *OPEN)
    wrench = run.stack(*(f"command.{name}" for name in "XYZKMN"))[-1]
    assert wrench[axis] == pytest.approx((0.5 if by_gain else 1.0) * REACH[axis])  # the pilot's gain
    forces = run.stack(*(f"thrust[{i}]" for i in range(1, 9)))[-1]
    assert BLUEROV.thruster_matrix @ forces == pytest.approx(wrench, abs=1e-9)
    assert run.stack(*(f"velocity.{name}" for name in "uvwpqr"))[-1][axis] > 0.1


def sticks(*values):
    return cmd.ManualControl(tuple(values))


def test_stabilize_mode_holds_attitude_and_heading(fly):
    push = [sticks(0.5, 0.0, 0.0, 0.0, 0.0, 0.0)]
    bare = fly({0: [cmd.SetMode("manual"), *push]}, "time.duration=10", *OPEN)
    helped = fly({0: [cmd.SetMode("stabilize"), *push]}, "time.duration=10", *OPEN)
    assert np.abs(bare["attitude.pitch"]).max() > 0.15
    assert np.abs(helped.stack("attitude.roll", "attitude.pitch")).max() < 0.1
    assert abs(helped["attitude.yaw"][-1]) < 0.01
    assert helped["velocity.u"][-1] > 0.4 and not helped["command.Z"].any()  # heave is the pilot's


@pytest.mark.medium
def test_depth_hold_holds_depth_and_follows_the_vertical_stick(fly):
    commands = {0: [cmd.SetMode("depth_hold")], 1000: [sticks(0, 0, 1.0, 0, 0, 0)], 1500: [sticks(0, 0, 0, 0, 0, 0)]}
    run = fly(commands, "time.duration=30", *OPEN)
    depth = run.position[:, 2]
    assert np.abs(depth[500:1000] - depth[0]).max() < 0.05
    assert np.diff(depth[1200:1500]).mean() * STEPS == pytest.approx(0.3, abs=0.05)
    assert np.ptp(depth[2500:]) < 0.05


@pytest.mark.medium
def test_commanded_depth_is_kept_in_depth_hold_until_the_vertical_stick_moves(fly):
    commands = {0: [cmd.SetMode("depth_hold")], 200: [cmd.SetDepth(4.5)], 2500: [sticks(0, 0, -1.0, 0, 0, 0)],
                2700: [sticks(0, 0, 0, 0, 0, 0)]}  # fmt: skip
    run = fly(commands, "time.duration=40", *OPEN)
    depth = run.position[:, 2]
    assert np.diff(depth).max() * STEPS < 0.45 and depth.max() < 4.75
    assert np.abs(depth[2300:2500] - 4.5).max() < 0.05
    assert depth[-1] < 4.2 and np.ptp(depth[3700:]) < 0.05


def test_yaw_stick_sets_a_rate_and_heading_is_held_afterwards(fly):
    commands = {0: [cmd.SetMode("stabilize"), sticks(0, 0, 0, 0, 0, 0.25)], 400: [sticks(0, 0, 0, 0, 0, 0)]}
    yaw = np.unwrap(fly(commands, "time.duration=10", *OPEN)["attitude.yaw"])
    assert np.diff(yaw[200:400]).mean() * STEPS == pytest.approx(np.radians(0.5 * 0.25 * 202.5), rel=0.1)
    assert np.ptp(yaw[700:]) < 0.02


def tilted(yaw, pitch):
    return quaternion.multiply(
        quaternion.from_axis_angle(np.array([0.0, 0.0, 1.0]), yaw),
        quaternion.from_axis_angle(np.array([0.0, 1.0, 0.0]), pitch),
    )


@pytest.mark.medium
def test_commanded_attitude_is_held_with_sticks_until_the_mode_ends(fly):
    attitude = cmd.SetAttitude(tuple(tilted(0.5, 0.1)))
    commands = {
        0: [cmd.SetMode("depth_hold"), attitude, sticks(0.3, 0, 0, 0, 0, 0.9)],
        1500: [cmd.SetMode("depth_hold")],
    }
    run = fly(commands, "time.duration=25", *OPEN)
    assert run["attitude.yaw"][1490] == pytest.approx(0.5, abs=0.03)
    assert run["attitude.pitch"][1490] == pytest.approx(0.1, abs=0.05)  # it rights itself and the loop has no integral
    assert run["velocity.u"][1490] > 0.2
    assert run["attitude.pitch"][-1] == pytest.approx(0.0, abs=0.02)


@pytest.mark.medium
def test_attitude_with_force_replaces_the_law_until_the_next_target(fly):
    attitude = cmd.SetAttitude(tuple(tilted(0.4, 0.0)), (0.2, 0.0, 0.0))
    run = fly({100: [attitude], 900: [cmd.SetMode("hold")]}, "time.duration=20", *OPEN)
    assert run["command.X"][100:900] == pytest.approx(0.2 * REACH[0])
    assert run["attitude.yaw"][890] == pytest.approx(0.4, abs=0.03)
    place = run.stack(*TARGET)[-1]
    assert np.linalg.norm(run.position[-1] - place) < 0.3


def test_greatest_wrench_puts_one_thruster_at_its_limit():
    for axis in range(6):
        forces = np.linalg.lstsq(BLUEROV.thruster_matrix, REACH[axis] * np.eye(6)[axis], rcond=None)[0]
        assert np.abs(forces).max() == pytest.approx(BLUEROV.thrust_max[0])
    powerless = dataclasses.replace(BLUEROV, thruster_matrix=np.zeros((6, 8)))
    assert greatest_wrench(powerless) == pytest.approx(np.zeros(6))


def test_mission_visits_its_regions_in_order(fly):
    items = (
        cmd.MissionItem((1.0, 0.0, 3.0), 0.3),
        cmd.MissionItem((0.0, 2.0, 2.0), None, 2.0),
        cmd.MissionItem((1.0, 1.0, 2.0), 0.3),
    )
    run = fly({0: [cmd.SetMission(items), cmd.SetMode("mission")]}, "time.duration=40", *OPEN)
    item = run["commands.item"]
    assert list(dict.fromkeys(item.tolist())) == [0.0, 1.0, 2.0]
    first, second = int(np.argmax(item == 1)), int(np.argmax(item == 2))
    assert np.linalg.norm(run.position[first] - items[0].position) < 0.3
    stayed = np.linalg.norm(run.position[second - 2 * STEPS : second] - items[1].position, axis=1)
    assert stayed.max() < load_scenario("pipe-inspection").goal.radius  # two seconds within
    assert np.linalg.norm(run.position[-1] - items[2].position) < 0.3


def test_immediate_mission_commands_stay_in_effect(fly):
    slowly = cmd.MissionItem(None, commands=(cmd.ChangeSetting("law.gains.speed", 0.2), cmd.SetHeading(0.8)))
    items = (
        slowly,
        cmd.MissionItem((1.0, 0.0, 3.0), 0.3),
        cmd.MissionItem(None, stay=1.0),
        cmd.MissionItem(None, jump=1, times=1),
        slowly,
    )
    run = fly(
        {
            0: [cmd.SetMission(items), cmd.SetMode("mission")],
            1200: [cmd.SetMode("hold")],
            1300: [cmd.SetMode("mission")],
        },
        SHORT,
        *OPEN,
    )
    item = run["commands.item"]
    seen = [1, *item[1:][np.diff(item) != 0].tolist()]
    assert item[0] == 1 and seen == [1, 2, 3, 1, 2, 3, 4]  # there, a delay, and once again
    assert run.stack(*TARGET)[-1] == pytest.approx(items[1].position)  # after the hold, too
    assert run["target.x"][1250] != pytest.approx(1.0, abs=1e-3)
    fastest = np.linalg.norm(run.stack("velocity.u", "velocity.v", "velocity.w"), axis=1).max()
    assert 0.1 < fastest < 0.3  # 1.2 m/s without
    assert run["attitude.yaw"][-1] == pytest.approx(0.8, abs=0.05)


def test_unlimited_stay_ends_only_by_command(fly):
    items = (cmd.MissionItem((1.0, 0.0, 3.0), 0.3, None), cmd.MissionItem((0.0, 1.0, 2.0), 0.3))
    run = fly({0: [cmd.SetMission(items), cmd.SetMode("mission")], 1500: [cmd.SetCurrentItem(1)]}, SHORT, *OPEN)
    assert set(run["commands.item"][:1500]) == {0.0} and set(run["commands.item"][1500:]) == {1.0}
    assert np.linalg.norm(run.position[1499] - items[0].position) < 0.3


@pytest.mark.slow
def test_commanded_heading_is_held(fly):
    run = fly({100: [cmd.SetHeading(1.2)]}, SHORT, *OPEN)
    assert run["attitude.yaw"][-1] == pytest.approx(1.2, abs=0.05)
    by_wrench = fly({100: [cmd.SetHeading(1.2)]}, "time.duration=15", name="paper")
    assert by_wrench["attitude.yaw"][-1] == pytest.approx(1.2, abs=0.05)


@pytest.mark.medium
def test_added_obstacle_is_avoided(fly):
    center = (2.5, 0.0, 3.0)
    way = [cmd.SetTarget((5.0, 0.0, 3.0), 0.4)]
    through = fly({0: way}, SHORT, *OPEN)
    round_it = fly({0: way, 50: [cmd.AddObstacle(7, center, 0.6)]}, SHORT, *OPEN)
    assert np.linalg.norm(through.position - center, axis=1).min() < 0.1
    assert np.linalg.norm(round_it.position - center, axis=1).min() >= 0.6
    assert np.linalg.norm(round_it.position[-1] - [5.0, 0.0, 3.0]) < 0.4
    assert round_it["seen 1.clearance"][-1] == pytest.approx(np.linalg.norm(round_it.position[-1] - center) - 0.6)
    gone = fly({0: way, 50: [cmd.AddObstacle(7, center, 0.6)], 60: [cmd.RemoveObstacle(7)]}, SHORT, *OPEN)
    assert np.linalg.norm(gone.position - center, axis=1).min() < 0.3


def test_excess_obstacles_are_rejected_and_known_obstacles_move(fly, caplog):
    far = [cmd.AddObstacle(i, (50.0, float(i), 3.0), 0.5) for i in range(3)]
    run = fly(
        {0: far, 5: [cmd.AddObstacle(1, (60.0, 0.0, 3.0), 0.5)]}, "time.duration=0.1", "commands.obstacles=2", *OPEN
    )
    assert "no room for obstacle 2" in caplog.text
    assert run["seen 2.shift.x"][4:6].tolist() == [50.0, 60.0]


def test_shifted_regions_keep_their_shape_and_are_recorded(fly):
    travels = cmd.AddObstacle(4, (30.0, 0.0, 3.0), 0.5, velocity=(1.0, 0.0, 0.0))
    away, back = (0.0, 3.0, -1.0), (0.0, -3.0, 1.0)
    script = {
        0: [travels],
        10: [cmd.ShiftRegion("pipe", away), cmd.ShiftRegion("seen 1", away), cmd.SetMode("hold")],
        20: [cmd.ShiftRegion("pipe", back)],
    }
    run, plain = fly(script, "time.duration=0.3"), fly({0: [cmd.SetMode("hold")]}, "time.duration=0.3")
    shifts = run.stack(*(f"pipe.shift.{axis}" for axis in "xyz"))
    assert not shifts[:10].any() and not shifts[20:].any()
    assert shifts[10:20].tolist() == [list(away)] * 10
    # the pipe is as far from the vehicle as it would be from one that had moved the other way
    room = fly({}, "time.duration=0.01", "initial.position=" + str((run.position[10] - away).tolist()))
    assert run["pipe.clearance"][10] == pytest.approx(room["pipe.clearance"][0], abs=1e-12)
    assert run["pipe.clearance"][9] == pytest.approx(plain["pipe.clearance"][9], abs=0.01)
    # the obstacle goes on as it went
    north = run["seen 1.shift.x"]
    assert np.diff(north) == pytest.approx(np.full(len(north) - 1, 0.01), abs=1e-9)
    assert run["seen 1.shift.y"][[9, 10, 30]].tolist() == [0.0, 3.0, 3.0]


def test_settings_change_during_a_run(fly):
    changes = [
        cmd.ChangeSetting("law.gains.speed", 0.15), cmd.ChangeSetting("goal.radius", 0.9),
        cmd.ChangeSetting("regions.pipe.shape.radius", 0.8),
        cmd.ChangeSetting("plant.parameters.thrust_max[1]", 3.0), cmd.ChangeSetting("arbiter.ramp", 0.7),
    ]  # fmt: skip
    run = fly({10: [cmd.SetMode("manual")], 300: changes, 320: [cmd.SetMode("reach")]}, "time.duration=10")
    assert run.master.law.gains.speed == 0.15  # of a law that was idle then
    jump = run["goal.clearance"][300] - run["goal.clearance"][299]
    assert jump == pytest.approx(0.5, abs=0.05)  # of the radius, from 0.4 m
    assert run["pipe.clearance"][300] - run["pipe.clearance"][299] == pytest.approx(-0.2, abs=0.05)
    assert run["thruster_force[1]"][300:].max() <= 3.0 + 1e-9


def test_force_limit_and_region_gain_change_during_a_run(fly):
    run = fly(
        {500: [cmd.ChangeSetting("limit.force", 20.0), cmd.ChangeSetting("regions.SR1.gain", 3.0)]},
        "time.duration=1",
        name="paper",
    )
    force = np.linalg.norm(run.stack(*(f"actuation.{axis}" for axis in "XYZ")), axis=1)
    assert force[:500].max() > 25.0 and force[501:-1].max() <= 20.0 + 1e-9
    assert run.master.environment.regions.gains[0] == 3.0


@pytest.mark.medium(fast=3)
@pytest.mark.parametrize(
    ("command", "why"),
    [
        (cmd.SetMode("mission"), "there is no mission"),
        (cmd.SetCurrentItem(3), "item is 3"),
        (cmd.ShiftRegion("ships", (1.0, 1.0, 1.0)), "expected one of view, pipe"),
        (cmd.ShiftRegion("goal", (1.0, 1.0, 1.0)), "expected one of view"),
        (cmd.ShiftRegion("seen 2", (1.0, 1.0, 1.0)), "no such obstacle has been added"),
        (cmd.ChangeSetting("law.gains.nonsense", 1.0), "is no setting"),
        (cmd.ChangeSetting("regions.pipe.shape.color", 1.0), "is no setting"),
        (cmd.ChangeSetting("goal.radius", -1.0), "radius is -1.0, expected above 0 m"),
        (cmd.ChangeSetting("arbiter.ramp", -1.0), "arbiter.ramp is -1, expected 0 to 1000"),
        (cmd.ChangeSetting("law.gains.speed", 0.0), "expected a finite number above 0"),
        (cmd.ChangeSetting("regions.mooring.shape.end.2", 1e-38), "expected a point other than start"),
    ],
)
def test_invalid_command_is_logged_and_has_no_effect(fly, caplog, command, why):
    name = "depth-transit" if "mooring" in str(command) else "pipe-inspection"
    run = fly({5: [command]}, "time.duration=0.2", name=name)
    assert why in caplog.text
    assert np.array_equal(run.rows, fly({}, "time.duration=0.2", name=name).rows, equal_nan=True)


def test_hold_requires_a_known_position(fly, caplog):
    lost = ["sensing.dead_from=0.1", "sensing.dead_for=1.0"]
    run = fly({20: [cmd.SetMode("hold")]}, "time.duration=0.5", *lost)
    assert "needs a position" in caplog.text
    assert MODES[int(run["commands.mode"][-1])] == "reach"


def test_a_reset_ends_the_run(fly):
    run = fly({70: [cmd.Reset()]}, "time.duration=5")
    assert len(run.rows) == 71 and run.master.command_handler.reset


class KnownScene:
    """Observer that arms after some looks."""

    def __init__(self, queue, after, commands):
        self.queue, self.after, self.commands, self.rows = queue, after, commands, []

    def observe(self, k, row):
        self.rows.append(row.copy())
        if len(self.rows) == self.after:
            for command in self.commands:
                self.queue.submit(command)


def test_vehicle_waits_for_arming_and_replays_bit_for_bit(fly, tmp_path):
    queue = CommandQueue()
    told = KnownScene(
        queue, 5, [cmd.ChangeSetting("law.gains.speed", 0.5), cmd.SetMode("hold"), cmd.Arm(True), cmd.SetMode("reach")]
    )
    await_arm = ["commands.await_arm=true", "time.duration=3"]
    live = fly(LoggedCommands(queue, tmp_path / "commands.jsonl"), *await_arm, awaiting=told)
    assert len(told.rows) >= 5
    assert all(np.array_equal(row, told.rows[0]) for row in told.rows[:5])
    assert told.rows[0][live.master.signals.index("position.z")] == 3.0
    assert told.rows[0][live.master.signals.index("commands.armed")] == 0.0
    again = fly(ReplayedCommands(tmp_path / "commands.jsonl"), *await_arm)
    assert np.array_equal(live.rows, again.rows)


def test_empty_log_does_not_wait_for_arming(fly, tmp_path):
    (tmp_path / "commands.jsonl").touch()
    run = fly(ReplayedCommands(tmp_path / "commands.jsonl"), "commands.await_arm=true", "time.duration=0.1")
    assert not run["commands.armed"].any()


def test_logged_commands_replay_bit_for_bit(tmp_path):
    """Through the run folder: a scenario and a log are all that is needed."""
    scenario = load_scenario("pipe-inspection", ["commands.enabled=true", "time.duration=1.8"])
    log = tmp_path / "commands.jsonl"
    logged = LoggedCommands(queue := CommandQueue(), log)
    for k, command in enumerate(
        [
            cmd.SetTarget((2.0, 1.0, 3.5), 0.3),
            cmd.AddObstacle(3, (1.0, 0.5, 3.2), 0.2),
            cmd.SetHeading(0.4),
            cmd.SetMode("hold"),
        ]
    ):
        queue.submit(command)
        logged.take(50 * k)
    first = run_scenario(scenario, tmp_path / "first", report=False, commands_log=log)
    again = load_scenario(first.folder / "scenario.toml")
    second = run_scenario(again, tmp_path / "second", report=False, commands_log=first.folder / "commands.jsonl")
    a, b = load_record(first.folder), load_record(second.folder)
    for name in a.units:
        assert np.array_equal(a[name], b[name]), name
    assert (first.folder / "commands.jsonl").read_bytes() == (second.folder / "commands.jsonl").read_bytes()
    came = scenario_as_flown(scenario, a)
    assert [r.region.name for r in came.regions if r.is_dynamic] == ["seen 1"]
    assert came.regions[-1].region.shape.radius == pytest.approx(0.2, abs=1e-6)
    assert "seen 2" not in first.summary["min_clearance"]


@pytest.mark.parametrize("name", ["paper", "paper-limited"])
@pytest.mark.parametrize("away", [300.0, 1e5])
def test_distant_target_saturates_and_does_not_abort(fly, name, away):
    """The paper's law's force grows with the cube of the distance."""
    run = fly({100: [cmd.SetTarget((away, 0.0, 5.0))]}, "time.duration=0.5", name=name)
    asked = np.abs(run.stack(*(f"command.{axis}" for axis in "XYZ"))).max()
    given = np.linalg.norm(run.stack(*(f"wrench.{axis}" for axis in "XYZ")), axis=1)
    assert asked > 1e8 and given.max() <= MAX_WRENCH * 1.8
    assert run["allocation_saturated"][-1] == 1.0 and run["allocation_saturated"][0] == 0.0


def test_saturation_zeroes_non_finite_wrenches():
    wrench = np.array([np.nan, 1.0, np.inf, 2 * MAX_WRENCH, -MAX_WRENCH, 0.0])
    assert bound_wrench(wrench)
    assert wrench.tolist() == [0.0, 0.0, 0.0, MAX_WRENCH, -MAX_WRENCH / 2, 0.0]
    assert not bound_wrench(wrench)


@pytest.mark.parametrize(("gain", "value"), [("k_p2", 3e38), ("sigma_a", 3e38), ("gamma", 1e-45)])
def test_extreme_gain_saturates_and_does_not_abort(fly, gain, value):
    run = fly({10: [cmd.ChangeSetting(f"law.gains.{gain}", value)]}, "time.duration=0.5", name="paper")
    assert len(run["time"]) == 501
    assert run["allocation_saturated"].max() == 1.0


@pytest.mark.slow
def test_run_reset_in_its_first_step_has_a_report(tmp_path):
    (log := tmp_path / "commands.jsonl").write_bytes(b'{"step":0,"command":{"command":"reset"}}\n')
    run = run_scenario(load_scenario("harbour", ["commands.enabled=true"]), tmp_path / "run", commands_log=log)
    assert run.summary["status"] == "reset" and run.summary["simulated_time"] == 0.0
    assert (run.folder / "report.html").exists()
