"""Learn to hold a place in a current: a linear policy, by the cross-entropy method, in a Gymnasium environment."""

import sys

import gymnasium
import numpy as np

import cosim.learning  # noqa: F401 -- it registers the environment

FLIGHTS, ELITE = 64, 12
QUIET = ["regions=[]", "intersection=[]", "goal.radius=0.4", "time.duration=8", "sensing.seed=1"]
START = {"initial.position.0": (6.6, 7.6), "initial.position.1": (-0.5, 0.5), "initial.position.2": (3.6, 4.4)}


def main(generations: int = 30) -> float:
    """Print the mean return of each generation's best flights; return the last one."""
    envs = gymnasium.make_vec(
        "subreach/Region-v0", FLIGHTS, vectorization_mode="vector_entry_point", overrides=QUIET, vary=START
    )
    rng, seen = np.random.default_rng(0), 12  # the goal from the vehicle, direction down, velocity
    mean, deviation = np.zeros((6, seen)), np.full((6, seen), 0.5)
    for generation in range(generations):
        policies = mean + deviation * rng.standard_normal((FLIGHTS, 6, seen))
        observations, _ = envs.reset(seed=generation)
        returns, over = np.zeros(FLIGHTS), np.zeros(FLIGHTS, dtype=bool)
        while not over.all():
            actions = np.einsum("fas,fs->fa", policies, observations[:, :seen])
            observations, rewards, terminated, truncated, _ = envs.step(actions)
            returns += np.where(over, 0.0, rewards)
            over |= terminated | truncated
        best = policies[np.argsort(returns)[-ELITE:]]
        mean, deviation = best.mean(axis=0), best.std(axis=0) + 0.02
        print(f"generation {generation}: {np.sort(returns)[-ELITE:].mean():.2f}, of 8 for the whole time in the goal")
    envs.close()
    return float(np.sort(returns)[-ELITE:].mean())


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
