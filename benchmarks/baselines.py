"""The search for the gains of the laws for comparison, the same for all of them: random draws that race the best.

Gains are drawn log-uniformly, half of them from `RANGES`, the others around the best so far; those without a range
keep the values of their source. Each draw flies plain and hard scenes by turns, 300 of each from seed 10000 on. Safety
counts first: better is fewer violations over both, then more reached, then the lower median reach time. A draw flies
the scenes first in which the best fails, and is given up as soon as it falls behind the best over the scenes flown: a
draw that fails in all of these cannot be safer. The other laws begin with what was found for `pd`.
"""

from __future__ import annotations

import functools
import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any, NamedTuple

import msgspec
import numpy as np

from controller import LAWS
from controller.laws.pd import PdGains
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import SceneFlyer, Score
from cosim.campaigns.scenes.generator import make_scene
from cosim.campaigns.scenes.scene import Scene

KINDS = ("plain", "hard")  # of scenes
FIRST_SEED = 10_000
SCENES = 600  # plain and hard by turns
DURATION = 60.0  # s of a scene in the search; good gains have long reached the goal by then
# scenes flown by the end of each heat, and by which factor the median reach time may be above that of the best there
HEATS = ((4, 1.3), (10, 1.15), (40, 1.08), (120, 1.03), (SCENES // 2, 1.0), (SCENES, 1.0))
FIRST_HEAT = 40  # scenes that the first batch flies, before there is a best
BATCH = 10  # draws that race the same best
PHASES = (
    (0.5, math.inf),
    (0.25, 1.5),
    (0.25, 1.15),
)  # share of the draws, and within which factor of the best they are
DRAWS = 120

_FIELD = {
    "k_p1": (20.0, 600.0),
    "k_v1": (10.0, 400.0),
    "limit": (15.0, 200.0),
    "repulsion": (50.0, 5000.0),
    "reach": (0.05, 2.0),
}
RANGES: dict[str, dict[str, tuple[float, float]]] = {
    "pd": _FIELD,
    "sun_cheah": _FIELD | {"sigma_p": (0.02, 2.0), "gamma": (0.003, 30.0), "bound": (15.0, 40.0)},
    "unarbitrated": _FIELD
    | {"margin": (0.02, 0.24), "sigma_p": (0.02, 2.0), "gamma": (0.003, 30.0), "bound": (15.0, 40.0)},
    "antonelli": _FIELD | {"lambda_p": (0.02, 2.0), "k_theta": (0.003, 30.0), "bound": (15.0, 40.0)},
    "pid_cbf": _FIELD
    | {
        "repulsion": (5.0, 2000.0),
        "observer": (0.5, 8.0),
        "pull_in": (0.2, 4.0),
        "brake": (0.5, 8.0),
        "margin": (0.02, 0.3),
    },
}
# what a law's first batch has from the gains of `pd`, as they stand; the k_p1 of `unarbitrated` has another unit
FROM_PD: dict[str, tuple[str, ...]] = {
    "pd": (),
    "sun_cheah": tuple(_FIELD),
    "unarbitrated": tuple(name for name in _FIELD if name != "k_p1"),
    "antonelli": tuple(_FIELD),
    "pid_cbf": tuple(name for name in _FIELD if name != "repulsion"),  # which its barriers make needless
}


class Outcome(NamedTuple):
    """Outcome of gains over some scenes; `rank` orders outcomes, the least is the best."""

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
    scores: dict[int, Score]  # by scene

    @property
    def outcome(self) -> Outcome:
        """Outcome of its scores."""
        return outcome(self.scores.values())

    @property
    def failures(self) -> list[int]:
        """The scenes that it violates or does not reach."""
        return [i for i, score in self.scores.items() if not (score.reached and is_clean(score))]


def is_clean(score: Score) -> bool:
    """Return True if nothing was violated; a scene whose plant failed or lost its position counts as violated."""
    return score.min_clearance >= 0.0 and score.failed_step < 0


def outcome(scores: Iterable[Score]) -> Outcome:
    """Return the outcome of scores."""
    scores = tuple(scores)
    clean = [score for score in scores if is_clean(score)]
    arrived = [score for score in clean if score.reached]
    return Outcome(
        scenes=len(scores),
        violations=len(scores) - len(clean),
        reached=sum(score.reached for score in scores),
        reach_time=statistics.median(score.reach_time for score in arrived) if arrived else float("inf"),
        effort=statistics.median(score.effort for score in arrived) if arrived else float("inf"),
    )


def draws(law: str, count: int, rng: np.random.Generator, best: Any = None, near: float = math.inf) -> list[Any]:
    """Draw gains of a law.

    Parameters
    ----------
    law : str
        One of `RANGES`.
    count : int
        How many.
    rng : Generator
        Source of the random numbers.
    best : NamedTuple, optional
        Gains to draw around.
    near : float
        Within which factor of `best`, either way, and within the ranges.

    Returns
    -------
    list of NamedTuple
        Gains of the law, to four figures.
    """
    return [draw_gains(LAWS[law].gains_type, RANGES[law], rng, best, near) for _ in range(count)]


def draw_gains(
    gains_type: type[Any],
    ranges: dict[str, tuple[float, float]],
    rng: np.random.Generator,
    best: Any = None,
    near: float = math.inf,
) -> Any:
    """Draw gains of a type log-uniformly from ranges, or within a factor of the best; to four figures."""
    changes = {}
    for name, (low, high) in ranges.items():
        if best is not None:
            centre = getattr(best, name)
            low, high = max(low, centre / near), min(high, centre * near)
        changes[name] = float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.4g}")
    return gains_type(**changes)


def search(law: str, count: int, seed: int, workers: int, pd: PdGains | None = None) -> Candidate:
    """Return the best gains of a law.

    Parameters
    ----------
    law : str
        One of `RANGES`.
    count : int
        Draws, 1 or more.
    seed : int
        Of the draws.
    workers : int
        Processes; they change nothing in what is found.
    pd : PdGains, optional
        What the law's first batch has by `FROM_PD`; default: the defaults of `pd`.

    Returns
    -------
    Candidate
        The gains, and their scores over all scenes, of `DURATION` each.
    """
    rng = np.random.default_rng(seed)
    (size, _), *batches = _batches(count)
    known = {name: getattr(pd or PdGains(), name) for name in FROM_PD[law]}
    first = [Candidate(g._replace(**known), {}) for g in draws(law, size, rng)]
    with ProcessPoolExecutor(workers) as pool:
        started = pool.map(_fly_on, [(law, candidate, range(FIRST_HEAT), DURATION) for candidate in first])
        front = min(started, key=lambda candidate: candidate.outcome.rank)
        best = pool.submit(_fly_on, (law, front, range(SCENES), DURATION)).result()
        for size, near in batches:
            flown = pool.map(_race, [(law, g, best) for g in draws(law, size, rng, best.gains, near)])
            finished = [candidate for candidate in flown if len(candidate.scores) == SCENES]
            better = min([best, *finished], key=lambda candidate: candidate.outcome.rank)
            if better is not best:
                best = better
                print(f"{law}: {format_outcome(best.outcome)}", flush=True)
    return best


def _batches(count: int) -> list[tuple[int, float]]:
    """Return the size of each batch, and within which factor of the best its draws are."""
    found = []
    for share, near in PHASES:
        phase = math.ceil(share * count)
        found += [(min(BATCH, phase - done), near) for done in range(0, phase, BATCH)]
    return found


def _race(job: tuple[str, Any, Candidate]) -> Candidate:
    law, gains, best = job
    return race(gains, best, lambda candidate, scenes: _fly_on((law, candidate, scenes, DURATION)), HEATS)


def race(
    gains: Any,
    best: Candidate,
    fly_on: Callable[[Candidate, Iterable[int]], Candidate],
    heats: Sequence[tuple[int, float]],
) -> Candidate:
    """Fly gains until they fall behind the best.

    Parameters
    ----------
    gains : NamedTuple
        The gains.
    best : Candidate
        The best so far, flown in all scenes.
    fly_on : callable
        Flies a candidate in some more scenes.
    heats : sequence of (int, float)
        Scenes flown by the end of each heat, all by the end of the last, and by which factor the median reach time
        may be above that of the best there.

    Returns
    -------
    Candidate
        The gains, flown in all scenes, or in those until they fell behind.
    """
    failures = best.failures
    order = failures + [i for i in range(heats[-1][0]) if i not in failures]
    candidate = Candidate(gains, {})
    for scenes, slack in heats:
        flown = order[: len(failures) + scenes]
        candidate = fly_on(candidate, flown)
        *mine, time = candidate.outcome.rank
        *his, his_time = outcome(best.scores[i] for i in flown).rank
        if mine > his or (mine == his and time > slack * his_time):
            break
    return candidate


def _fly_on(job: tuple[str, Candidate, Iterable[int], float]) -> Candidate:
    law, (gains, scores), scenes, duration = job
    flyer = _flyer(law, duration)
    flyer.gains = gains
    return Candidate(gains, scores | {i: flyer.fly(_scene(i))[0] for i in scenes if i not in scores})


@functools.cache
def _flyer(law: str, duration: float) -> SceneFlyer:
    return SceneFlyer(law, Conditions(duration=duration))


@functools.cache
def _scene(index: int) -> Scene:
    return msgspec.convert(make_scene(FIRST_SEED + index // len(KINDS), KINDS[index % len(KINDS)]), Scene)


def format_outcome(found: Outcome) -> str:
    """Format an outcome as one line."""
    return (
        f"{found.violations} violations and {found.reached} reached of {found.scenes} scenes; "
        f"medians over those reached without violation: {found.reach_time:.2f} s, {found.effort:.0f} N s"
    )


def main(laws: Iterable[str], count: int, seed: int, workers: int) -> None:
    """Search for the gains of some laws, print them, and fly them in full; with no draws, fly the gains that they have.

    Parameters
    ----------
    laws : iterable of str
        Of `RANGES`.
    count : int
        Draws, or 0.
    seed : int
        Of the draws.
    workers : int
        Processes.
    """
    pd = PdGains()
    for law in laws:
        gains = LAWS[law].gains_type()
        if count:
            gains = search(law, count, seed, workers, pd).gains
            pd = gains if law == "pd" else pd
            for name in RANGES[law]:
                print(f"  {name} = {getattr(gains, name):.4g}")
        flown = _fly_on((law, Candidate(gains, {}), range(SCENES), Conditions().duration)).scores
        for first, kind in enumerate(KINDS):
            found = outcome(flown[i] for i in range(first, SCENES, len(KINDS)))
            print(f"{law}, {kind}, in full: {format_outcome(found)}", flush=True)
