"""Environments: as Gymnasium expects them, with the flights of a run."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import cosim
import cosim.learning
from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.errors import RunError, ScenarioError
from cosim.learning.control_period import VEHICLE

EXACT = ["sensing.position_noise=0.0", "sensing.velocity_noise=0.0"]
ID = "subreach/Region-v0"


@pytest.fixture
def make():
    made = []

    def make(**parameters):
        made.append(gymnasium.make(ID, **parameters).unwrapped)
        return made[-1]

    yield make
    for env in made:
        env.close()


@pytest.fixture
def make_vec():
    made = []

    def make_vec(num_envs, **parameters):
        made.append(gymnasium.make_vec(ID, num_envs, vectorization_mode="vector_entry_point", **parameters))
        return made[-1]

    yield make_vec
    for envs in made:
        envs.close()


def episode(env, seed, actions):
    first, _ = env.reset(seed=seed)
    return [first, *(part for action in actions for part in env.step(action)[:2])]


@pytest.mark.medium
@pytest.mark.filterwarnings("ignore:.*Box observation space m..imum value")
@pytest.mark.parametrize(
    "parameters",
    [
        {},
        {"scenario": "harbour", "overrides": ["commands.enabled=false"], "vary": {"initial.position.2": (3.0, 4.0)}},
        {"scenario": "moving-obstacle", "overrides": ["arbiter.engine=closed"]},
    ],
)
def test_environment_passes_the_checks_of_gymnasium(make, parameters):
    check_env(make(**parameters), skip_render_check=True)


@pytest.mark.parametrize(
    "parameters",
    [
        {},
        {"vary": {"initial.position.1": (-3.5, -2.5), "regions.roof.shape.size.2": (0.6, 0.8)}},
        {"vary": {"law.gains.speed": (0.5, 1.0)}},
    ],
)
def test_a_seed_repeats_an_episode_to_the_bit(make, parameters):
    env, actions = make(**parameters), np.random.default_rng(0).uniform(-1.0, 1.0, (30, 6))
    one, other = (episode(env, seed, actions) for seed in (5, 6))
    env.step_by_law()
    for again in (env, env, make(**parameters)):
        assert all(np.array_equal(a, b) for a, b in zip(one, episode(again, 5, actions), strict=True))
    assert not all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_flights_side_by_side_are_those_of_single_environments(make, make_vec):
    actions = np.random.default_rng(1).uniform(-2.0, 2.0, (40, 3, 6))  # beyond the space they are clipped
    envs, env = make_vec(3, vary={"initial.position.0": (5.0, 6.0)}), make(vary={"initial.position.0": (5.0, 6.0)})
    seen = [envs.reset(seed=7)[0]]
    rewards = []
    for step in actions:
        observation, reward, terminated, truncated, _ = envs.step(step)
        seen.append(observation)
        rewards.append(reward)
        assert not terminated.any() and not truncated.any()
    for i in range(3):
        alone = episode(env, 7 + i, actions[:, i])
        assert np.array_equal([alone[0], *alone[1::2]], [rows[i] for rows in seen])
        assert np.array_equal(alone[2::2], [row[i] for row in rewards])


@pytest.mark.medium
def test_the_laws_episode_is_the_run_and_its_return_the_score(make):
    scenario = cosim.load_scenario("docking", EXACT)
    with FusedFlyer(Variation(scenario, [])) as flyer:
        outcome, signals = flyer.fly_one(scenario, trace=True)
    env = make(scenario=scenario)
    seen, total, over = [env.reset(seed=0)[0]], 0.0, False
    while not over:
        observation, reward, terminated, truncated, info = env.step_by_law()
        seen.append(observation)
        total, over = total + reward, terminated or truncated
    seen = np.array(seen)
    goal, n = signals["goal.clearance"], len(seen)
    assert seen[:, VEHICLE] == pytest.approx(goal[:n], abs=1e-6)
    assert terminated and info["reached"] and not info["violated"]
    assert info["time"] == pytest.approx(float(outcome["settle_time"]) + 10.0, abs=0.03)
    inside = 0.02 * np.count_nonzero(goal[1:n] >= 0.0)
    assert total == pytest.approx(-min(goal[0], 0.0) + inside - 10.0 * float(outcome["weighted_violation"]), abs=1e-9)
    # directions in which clearances grow are unit vectors, and the clearance grows along that of the goal
    directions = seen[:, VEHICLE:].reshape(n, -1)[:, 1:4]
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0, abs=1e-6)
    assert np.einsum("ij,ij->i", directions, seen[:, :3])[:100].min() > 0.0


def test_a_violation_costs_ten_times_its_integral(make):
    env = make(overrides=[*EXACT, "time.duration=4", "initial.velocity=[0,1.5,0,0,0,0]", "goal.radius=0.1"])
    env.reset(seed=0)
    rewards, truncated, n = [], False, 0
    while not truncated:
        _, reward, _, truncated, info = env.step(np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
        rewards.append(reward)
        n += 1
    assert n == 200 and info["violated"] and sum(rewards) < -1.0


def test_an_episode_that_ended_begins_anew_in_the_next_step(make_vec):
    envs = make_vec(2, overrides=["time.duration=0.1"])
    first, _ = envs.reset(seed=0)
    ends = [envs.step(np.ones((2, 6))) for _ in range(13)]
    assert [bool(truncated.all()) for *_, truncated, _ in ends] == [k in (4, 10) for k in range(13)]
    observation, rewards, *_ = ends[5]
    assert not rewards.any() and observation == pytest.approx(first, abs=0.1)
    assert ends[6][1].any()
    assert [envs.step(np.ones((2, 6)))[3].all() for _ in range(4)][-1]
    envs.reset(seed=0)  # begins those that ended, which fly in the next step
    assert envs.step(np.ones((2, 6)))[1].any()


@pytest.mark.parametrize(
    ("parameters", "error", "words"),
    [
        ({"scenario": "paper"}, RunError, "arbiter.engine is 'skfuzzy', expected 'closed' for learning"),
        ({"scenario": "docking", "overrides": ["law.name=mine.py:steer"]}, RunError, "law.name is 'mine.py:steer'"),
        ({"vary": {"initial.psition.0": (0.0, 1.0)}}, ScenarioError, "initial.psition.0"),
        ({"overrides": ["time.x=1"]}, ScenarioError, "time.x"),
        ({"scenrio": "docking"}, TypeError, "scenrio"),
    ],
)
def test_wrong_parameters_are_refused(parameters, error, words):
    with pytest.raises(error, match=words):
        gymnasium.make(ID, **parameters)
    with pytest.raises(error, match=words):
        gymnasium.make_vec(ID, 2, vectorization_mode="vector_entry_point", **parameters)
