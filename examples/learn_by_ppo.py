"""Learn to hold a place in a current: PPO of Stable-Baselines3, in eight Gymnasium environments."""

import sys

import gymnasium
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

import cosim.learning  # noqa: F401 -- it registers the environment

QUIET = ["regions=[]", "intersection=[]", "goal.radius=0.4", "time.duration=8", "time.control=0.1", "sensing.seed=1"]
START = {"initial.position.0": (6.6, 7.6), "initial.position.1": (-0.5, 0.5), "initial.position.2": (3.6, 4.4)}


def make() -> gymnasium.Env:
    """Make one environment."""
    return gymnasium.make("subreach/Region-v0", overrides=QUIET, vary=START)


def main(steps: int = 10_000) -> None:
    """Print the mean return of twenty episodes before and after learning."""
    envs = VecMonitor(DummyVecEnv([make] * 8))
    policy = PPO("MlpPolicy", envs, n_steps=256, batch_size=256, seed=0, device="cpu")
    before, after = evaluate_policy(policy, envs, 20)[0], evaluate_policy(policy.learn(steps), envs, 20)[0]
    print(f"mean return before learning {before:.2f}, after {after:.2f}, of 8 for the whole time in the goal")
    envs.close()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
