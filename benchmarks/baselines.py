"""The search for the gains of the laws for comparison, the same for all of them: random draws that race the best.

Gains are drawn log-uniformly, half of them from `RANGES`, the others around the best so far; those without a range
keep their defaults. Each draw flies plain and hard scenes alternately, 300 of each from seed 10000 on. Safety counts
first: better is fewer violations over both, then more goals reached, then the lower median reach time. A draw first
flies the scenes in which the best fails, and stops as soon as it falls behind the best over the scenes flown: a draw
that fails in all of these cannot be safer. The first draws of the other laws use the gains found for `pd`.
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

KINDS = ("plain", "hard")  # kinds of scenes, flown alternately
FIRST_SEED = 10_000
SCENES = 600  # number of scenes, plain and hard ones together
DURATION = 60.0  # s, duration of a scene in the search; good gains reach the goal much earlier
# for each heat: scenes flown by its end beside those in which the best fails, maximum ratio of median reach times
HEATS = ((4, 1.3), (10, 1.15), (40, 1.08), (120, 1.03), (SCENES // 2, 1.0), (SCENES, 1.0))
FIRST_HEAT = 40  # number of scenes that the first batch flies, before there is a best
BATCH = 10  # number of draws that race the same best
# for each phase: fraction of the draws, and greatest factor between their gains and those of the best
PHASES = (
    (0.5, math.inf),
    (0.25, 1.5),
    (0.25, 1.15),
)
DRAWS = 120  # default number of draws for a law

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
# gains of `pd` that the first batch of a law uses unchanged; the k_p1 of `unarbitrated` has another unit
FROM_PD: dict[str, tuple[str, ...]] = {
    "pd": (),
    "sun_cheah": tuple(_FIELD),
    "unarbitrated": tuple(name for name in _FIELD if name != "k_p1"),
    "antonelli": tuple(_FIELD),
    "pid_cbf": tuple(name for name in _FIELD if name != "repulsion"),  # its barriers replace the repulsion
}


class Outcome(NamedTuple):
    """Outcome of gains over some scenes; `rank` orders outcomes, the least is the best."""

    scenes: int  # number of scenes
    violations: int  # number of scenes with a violation
    reached: int  # number of scenes whose goal was reached
    reach_time: float  # s, median over the scenes reached without violation
    effort: float  # N s, median over the scenes reached without violation

    @property
    def rank(self) -> tuple[int, int, float]:
        """Sort key: violations, then goals not reached, then the reach time [s]."""
        return self.violations, self.scenes - self.reached, self.reach_time


class Candidate(NamedTuple):
    """Gains with their scores in the scenes flown so far."""

    gains: Any
    scores: dict[int, Score]  # scores by index of the scene

    @property
    def outcome(self) -> Outcome:
        """Outcome over the scenes flown so far."""
        return outcome(self.scores.values())

    @property
    def failures(self) -> list[int]:
        """Indices of the scenes with a violation or without reaching the goal."""
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
    """Draw gains of a law to four figures, within its ranges and a factor `near` of the gains `best`."""
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
            center = getattr(best, name)
            low, high = max(low, center / near), min(high, center * near)
        changes[name] = float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.4g}")
    return gains_type(**changes)


def search(law: str, count: int, seed: int, workers: int, pd: PdGains | None = None) -> Candidate:
    """Search for the best gains of a law; `pd` has those for its first batch, see `FROM_PD`."""
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
    """Return the size of each batch, and the greatest factor between its draws and the best."""
    batches = []
    for share, near in PHASES:
        phase = math.ceil(share * count)
        batches += [(min(BATCH, phase - done), near) for done in range(0, phase, BATCH)]
    return batches


def _race(job: tuple[str, Any, Candidate]) -> Candidate:
    law, gains, best = job
    return race(gains, best, lambda candidate, scenes: _fly_on((law, candidate, scenes, DURATION)), HEATS)


def race(
    gains: Any,
    best: Candidate,
    fly_on: Callable[[Candidate, Iterable[int]], Candidate],
    heats: Sequence[tuple[int, float]],
) -> Candidate:
    """Fly gains until they fall behind the best in a heat: number of scenes, greatest ratio of reach times."""
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


def format_outcome(outcome: Outcome) -> str:
    """Format an outcome as one line."""
    return (
        f"{outcome.violations} violations and {outcome.reached} reached of {outcome.scenes} scenes; "
        f"medians over those reached without violation: {outcome.reach_time:.2f} s, {outcome.effort:.0f} N s"
    )


def main(laws: Iterable[str], count: int, seed: int, workers: int) -> None:
    """Search for the gains of some laws, print them, and fly all scenes with them; no search for a count of 0."""
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
            result = outcome(flown[i] for i in range(first, SCENES, len(KINDS)))
            print(f"{law}, {kind}, in full: {format_outcome(result)}", flush=True)
