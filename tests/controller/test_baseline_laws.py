"""The baseline laws against plain matrices, and their behavior on a simple vehicle in still water."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controller import LAWS, LawError, VehicleState
from controller.regions import DepthBand, Orientation, Region, Sphere, pack
from tests.controller.deployable.scenery import ODIN

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
NAMES = ("pd", "sun_cheah", "unarbitrated", "antonelli")
ADAPTIVE = NAMES[1:]
EVERY = (*NAMES, "pid_cbf")
PERIOD = 0.02
GOAL = Region("goal", Sphere((8.0, 1.0, 3.0), 0.5), "in")
ROCK = Region("rock", Sphere((4.0, 0.6, 2.4), 0.8), "out", gain=1.5)
BAND = Region("band", DepthBand(3.5, 3.3), "in")
# with these the adaptation is slow against the motion
QUICK = {"sigma_p": 0.3, "gamma": 0.03}
ADAPTING = {"sun_cheah": QUICK, "unarbitrated": QUICK, "antonelli": {"lambda_p": 0.3, "k_theta": 0.03}}


def law_of(name, regions=(), desired=IDENTITY, **gains):
    law = LAWS[name]
    return law.for_vehicle(ODIN, law.gains_type(**gains), desired, PERIOD, len(regions))


def random_unit(rng):
    e = rng.normal(size=4)
    return e / np.linalg.norm(e)


def cut(vector, most):
    return vector * min(1.0, most / max(np.linalg.norm(vector), 1e-300))


def cross_matrix(k):
    return np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])


def attitude_error(e, e_d):
    between = Rotation.from_quat(np.roll(e_d, -1)).inv() * Rotation.from_quat(np.roll(e, -1))
    return between.as_quat(canonical=True)[:3]


def push(p, gains):
    """Of `ROCK` and `BAND`, on the vehicle, from their geometry alone."""
    from_rock = p - np.array([4.0, 0.6, 2.4])
    distance = np.linalg.norm(from_rock)
    away = 1.5 * max(0.0, gains.reach - (distance - 0.8)) * from_rock / distance
    from_middle = p[2] - 3.5
    to_middle = -max(0.0, gains.reach - (3.3 - abs(from_middle))) * np.sign(from_middle)
    return gains.repulsion * (away + np.array([0.0, 0.0, to_middle]))


def textbook(name, p, e, e_d, nu, theta, gains):
    """Return the wrench and the rate of the parameters, as matrices; without bounds of the estimate."""
    R = Rotation.from_quat(np.roll(e, -1)).as_matrix()
    J_T = np.block([[R.T, np.zeros((3, 3))], [np.zeros((3, 3)), np.eye(3)]])
    k, O = R.T @ [0.0, 0.0, 1.0], np.zeros((3, 3))  # noqa: E741
    Z = np.block([[-k[:, None], O], [np.zeros((3, 1)), cross_matrix(k)]])
    to_goal = p - np.array([8.0, 1.0, 3.0])
    pushed = push(p, gains)
    K_v = np.diag([gains.k_v1] * 3 + [gains.k_v2] * 3)
    if name == "unarbitrated":
        f = to_goal @ to_goal - 0.25 + gains.margin
        pulled = cut(max(0.0, f) * 2.0 * to_goal, gains.limit / gains.k_p1)
        drive = pulled - pushed / gains.k_p1  # (27): e_p + (k_q / k_p1) e_s
    else:
        pulled = drive = cut(to_goal, gains.limit / gains.k_p1)
    y = np.r_[pulled, attitude_error(e, e_d)]
    tau = -J_T @ np.diag([gains.k_p1] * 3 + [gains.k_p2] * 3) @ y - K_v @ nu + J_T @ np.r_[pushed, 0.0, 0.0, 0.0]
    s = J_T @ np.r_[drive, y[3:]]
    if name == "pd":
        return tau, np.zeros(0)
    if name == "antonelli":
        Phi = np.block([[O, R.T, O], [cross_matrix(k), O, R.T]])
        inverse = np.diag(1.0 / np.repeat([gains.k_theta_moment, gains.k_theta, gains.k_theta_moment], 3))
        return tau + Phi @ theta, -inverse @ Phi.T @ (nu + np.repeat([gains.lambda_p, gains.lambda_a], 3) * s)
    return tau + Z @ theta, -Z.T @ (nu + np.repeat([gains.sigma_p, gains.sigma_a], 3) * s) / gains.gamma


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("name", NAMES)
def test_wrench_and_adaptation_are_the_equations(name):
    rng, regions, pushed, bounded = np.random.default_rng(5), pack([ROCK, BAND]), 0, 0
    chosen = {"k_p1": 100.0, "repulsion": 300.0}
    if name in ADAPTIVE:
        chosen |= ADAPTING[name] | {"bound": 1e3, "bound_moment": 1e3}
    for _ in range(80):
        e, e_d, nu, p = random_unit(rng), random_unit(rng), rng.normal(size=6), rng.uniform([3, 0, 0], [9, 2, 7])
        law = law_of(name, (ROCK, BAND), e_d, limit=rng.uniform(10, 1000), reach=rng.uniform(0.1, 1.2), **chosen)
        gains, keeps, tau = law.gains, law.memory.theta if name == "antonelli" else law.estimate, np.empty(6)
        keeps[:] = rng.uniform(-15.0, 15.0, keeps.size)
        theta = keeps.copy()
        law.step(VehicleState(p, e, nu, np.ones(8)), pack([GOAL]), regions, np.zeros(2), tau)
        expected, rate = textbook(name, p, e, e_d, nu, theta, gains)
        assert tau == pytest.approx(expected, rel=1e-11, abs=1e-9)
        if name == "pd":
            assert keeps.tolist() == theta.tolist()
        elif name == "antonelli":
            assert keeps == pytest.approx(theta + PERIOD * rate, rel=1e-11, abs=1e-11)
            assert law.estimate.tolist() == [-keeps[5], *keeps[:3]]
        else:
            assert keeps == pytest.approx(theta + PERIOD * rate, rel=1e-11, abs=1e-11)
        pushed += np.linalg.norm(push(p, gains)) > 0.0
        bounded += gains.k_p1 * np.linalg.norm(p - [8.0, 1.0, 3.0]) > gains.limit
    assert 20 < pushed < 80 and 20 < bounded < 80


def fly(law, net_weight, seconds, start=(0.0, 0.0, 2.0), regions=(), drag=60.0, current=(0.0, 0.0, 0.0), held=False):
    """Move a level point of 187.5 kg, linear drag, thrust cut at 76 N; return its positions and the law's estimates."""
    goal, packed = pack([GOAL]), pack(regions)
    p, v, tau = np.array(start), np.zeros(3), np.empty(6)
    positions, estimates = [], []
    for _ in range(round(seconds / PERIOD)):
        law.step(
            VehicleState(p, IDENTITY, np.r_[v, 0.0, 0.0, 0.0], np.ones(8)), goal, packed, np.ones(len(regions)), tau
        )
        force = cut(tau[:3], 76.0) + np.array([0.0, 0.0, net_weight]) - drag * (v - current)
        v = v + PERIOD * force / 187.5 * (not held)
        p = p + PERIOD * v
        positions.append(p)
        estimates.append(law.estimate.copy())
    return np.array(positions), np.array(estimates)


@pytest.mark.medium
def test_pd_droops_by_the_net_weight_over_its_gain():
    law = law_of("pd", k_p1=100.0, limit=60.0)
    positions, _ = fly(law, net_weight=12.0, seconds=100.0)
    assert positions[-1] == pytest.approx([8.0, 1.0, 3.12], abs=1e-3)


@pytest.mark.medium
@pytest.mark.parametrize("name", ["sun_cheah", "antonelli"])
@pytest.mark.parametrize("net_weight", [-12.0, pytest.param(12.0, marks=pytest.mark.slow)])
def test_adaptive_set_points_cancel_the_net_weight(name, net_weight):
    law = law_of(name, k_p1=100.0, k_v1=150.0, limit=40.0, **ADAPTING[name])
    positions, estimates = fly(law, net_weight, seconds=150.0)
    assert positions[-1] == pytest.approx([8.0, 1.0, 3.0], abs=1e-2)
    assert estimates[-1, 0] == pytest.approx(net_weight, abs=0.1)


@pytest.mark.medium
def test_unarbitrated_law_cancels_net_weight_within_its_goal_region():
    """Attraction is zero within the region, where the estimate alone balances the weight."""
    law = law_of("unarbitrated", k_p1=100.0, k_v1=150.0, limit=40.0, margin=0.2, **QUICK)
    positions, estimates = fly(law, net_weight=10.0, seconds=200.0)
    assert np.linalg.norm(positions[-500:] - [8.0, 1.0, 3.0], axis=1).max() < 0.5
    assert estimates[-1, 0] == pytest.approx(10.0, abs=0.5)


@pytest.mark.medium
def test_only_antonellis_law_cancels_a_current():
    """60 N s/m in 0.25 m/s sideways: 15 N, which the law of four parameters leaves to its proportional action."""
    drift = {}
    for name in ("sun_cheah", "antonelli"):
        law = law_of(name, k_p1=100.0, k_v1=150.0, limit=40.0, **ADAPTING[name])
        positions, _ = fly(law, 0.0, seconds=150.0, current=(0.0, 0.25, 0.0))
        drift[name] = positions[-1, 1] - 1.0
    assert drift == pytest.approx({"sun_cheah": 0.15, "antonelli": 0.0}, abs=1e-2)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("name", ADAPTIVE)
def test_estimates_stay_bounded_while_the_vehicle_is_held(name):
    law = law_of(name, bound=20.0, k_p1=100.0, limit=40.0, **ADAPTING[name])
    _, estimates = fly(law, net_weight=0.0, seconds=30.0, start=(7.9, 1.0, 1.0), held=True)
    assert np.abs(estimates[:, 0]).max() == 20.0


@pytest.mark.medium
@pytest.mark.parametrize("name", NAMES)
def test_obstacle_beside_the_path_is_passed_without_contact(name):
    rock = Region("rock", Sphere((4.0, 0.9, 2.5), 0.8), "out")
    positions, _ = fly(law_of(name, (rock, BAND)), 0.0, seconds=110.0, regions=(rock, BAND))
    from_rock = np.linalg.norm(positions - [4.0, 0.9, 2.5], axis=1)
    assert 0.8 <= from_rock.min() < 2.0
    assert np.linalg.norm(positions[-500:] - [8.0, 1.0, 3.0], axis=1).max() < 0.5


@pytest.mark.parametrize("name", LAWS)
def test_measurements_and_pose_may_be_read_only(name):
    """As outputs of an FMU are."""
    regions = (ROCK, Region("face", Orientation(tuple(IDENTITY), 0.5), "in"))
    outputs = []
    for write in (True, False):
        law = law_of(name, regions)
        state = VehicleState(np.array([3.3, 0.3, 2.2]), IDENTITY.copy(), np.full(6, 0.1), np.ones(8))
        for array in state:
            array.setflags(write=write)
        outputs.append(np.zeros(8 if law.output == "thrusters" else 6))
        law.step(state, pack([GOAL]), pack(regions), np.ones(2), outputs[-1])
    assert np.array_equal(*outputs) and outputs[0].any()


@pytest.mark.parametrize("name", EVERY)
def test_arbiter_weights_do_not_affect_the_law(name):
    given = []
    for weight in (0.0, 1.0):
        law = law_of(name, (ROCK,))
        forces = np.empty(8 if law.output == "thrusters" else 6)
        state = VehicleState(np.array([3.3, 0.3, 2.2]), IDENTITY, np.zeros(6), np.ones(8))
        law.step(state, pack([GOAL]), pack([ROCK]), np.array([weight]), forces)
        given.append(forces)
    assert (given[0] == given[1]).all() and np.abs(given[0]).max() > 1.0


@pytest.mark.parametrize("name", NAMES)
def test_missing_position_gives_nan_force(name):
    law, tau = law_of(name, (ROCK,)), np.empty(6)
    state = VehicleState(np.array([math.nan, 0.0, 2.0]), IDENTITY, np.zeros(6), np.ones(8))
    law.step(state, pack([GOAL]), pack([ROCK]), np.ones(1), tau)
    assert np.isnan(tau[:3]).all()


@pytest.mark.parametrize("name", LAWS)
def test_invalid_gains_and_setup_are_rejected_by_name(name):
    law = LAWS[name]
    for gain in law.gains_type._fields:
        for value in (-1.0, math.nan, math.inf):
            with pytest.raises(LawError, match=rf"law\.gains\.{gain} is"):
                law_of(name, **{gain: value})
    positive = {"k_p1", "gamma", "k_theta", "k_theta_moment", "observer", "pull_in", "brake"}
    for gain in positive.intersection(law.gains_type._fields):
        with pytest.raises(LawError, match=rf"{gain} is 0.0, expected a finite number above 0"):
            law_of(name, **{gain: 0.0})
    for attitude, period in ((np.ones(4), PERIOD), (np.r_[IDENTITY, 0.0], PERIOD), (IDENTITY, 0.0), (IDENTITY, np.inf)):
        with pytest.raises(LawError, match=r"quaternion|period"):
            law.for_vehicle(ODIN, law.gains_type(), attitude, period, 0)
