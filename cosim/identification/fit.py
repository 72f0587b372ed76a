"""The fit: robust least squares of prediction errors, in short and then long windows, with priors."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from cosim.errors import IdentificationError
from cosim.identification.causes import Cause, find_causes
from cosim.identification.delays import find_delays, move_back, within_margins
from cosim.identification.intervals import DISAGREES, RESTS, Intervals, estimate_intervals
from cosim.identification.log import Log
from cosim.identification.parameters import Parameter
from cosim.identification.residuals import Reduced, Residuals
from cosim.identification.windows import MARGINS, Window, cut_windows
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]

LONGEST_STEP, SHORTEST_STEP = 0.03, 0.015  # s, bounds of the integration step
STAGES = (4.0, 20.0)  # s, lengths of windows: short ones converge from distant starts, long ones separate the numbers
# relative decrease of the cost that ends a round: the first round, the others, the last one of a stage
_HELD, _ROUGH, _PRECISION = 0.1, 1e-2, 1e-6
_FAR = 0.03  # weight of all residuals in the first round: sampled starts are off by some 30 deviations of the noise
_EVALUATIONS = 20  # most evaluations of a round
_ROUNDS = (3, 2)  # rounds of each stage, with new weights between them; the very first one keeps the sampled starts
_HUBER = 3.0  # standard deviations, from which on the cost of a residual is linear
_OUTLIER = 6.0  # standard deviations, beyond which a component of a sample is called an outlier
_INSIDE = 0.05  # prior deviations, least distance of a start value from its bound


@dataclass(frozen=True)
class Fit:
    """Result of an identification."""

    parameters: tuple[Parameter, ...]
    values: Array  # (p,) fitted values of the parameters, in their units
    intervals: Intervals
    windows: tuple[Window, ...]  # windows of the last stage
    rejected: Counter[str]  # counts of rejected windows of the last stage, by the rule that rejected them
    residuals: tuple[Reduced, ...]  # weighted residuals of each window
    outliers: int  # number of components of samples that are outliers
    samples: int  # number of components of all samples
    step: float  # s, integration step
    delays: dict[str, float]  # s, start values of the delays by topic, from `find_delays`
    causes: tuple[Cause, ...] = ()  # causes of a poor fit, the greatest first
    command_error: float | None = None  # errors of sampled commands, relative to those of steps at random times
    forces: Array | None = None  # (windows, 3) N, NED, random force of each window, if it is estimated

    def vehicle_part(self) -> list[int]:
        """Return the indices of the vehicle's own parameters."""
        return [i for i, p in enumerate(self.parameters) if not p.is_nuisance]

    def resting(self) -> list[int]:
        """Return the indices of the vehicle's parameters that rest on their priors."""
        return [i for i in self.vehicle_part() if self.intervals.prior_part[i] > RESTS]

    def alike(self, least: float) -> Iterator[tuple[str, str]]:
        """Yield pairs whose correlation exceeds `least` in magnitude, the greatest first; no pairs of nuisances."""
        size = np.abs(np.triu(self.intervals.correlation, 1))
        for i, j in sorted(np.argwhere(size > least), key=lambda pair: -size[tuple(pair)]):
            one, other = self.parameters[i], self.parameters[j]
            if not (one.is_nuisance and other.is_nuisance):
                yield one.name, other.name

    def worst_topic(self) -> tuple[str, float]:
        """Return the topic with the greatest residuals, and their root mean square in standard deviations of noise."""
        sums: dict[str, list[float]] = {}
        for window, reduced in zip(self.windows, self.residuals, strict=True):
            count = 0
            for topic in window.topics:
                size = len(topic.times) * len(topic.components)
                sums.setdefault(topic.name, []).extend(np.square(reduced.residual[count : count + size]))
                count += size
        means = {name: float(np.sqrt(np.mean(squares))) for name, squares in sums.items()}
        worst = max(means, key=lambda name: means[name])
        return worst, means[worst]


def fit(
    logs: Sequence[Log],
    vehicle: Vehicle,
    parameters: Sequence[Parameter],
    progress: Callable[[float], None] = lambda part: None,
    random_force: bool = False,
) -> Fit:
    """Fit the free parameters so that windows of runs are predicted best."""
    with single_thread():
        return _fit(logs, vehicle, tuple(parameters), progress, random_force)


def single_thread() -> AbstractContextManager[object]:
    """Limit linear algebra to one thread: the matrices are small, and further threads would mostly wait."""
    limited: AbstractContextManager[object] = threadpool_limits(1)
    return limited


def _fit(
    logs: Sequence[Log], vehicle: Vehicle, parameters: tuple[Parameter, ...], progress: Callable[[float], None],
    random_force: bool,
) -> Fit:  # fmt: skip
    step = integration_step(logs)
    delays = find_delays(logs, vehicle, step)
    values, margins = _inside(parameters), (0.0, 0.0)
    if any(p.kind == "delay" for p in parameters):
        margins = MARGINS
        logs = [move_back(log, delays) for log in logs]
        parameters = tuple(within_margins(p, delays) for p in parameters)
        values = np.array([
            delays.get(p.plant, 0.0) if p.kind == "delay" else x for p, x in zip(parameters, values, strict=True)
        ])  # fmt: skip
    found: list[Fit] = []
    stages = tuple(zip(STAGES, _ROUNDS, strict=True))
    if random_force or any(log.sampled for log in logs):  # noise covers the additional information of long windows
        stages = ((STAGES[0], _ROUNDS[0] + 1),)
    done, total = 0, sum(rounds for _, rounds in stages) * _EVALUATIONS
    for length, rounds in stages:
        windows, rejected = cut_windows(logs, vehicle, step, length, margins)
        if not windows:
            raise IdentificationError(_nothing_left(rejected))
        problem = Problem(Residuals(logs, vehicle, parameters, windows, step, random_force))
        for turn in range(rounds):
            begun = done

            def tick(begun: int = begun) -> None:
                nonlocal done
                done = min(done + 1, begun + _EVALUATIONS)
                progress(done / total)

            precision = _PRECISION if turn == rounds - 1 else _ROUGH
            problem.residuals.holds_starts = not found and turn == 0
            if problem.residuals.holds_starts:  # residuals are those of wrong starts: numbers stay near their priors
                precision = _HELD
                problem.residuals.weights = [np.full(len(w), _FAR) for w in problem.residuals.weights]
            try:
                values = problem.solve(values, tick, precision)
            except IdentificationError:
                if not found:
                    raise
                return found[0]  # the motion over long windows does not stay finite
            done = begun + _EVALUATIONS
            if turn < rounds - 1:
                problem.reweigh()
                if not problem.residuals.holds_starts:
                    problem.residuals.update_force_deviation()
                    problem.residuals.update_command_errors(values)
        result = _result(problem, values, rejected, step, delays)
        if result.intervals.chi2 > DISAGREES:
            result = replace(result, causes=tuple(find_causes(logs, vehicle, problem.residuals, values, step)))
        found.append(result)
    progress(1.0)
    first, last = found[0], found[-1]
    return last if last.intervals.chi2 <= max(DISAGREES, first.intervals.chi2) else first


def _result(problem: Problem, values: Array, rejected: Counter[str], step: float, delays: dict[str, float]) -> Fit:
    parameters, windows, reduced = problem.residuals.parameters, problem.residuals.windows, problem.reduced
    plain = [r.residual[: len(w)] / w for r, w in zip(reduced, problem.residuals.weights, strict=True)]
    forced = problem.residuals.force_deviation is not None
    correlated = forced or problem.residuals.command_error is not None
    intervals = estimate_intervals(parameters, values, reduced, windows, problem.residuals.eliminated, correlated)
    return Fit(
        parameters, values, intervals, tuple(windows), rejected, tuple(reduced),
        sum(int((np.abs(r) > _OUTLIER).sum()) for r in plain), sum(map(len, plain)), step, delays,
        command_error=problem.residuals.command_error, forces=problem.residuals.forces() if forced else None,
    )  # fmt: skip


class Problem:
    """Problem for `scipy.optimize.least_squares`, with each window's rows reduced by QR to at most p + 1."""

    def __init__(self, residuals: Residuals) -> None:
        self.residuals = residuals
        self.reduced: list[Reduced] = []
        self._known: tuple[bytes, Array, Array] | None = None
        self._least = np.inf  # least cost since the weights changed
        parameters = residuals.parameters
        self._start = np.array([p.start for p in parameters])
        self._deviation = np.array([p.deviation for p in parameters])
        self._bounds = np.array([p.least for p in parameters]), np.array([p.most for p in parameters])

    def solve(self, values: Array, tick: Callable[[], None], precision: float) -> Array:
        """Return the best values, searched from `values`; IdentificationError if these predict no finite motion."""

        def residual(x: Array) -> Array:
            tick()
            return self._evaluate(x)[0]

        self._known, self._least = None, np.inf
        if not np.isfinite(self._evaluate(values)[0]).all():
            raise IdentificationError("the start vehicle predicts no motion that stays within numbers")
        found = least_squares(
            residual, values, lambda x: self._evaluate(x)[1], bounds=self._bounds, x_scale=self._deviation,
            ftol=precision, xtol=1e-7, gtol=1e-9, max_nfev=_EVALUATIONS,
        )  # fmt: skip
        result: Array = found.x
        self._evaluate(result)
        return result

    def reweigh(self) -> None:
        """Set the weights of the residuals by Huber's function of their present values."""
        for i, reduced in enumerate(self.reduced):
            size = np.abs(reduced.residual[: len(self.residuals.weights[i])] / self.residuals.weights[i])
            self.residuals.weights[i] = np.sqrt(np.minimum(1.0, _HUBER / np.maximum(size, 1e-12)))

    def _evaluate(self, values: Array) -> tuple[Array, Array]:
        """Return residuals, (n,), and their derivatives, (n, p), the prior's last; NaN if the motion is not finite."""
        key = values.tobytes()
        if self._known is None or self._known[0] != key:
            settings = self.residuals.settings(values)
            p = len(values)
            try:
                reduced = [self.residuals.reduced(i, settings, values) for i in range(len(self.residuals.windows))]
            except IdentificationError:
                rows = sum(min(self.residuals.rows(i), p + 1) for i in range(len(self.residuals.windows))) + p
                return np.full(rows, np.nan), np.full((rows, p), np.nan)
            few = [np.linalg.qr(np.column_stack([r.jacobian, r.residual]), mode="r") for r in reduced]
            rows_of_all = np.concatenate([*few, np.column_stack([
                np.diag(1.0 / self._deviation), (values - self._start) / self._deviation
            ])])  # fmt: skip
            cost = float(rows_of_all[:, p] @ rows_of_all[:, p])
            if cost <= self._least:
                self._least = cost
                self.residuals.keep_starts()
            self.reduced = reduced
            self._known = key, rows_of_all[:, p], rows_of_all[:, :p]
        return self._known[1], self._known[2]


def integration_step(logs: Sequence[Log]) -> float:
    """Return an integration step that fits the usual time between changes of the commands, 15 to 30 ms [s]."""
    spans = []
    for log in logs:
        commands = np.concatenate([log.thrust, log.wrench], axis=1)
        changes = log.times[1:][(np.diff(commands, axis=0) != 0.0).any(axis=1)]
        spans.append(np.diff(changes))
    all_spans = np.concatenate(spans)
    usual = float(np.median(all_spans)) if len(all_spans) else LONGEST_STEP
    if usual >= SHORTEST_STEP:
        return usual / math.ceil(usual / LONGEST_STEP - 1e-6)
    return usual * math.ceil(SHORTEST_STEP / usual - 1e-6)


def _inside(parameters: Sequence[Parameter]) -> Array:
    """Return the start values, moved away from their bounds."""
    return np.array([
        np.clip(p.start, p.least + _INSIDE * p.deviation, p.most - _INSIDE * p.deviation) for p in parameters
    ])  # fmt: skip


def _nothing_left(rejected: Counter[str]) -> str:
    if not rejected:
        return f"no run is long enough, expected {STAGES[-1]:g} s of commands with samples"
    return f"no window is left: {'; '.join(f'{n} since {reason}' for reason, n in rejected.most_common())}"
