"""The search for the gains of the laws for comparison, the same for all of them: random draws, successive halving.

Gains are drawn log-uniformly from `RANGES`; all others keep the values of their source. All draws fly the first
scenes, the better quarter of them flies more, and so on; the last ones fly all plain scenes of seeds 10000-10199. Then
the same once more with draws around the best. Better is: fewer violations, then more reached, then the lower median
reach time, all over the scenes flown so far.
"""

from __future__ import annotations

import functools
import statistics
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from typing import Any, NamedTuple

import msgspec
import numpy as np

from benchmarks.scenes import scene
from controller import LAWS
from cosim.flight import Score
from cosim.scene import Scene
from cosim.scene_run import Conditions, SceneFlyer

FIRST_SEED = 10_000
STAGES = (5, 20, 60)  # scenes flown by the end of each stage before the last
STAGE_DURATION = 60.0  # s of a scene in these stages; good gains have long reached it by then
SCENES = 200  # of the last stage, flown in full
KEPT = 4  # one in so many goes on to the next stage
NEAR = 1.5  # draws around the best: within this factor of it, either way
DRAWS = 150

_FIELD = {
    "k_p1": (20.0, 600.0),
    "k_v1": (10.0, 400.0),
    "limit": (15.0, 200.0),
    "repulsion": (50.0, 5000.0),
    "reach": (0.05, 1.2),
}
RANGES: dict[str, dict[str, tuple[float, float]]] = {
    "pd": _FIELD,
    "sun_cheah": _FIELD | {"sigma_p": (0.02, 2.0), "gamma": (0.003, 30.0), "bound": (15.0, 40.0)},
    "unarbitrated": _FIELD
    | {"margin": (0.02, 0.24), "sigma_p": (0.02, 2.0), "gamma": (0.003, 30.0), "bound": (15.0, 40.0)},
    "antonelli": _FIELD | {"lambda_p": (0.02, 2.0), "k_theta": (0.003, 30.0), "bound": (15.0, 40.0)},
}


class Outcome(NamedTuple):
    """What gains came to over some scenes; `rank` orders outcomes, the least is the best."""

    scenes: int
    violations: int
    reached: int
    reach_time: float  # s, median over scenes reached without violation
    effort: float  # N s, median over the same

    @property
    def rank(self) -> tuple[int, int, float]:
        """The key: violations, then scenes not reached, then the reach time."""
        return self.violations, self.scenes - self.reached, self.reach_time


class Candidate(NamedTuple):
    """Gains and how they flew so far."""

    gains: Any
    scores: tuple[Score, ...]

    @property
    def outcome(self) -> Outcome:
        """What its scores come to."""
        return outcome(self.scores)


def outcome(scores: Iterable[Score]) -> Outcome:
    """Return what scores come to; a scene whose plant failed or lost its position is violated."""
    scores = tuple(scores)
    clean = [score for score in scores if score.min_clearance >= 0.0 and score.failed_step < 0]
    arrived = [score for score in clean if score.reached]
    return Outcome(
        scenes=len(scores),
        violations=len(scores) - len(clean),
        reached=sum(score.reached for score in scores),
        reach_time=statistics.median(score.reach_time for score in arrived) if arrived else float("inf"),
        effort=statistics.median(score.effort for score in arrived) if arrived else float("inf"),
    )


def draws(law: str, count: int, rng: np.random.Generator, best: Any = None) -> list[Any]:
    """Draw gains of a law.

    Parameters
    ----------
    law : str
        One of `RANGES`.
    count : int
        How many.
    rng : Generator
        Whence they come.
    best : NamedTuple, optional
        To draw around, within the factor `NEAR` and the ranges; default: from the whole ranges.

    Returns
    -------
    list of NamedTuple
        Gains of the law, to four figures.
    """
    gains_type, found = LAWS[law].gains_type, []
    for _ in range(count):
        changes = {}
        for name, (low, high) in RANGES[law].items():
            if best is not None:
                centre = getattr(best, name)
                low, high = max(low, centre / NEAR), min(high, centre * NEAR)
            changes[name] = float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.4g}")
        found.append(gains_type(**changes))
    return found


def search(law: str, count: int, seed: int, workers: int) -> Candidate:
    """Return the best gains of a law, flown over all the scenes.

    Parameters
    ----------
    law : str
        One of `RANGES`.
    count : int
        Draws of each of the two rounds.
    seed : int
        Of the draws.
    workers : int
        Processes.

    Returns
    -------
    Candidate
        The gains, and their scores over all scenes.
    """
    rng = np.random.default_rng(seed)
    with ProcessPoolExecutor(workers) as pool:
        best = _halve(law, [Candidate(gains, ()) for gains in draws(law, count, rng)], pool)
        around = [Candidate(gains, ()) for gains in draws(law, count, rng, best.gains)]
        return min(best, _halve(law, around, pool), key=lambda candidate: candidate.outcome.rank)


def _halve(law: str, candidates: list[Candidate], pool: ProcessPoolExecutor) -> Candidate:
    for scenes in STAGES:
        candidates = _sorted(law, candidates, scenes, STAGE_DURATION, pool)
        candidates = candidates[: -(-len(candidates) // KEPT)]
    anew = [Candidate(candidate.gains, ()) for candidate in candidates]
    return _sorted(law, anew, SCENES, Conditions().duration, pool)[0]


def _sorted(
    law: str, candidates: list[Candidate], scenes: int, duration: float, pool: ProcessPoolExecutor
) -> list[Candidate]:
    flown = pool.map(_fly_on, [(law, candidate, scenes, duration) for candidate in candidates])
    ranked = sorted(flown, key=lambda candidate: candidate.outcome.rank)
    best = ranked[0].outcome
    print(
        f"{law}: {len(ranked)} draws over {scenes} scenes of {duration:.0f} s; best: {best.violations} violations, "
        f"{best.reached} reached, {best.reach_time:.2f} s, {best.effort:.0f} N s",
        flush=True,
    )
    return ranked


def _fly_on(job: tuple[str, Candidate, int, float]) -> Candidate:
    law, (gains, scores), scenes, duration = job
    flyer = _flyer(law, duration)
    flyer.gains = gains
    more = tuple(flyer.fly(_scene(FIRST_SEED + i))[0] for i in range(len(scores), scenes))
    return Candidate(gains, scores + more)


@functools.cache
def _flyer(law: str, duration: float) -> SceneFlyer:
    return SceneFlyer(law, Conditions(duration=duration))


@functools.cache
def _scene(seed: int) -> Scene:
    return msgspec.convert(scene(seed), Scene)


def print_candidate(law: str, candidate: Candidate) -> None:
    """Print gains and what they came to."""
    found = candidate.outcome
    for name in RANGES[law]:
        print(f"  {name} = {getattr(candidate.gains, name):.4g}")
    print(
        f"{law}: {found.violations} violations and {found.reached} reached of {found.scenes} scenes; "
        f"medians over those reached without violation: {found.reach_time:.2f} s, {found.effort:.0f} N s",
        flush=True,
    )


def main(laws: Iterable[str], count: int, seed: int, workers: int) -> None:
    """Search for the gains of some laws, and print them; with no draws, fly the gains that they have.

    Parameters
    ----------
    laws : iterable of str
        Of `RANGES`.
    count : int
        Draws of each of the two rounds, or 0.
    seed : int
        Of the draws.
    workers : int
        Processes.
    """
    for law in laws:
        if count:
            print_candidate(law, search(law, count, seed, workers))
        else:
            defaults = Candidate(LAWS[law].gains_type(), ())
            print_candidate(law, _fly_on((law, defaults, SCENES, Conditions().duration)))
